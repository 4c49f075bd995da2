"""The inertial unit of a robot against gravity: its attitude and its specific force say the same
direction, or one of them is turned round or in another unit.
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from testbed.formats.arrays import Array, Flags
from testbed.machine.names import GRAVITY_M_S2
from testbed.recording.checker.finding import Finding
from testbed.recording.checker.raw import Raw

FELT = ("specific_force_x", "specific_force_y", "specific_force_z")
ANGLES = ("attitude_roll", "attitude_pitch")
STEADY = 0.1
"""Share of gravity by which the specific force of a robot that does not fall may differ from it."""
MOSTLY = 0.5
"""Share of the rows that have to be steady."""
FALLEN_RAD = 0.35
"""A body that has turned by so much since the first row has fallen (E)."""
APART_DEG, ALIKE_DEG = 10.0, 4.0
"""Angle between both directions that is an error, and one that explains it (E)."""


def check_inertial(raw: Raw) -> Iterator[Finding]:
    """A direction of gravity that attitude and specific force do not agree on, or a specific force
    that is none of a standing robot.
    """
    there = [name for name in FELT if name in raw.series]
    if 0 < len(there) < len(FELT):
        yield Finding(
            "note",
            there[0],
            "is not used",
            f"without {', '.join(name for name in FELT if name not in there)}",
            "record all three: blows and the body's acceleration are not known otherwise",
        )
    if len(there) < len(FELT) or not raw.series.keys() >= set(ANGLES):
        return
    felt = np.column_stack([raw.series[name] for name in FELT])
    size = np.linalg.norm(felt, axis=1)
    steady = np.abs(size / GRAVITY_M_S2 - 1.0) < STEADY
    if np.mean(steady) < MOSTLY:
        usual = float(np.median(size))
        yield Finding(
            "warning",
            "specific_force",
            "is not that of a robot that stands or walks",
            f"mostly {usual:.4g} m/s2, gravity is {GRAVITY_M_S2:g} m/s2",
            "declare unit g0 if the column is in it; it falls or slides, or the sensor is dead, otherwise",
        )
        return
    felt = np.median(felt[steady], axis=0)
    roll, pitch = (float(np.median(raw.series[name][steady])) for name in ANGLES)
    if max(abs(roll), abs(pitch)) > np.pi:
        return  # no angles in rad: the ranges have said so
    apart = _between_deg(felt, at_rest(roll, pitch))
    if apart > APART_DEG:
        yield _disagreeing(felt, roll, pitch, apart)


def upright(raw: Raw) -> Flags:
    """The rows (n,) until the body has turned by more than a robot on its feet does: what it does
    after a fall has nothing to do with the loads that control expects.
    """
    turned = np.zeros(len(raw.time_s))
    for name in ANGLES:
        if name in raw.series:
            turned = np.maximum(turned, np.abs(raw.series[name] - raw.series[name][0]))
    return np.asarray(np.cumsum(turned > FALLEN_RAD) == 0)


def at_rest(roll: float, pitch: float) -> Array:
    """Specific force of a resting body, body frame, (3,), m/s2: gravity turned round."""
    along = GRAVITY_M_S2 * np.cos(pitch)
    return np.array([-GRAVITY_M_S2 * np.sin(pitch), along * np.sin(roll), along * np.cos(roll)])


def _disagreeing(felt: Array, roll: float, pitch: float, apart_deg: float) -> Finding:
    """The finding, by the one change of sign that would make both agree."""
    expected = at_rest(roll, pitch)
    changes = {
        "attitude_pitch": (felt, at_rest(roll, -pitch)),
        "attitude_roll": (felt, at_rest(-roll, pitch)),
        "specific_force_x": (felt * [-1.0, 1.0, 1.0], expected),
        "specific_force_y": (felt * [1.0, -1.0, 1.0], expected),
        "specific_force_z": (felt * [1.0, 1.0, -1.0], expected),
        "specific_force": (-felt, expected),
    }
    fitting = [name for name, pair in changes.items() if _between_deg(*pair) < ALIKE_DEG]
    advice = (
        f"turn the sign of {' or '.join(fitting)}" if fitting else "see how the unit is mounted"
    )
    return Finding(
        "error",
        fitting[0] if fitting else "attitude",
        "attitude and specific force do not agree on where down is",
        f"{apart_deg:.0f} degrees apart",
        f"{advice}: pitch is positive nose down, the specific force points up at rest",
    )


def _between_deg(one: Array, other: Array) -> float:
    """Angle between two vectors (3,), deg."""
    cosine = float(one @ other) / float(np.linalg.norm(one) * np.linalg.norm(other))
    return float(np.degrees(np.arccos(np.clip(cosine, -1.0, 1.0))))
