"""Scale of forces and motion against the declared mass: what is left of the forces once friction
has its share must be the mass times the acceleration.

Where friction is most of a force, a wrong unit of all its terms leaves a balance that closes, for
friction may have any size. Inertia may not: with T = pA A_A - pB A_B - F_ext, of a drive its force,

    T = friction(v) + spring(x) + k m a

has k = 1 where force, position and mass are each in their unit. k is believed where m a explains
most of what friction and springs leave.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping

import numpy as np

from testbed.formats.arrays import Array, Flags
from testbed.recording.checker.finding import Finding
from testbed.recording.checker.forces import FEW, Forces

EXPLAINS = 0.7
"""Share of the square of what friction leaves that inertia has to explain, and
"""
FAR = 5.0
"""by which factor it may seem larger or smaller. On 204 recordings of five simulators and one
measured drive, with listed effects and others, it seems 0.8 to 1.7 times as large from that share
on; a sound piston that hardly accelerates may seem to have any mass, and explains less.
"""
SLOWEST = 0.1
"""Share of the fast speeds below which friction goes too much by its own ways."""
STRIBECK = (0.03, 0.1, 0.3)
"""Speeds over which friction may fall, as shares of the fast ones."""
WEIGHS_M_S2 = 1.0
"""Gravity along the axis from which on the weight tells force and position apart."""
SAME = 2.0
"""Factor within which two scales are the same."""


def check_inertia(forces: Forces, names: Mapping[str, str]) -> Iterator[Finding]:
    """A force, a position or a mass in another unit than declared, where the mass accelerates."""
    scale = inertial_scale(forces)
    if scale is None or 1.0 / FAR < scale < FAR:
        return
    told = [names[name] for name in ("pressure_a", "pressure_b") if name in forces.even.series]
    label = ", ".join(told) or names["force"]
    force = (label, f"its values are {scale:.3g} times too large", "its unit (kN, bar?)")
    if scale < 1.0:
        force = (label, f"its values are {1.0 / scale:.3g} times too small", force[2])
    way = "too small" if scale > 1.0 else "too large"
    size = max(scale, 1.0 / scale)
    position = ("position", f"its values are {size:.3g} times {way}", "its unit (mm?)")
    mass = ("known.moving_mass_kg", f"it is {size:.3g} times {way}", "it (in kg)")
    by_weight = _by_weight(forces)
    suspects = [force, position, mass]
    if by_weight is not None and 1.0 / SAME < by_weight < SAME:
        suspects = [position]
    elif by_weight is not None and 1.0 / SAME < by_weight / scale < SAME:
        suspects = [force, mass]
    first, *others = suspects
    yield Finding(
        "error",
        first[0],
        f"does not go with the mass that it moves: {first[1]}"
        + "".join(f"; or {channel}: {what}" for channel, what, _ in others),
        f"the forces hold {scale:.3g} times the inertia of the declared mass",
        "put right " + " or ".join(f"{channel}: {advice}" for channel, _, advice in suspects),
    )


def inertial_scale(forces: Forces) -> float | None:
    """K above, or None where no mass is declared, too little slides, or it hardly accelerates."""
    even, mass = forces.even, forces.known.moving_mass_kg
    if not mass:
        return None
    rows = _sliding(forces)
    if rows.sum() < FEW:
        return None
    speed, inertia = even.speed_m_s, mass * even.acceleration_m_s2
    total = forces.left_over({})[0] + inertia
    design = np.column_stack([*_friction(speed), *_spring(speed)])[rows]
    design = design / np.maximum(np.abs(design).max(axis=0), 1e-12)
    left, asked = (_without(design, values[rows]) for values in (total, inertia))
    shared, own, whole = float(left @ asked), float(asked @ asked), float(left @ left)
    if shared <= 0.0 or shared**2 < EXPLAINS * own * whole:
        return None
    return shared / own


def _sliding(forces: Forces) -> Flags:
    """Rows (n,) of no slow motion, whatever unit the position is in."""
    fast = np.abs(forces.even.speed_m_s)
    return np.asarray(fast > SLOWEST * float(np.quantile(fast, 0.95)))


def _friction(speed: Array) -> Iterator[Array]:
    """What friction may do with speed, each way by itself, (n,) each."""
    fast, top = np.abs(speed), max(float(np.quantile(np.abs(speed), 0.95)), 1e-12)
    for way in (speed > 0.0, speed < 0.0):
        yield np.where(way, 1.0, 0.0)
        yield np.where(way, fast, 0.0)
        for share in STRIBECK:
            yield np.where(way, np.exp(-fast / (share * top)), 0.0)


def _spring(speed: Array) -> Iterator[Array]:
    """What a spring may do along the way travelled, straight or bent, (n,) each."""
    position = np.cumsum(speed)
    away = position - float(np.mean(position))
    yield away
    yield away**2


def _without(design: Array, values: Array) -> Array:
    """What columns (n, k) leave of values (n,)."""
    return np.asarray(values - design @ np.linalg.lstsq(design, values, rcond=None)[0])


def _by_weight(forces: Forces) -> float | None:
    """The force that carries the weight over the declared mass' weight; None of an axis that lies,
    or where friction is more than it.
    """
    weight_n = (forces.known.moving_mass_kg or 0.0) * forces.known.gravity_along_axis_m_s2
    if abs(forces.known.gravity_along_axis_m_s2) < WEIGHS_M_S2:
        return None
    mass_a = (forces.known.moving_mass_kg or 0.0) * forces.even.acceleration_m_s2
    total = forces.left_over({})[0] - weight_n + mass_a
    rows, speed = _sliding(forces), forces.even.speed_m_s
    ways = [total[rows & (sign * speed > 0.0)] for sign in (1.0, -1.0)]
    if min(len(way) for way in ways) < FEW // 4:
        return None
    out, back = (float(np.median(way)) for way in ways)
    carried, friction = -0.5 * (out + back), 0.5 * abs(out - back)
    return carried / weight_n if abs(carried) > friction else None
