"""An estimator of your own over a recording: difference of the chambers' forces, through a low pass
of 20 Hz.
"""

import numpy as np

import testbed
from testbed.control.gait import rows_of
from testbed.estimation.estimator import loads_over
from testbed.machine.names import VERTICAL

PISTON_M2, RING_M2 = 0.00503, 0.00264  # 80 mm bore, 55 mm rod


class LowPass:
    """Asked for the loads of four feet at every row."""

    def start(self, dt):
        """Forget everything; `dt` lies between two rows, s."""
        self.keep, self.load = np.exp(-2.0 * np.pi * 20.0 * dt), None

    def update(self, row):
        """Loads (4,) along the vertical cylinders, N."""
        axes = list(VERTICAL)
        force = PISTON_M2 * row.pressure_a[axes] - RING_M2 * row.pressure_b[axes]
        self.load = force if self.load is None else force + self.keep * (self.load - force)
        return self.load


with testbed.simulate("stand_clean", out="recorded") as run:  # any recording of the robot will do
    run.step(3000)
recorded = testbed.read_run("recorded")
mine = LowPass()
mine.start(1e-3)
loads = loads_over(mine, rows_of(recorded.data))
for leg, load in zip(("fl", "fr", "rl", "rr"), loads.T, strict=True):
    error = np.std(load - recorded.truth[f"foot_load_{leg}"])
    shipped = np.std(recorded.data[f"estimate_own_{leg}"] - recorded.truth[f"foot_load_{leg}"])
    print(f"{leg}: scatter {error:.0f} N; shipped estimate {shipped:.0f} N")
