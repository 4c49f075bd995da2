"""A gait of your own: the body goes down and up again, 2 cm, once every two seconds."""

import numpy as np

import testbed
from testbed.control.gait import Command


class Bow:
    """Made from the start; asked for a command a hundred times a second."""

    def __init__(self, start):
        self.legs = start.legs
        self.feet = start.legs.feet(start.joints)  # (4, 3) in the body frame, m

    def command(self, t, dt, measured):
        """Set points of the twelve joints at the end of the tick."""
        down = 0.01 * (1.0 - np.cos(np.pi * (t + dt)))
        return Command(joints=self.legs.joints(self.feet + np.array([0.0, 0.0, down])))


with testbed.simulate(testbed.load_scenario("stand_clean", duration=2.0), gait=Bow) as run:
    while not run.finished:
        run.step(100)

stroke = run.rows["position"][:, 2::3]  # (n, 4) vertical cylinders, m
print(f"{run.summary()['verdict']}; the body went {np.ptp(stroke, axis=0).mean() * 100:.1f} cm")
