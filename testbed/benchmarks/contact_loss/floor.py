"""The floor: what the best causal decision from the true load misses, through the sensors' own
delay and noise.

The true normal force of each foot goes through its vertical cylinder's two pressure transducers,
which err as those of the scene do: the same machine, the same draws, the same warmth of the oil.

    p_B   as the scene has it, smoothed;  p_A = (force + A_B p_B) / A_A
    z     = A_A seen(p_A) - A_B seen(p_B),  seen: the amplifier's lag, hysteresis, bow, zero and
            gain by warmth, ripple of the pump, noise, converter (world/sensing.py)
    S_k   = clip(S_(k-1) + clip((F - z_k + b_k) / (2 s), -1, 1), -H, H),  F the force of a loss, s
            the standard deviation of what z errs by

S adds up the likelihood ratio of `less than F` against `more`, at most one a sample, over a window
of 2 H samples: as long as a loss must last. b is the only thing that can be learnt of a slow error:
no load is less than nothing, so what z shows below that is the sensors', and is given back. (To
learn the level of flights too finds more losses and calls more loaded feet lost, at the same cost.)
A foot counts as lost from a threshold of S on, and is held as a detector's word is; both are set on
the tuning scenes for the least cost.

It leaves out what a decision from a foot's own sensors could not help either, and so stays a floor:
zeros and gains at the calibration's temperature, which a commissioning finds, undeclared effects
and drifting sensors, which other legs may contradict, and all that is no sensor: friction, inertia,
oil and legs that are not known. What friction hides at rest, some hundred newtons of a foot, no
sensor of pressure sees, and no detector here is free of it.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from testbed.benchmarks.contact_loss.scenes import Scene, draw
from testbed.benchmarks.contact_loss.tapes import Tape
from testbed.compiled import njit
from testbed.estimation.detectors.base import Hold
from testbed.estimation.live.uncertainty import areas_m2
from testbed.estimation.losses import LossRule
from testbed.formats.arrays import Array
from testbed.machine.groups import Sensor
from testbed.machine.model import Machine
from testbed.machine.names import LEGS, VERTICAL
from testbed.scenario.machines import machines_of
from testbed.scenario.scenario import Scenario
from testbed.world.sensing import sensor_records, transduce

NAME, TEXT = "floor", "true load through the sensors' delay and errors"
THRESHOLD = 0.0
HOLD = Hold(margin=8.0, dwell_s=0.05)
"""Of least cost on the tuning scenes, too: a foot near F is not lost anew with every blow."""
SENSOR_STREAM = 0
"""Of a run's random numbers: its transducers' (world/assembly.py)."""
SMOOTH_S = 0.05
"""Time constant of chamber B's pressure: its place in the range is wanted, not its noise."""
SURE = 3.0
"""By so many standard deviations a smoothed load must lie below nothing to show a zero."""


@dataclass(frozen=True, eq=False)
class SensorPath:
    """The pressure transducers of four vertical cylinders in one run."""

    transducers: NDArray[Any]
    """Transducer (2, 4): chamber by leg, before anything that nobody declared."""
    lag_s: Array
    """Time constant of the amplifiers, (4,)."""
    areas_m2: Array
    """(2, 4)."""
    chamber_b_pa: Array
    """What stands in chamber B, (n, 4)."""
    warm_k: Array
    """Oil's temperature less that of the calibration, (n,)."""
    slow_pa: Array
    """Standard deviation of what a transducer errs by slowly, by its data sheet, (n,)."""
    seed: int

    @classmethod
    def of(cls, scene: Scene, tape: Tape) -> SensorPath:
        """Those of a scene's machine, as drawn."""
        scenario = draw(scene).scenario
        row = tape.samples["row"]
        pressure_b = np.asarray(row["pressure_b"])[:, list(VERTICAL)]
        return cls.built(
            machines_of(scenario).truth,
            scenario,
            _lagged(pressure_b, np.full(len(LEGS), SMOOTH_S), tape.dt_s),
            np.asarray(row["oil_temperature"]),
        )

    @classmethod
    def built(
        cls, machine: Machine, scenario: Scenario, chamber_b_pa: Array, oil_degc: Array
    ) -> SensorPath:
        """Those of a machine in a run of this scenario, drawn as the run draws them."""
        rng = np.random.default_rng([scenario.seed, SENSOR_STREAM])
        drawn, _ = sensor_records(machine, scenario.sensors, rng, scenario.machine.seed)
        axes = [machine.axes[f"{leg}_vertical"] for leg in LEGS]
        bandwidth = np.array([axis.sensor.transducer_bandwidth_hz for axis in axes])
        warm_k = oil_degc - machine.sensor.calibration_temperature_degc
        return cls(
            drawn[:, list(VERTICAL)].copy(),
            1.0 / (2.0 * math.pi * bandwidth),
            np.array([areas_m2(axis) for axis in axes]).T.copy(),
            chamber_b_pa,
            warm_k,
            slow_sd_pa(machine.sensor, warm_k),
            scenario.seed,
        )

    @property
    def quick_n(self) -> Array:
        """Standard deviation of what is quick in a measured load: noise, converter, ripple, (4,),
        N.
        """
        t = self.transducers
        variance = t["noise"] ** 2 + t["resolution"] ** 2 / 12.0 + t["ripple"] ** 2 / 2.0
        return np.asarray(np.sqrt((variance * self.areas_m2**2).sum(axis=0)))

    @property
    def error_n(self) -> Array:
        """Standard deviation of all that a measured load errs by, (n, 4), N."""
        slow = np.outer(self.slow_pa, np.hypot(*self.areas_m2))
        return np.asarray(np.hypot(slow, self.quick_n))

    def measured_n(self, force_n: Array, dt_s: float) -> Array:
        """Forces (n, 4) as these sensors show them."""
        area_a, area_b = self.areas_m2
        chamber_a_pa = (force_n + area_b * self.chamber_b_pa) / area_a
        noise = np.random.default_rng([self.seed, 7]).standard_normal((2, *force_n.shape))
        out = np.zeros(force_n.shape)
        for chamber, (area, pressure) in enumerate(
            ((area_a, chamber_a_pa), (-area_b, self.chamber_b_pa))
        ):
            late = _lagged(pressure, self.lag_s, dt_s)
            out += area * _read(
                late, dt_s, self.warm_k, noise[chamber], self.transducers[chamber].copy()
            )
        return out


