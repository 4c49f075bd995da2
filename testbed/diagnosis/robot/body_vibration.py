"""How joints of standing legs accelerate while the body shakes: quicker than encoders show it.

Twice differenced encoders need three bins, a shaking body a part of one. What encoders smooth away
the inertial unit measures: a foot that stands does not accelerate, so that its leg's joints do what
the body does over it,

    0 = a + w x p + J q,

a the acceleration of the body's origin, w its angular one, p the foot, J its Jacobian, q the
joints'.
"""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from testbed.machine.names import LEGS
from testbed.robot.model import RobotModel

Array = npt.NDArray[np.float64]
STANDS = 0.5
"""Share of a bin from which on a foot that is meant to carry is taken to stand."""
JOINTS_A_LEG = 3


def quick(values: Array) -> Array:
    """What of means over bins (n, k) is lost by the way in which encoders tell acceleration, from
    the speed in the bin before to that in the bin after: that sees a quarter, half and a quarter of
    three bins.
    """
    padded = np.vstack([values[:1], values, values[-1:]])
    return np.asarray(values - 0.25 * padded[:-2] - 0.5 * values - 0.25 * padded[2:])


def over_standing_feet(
    model: RobotModel, joint: Array, carrying: Array, acceleration: Array, turning: Array
) -> Array:
    """(n, 12) accelerations of the joints, m/s2 and rad/s2, of legs whose feet stand, 0 of others;
    `acceleration` of the body's origin and `turning` of the body (n, 3), body frame, `carrying`
    (n, 4) share of a bin in which a foot is meant to carry.
    """
    out = np.zeros_like(joint)
    for k in range(len(joint)):
        feet, jacobians = model.feet(joint[k])
        for leg in range(len(LEGS)):
            if carrying[k, leg] > STANDS:
                own = slice(JOINTS_A_LEG * leg, JOINTS_A_LEG * (leg + 1))
                there = acceleration[k] + np.cross(turning[k], feet[leg])
                out[k, own] = -np.linalg.solve(jacobians[leg][:, own], there)
    return out


def of_lifted_feet(within: Array, change: Array, carrying: Array) -> Array:
    """(n, 12) accelerations of the joints: those `within` each bin of legs whose feet are lifted,
    `change` of the others. A leg in the air rocks on its oil some five times a second, of which a
    difference over three bins shows nothing, and no inertial unit feels it.
    """
    stands = np.repeat(carrying > STANDS, JOINTS_A_LEG, axis=1)
    return np.where(stands, change, within)