def slow_sd_pa(sensor: Sensor, warm_k: Array) -> Array:
    """What a data sheet says of bow, loop and zero by warmth, as one standard deviation, (n,), Pa;
    each is as likely anywhere up to its largest.
    """
    per_kelvin = sensor.thermal_zero_share * sensor.pressure_range_pa / sensor.thermal_range_k
    bent = math.hypot(sensor.pressure_linearity_pa, sensor.pressure_hysteresis_pa)
    return np.asarray(np.hypot(per_kelvin * warm_k, bent) / math.sqrt(3.0))


def _lagged(values: Array, lag_s: Array, dt_s: float) -> Array:
    """Columns (n, 4) behind first-order lags (4,), from rest."""
    from scipy.signal import lfilter

    out = np.empty(values.shape)
    for k, lag in enumerate(lag_s):
        keep = math.exp(-dt_s / lag)
        column = values[:, k]
        out[:, k] = lfilter([1.0 - keep], [1.0, -keep], column, zi=[keep * column[0]])[0]
    return out


@njit
def _read(pressure: Any, dt_s: float, warm_k: Any, noise: Any, transducers: Any) -> Any:
    """Readings (n, 4) of Transducers (4,) at these pressures, Pa."""
    out = np.empty(pressure.shape)
    for k in range(pressure.shape[1]):
        transducers[k].shown = pressure[0, k]
        for n in range(pressure.shape[0]):
            t = dt_s * n
            out[n, k] = transduce(pressure[n, k], t, warm_k[n], noise[n, k], transducers[k])
    return out


def floor_scores(normal_n: Array, path: SensorPath, rule: LossRule, dt_s: float) -> Array:
    """Scores (n, 4), -H to H, of true normal forces (n, 4)."""
    out = np.empty(normal_n.shape)
    half = 0.5 * rule.shortest_s / dt_s
    seen = path.measured_n(normal_n, dt_s)
    share = dt_s / (rule.shortest_s + dt_s)
    margin = SURE * path.quick_n * math.sqrt(0.5 * share)
    _add_up(seen, rule.force_n, path.error_n, margin, share, half, out)
    return out


@njit
def _add_up(
    seen: Any, force: float, sd: Any, margin: Any, share: float, most: float, out: Any
) -> None:
    """Loads (n, 4) as measured, with their errors sd (n, 4) -> scores (n, 4). `share`: of a sample
    in the running mean; margin (4): what that may lie below nothing by noise.
    """
    for foot in range(seen.shape[1]):
        total, zero, mean = 0.0, 0.0, seen[0, foot]
        for n in range(seen.shape[0]):
            mean += share * (seen[n, foot] - mean)
            zero = min(zero, mean + margin[foot])
            gain = (force + zero - seen[n, foot]) / (2.0 * sd[n, foot])
            total += min(max(gain, -1.0), 1.0)
            total = min(max(total, -most), most)
            out[n, foot] = total
