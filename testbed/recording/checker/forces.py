"""The force balance of one axis in a recording: its terms after a change of sign, scale or place,
and what friction of the right sign leaves of them.

Friction opposes motion. Written out, pA A_A - pB A_B + m (g cos(inclination) - a) - F_ext must look
like C sign(v) + sigma v with C, sigma >= 0.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from testbed.formats.arrays import Array
from testbed.recording.checker.motion import Even
from testbed.recording.known import Known

ZERO = 0.03
"""A constant force up to this share of the forces is a zero, and no sign or scale."""
FEW, ENOUGH = 200, 4000
"""Fewer moving samples than this say nothing about friction; more than that, nothing more."""

Change = dict[str, float]
"""Channel, or declared number, -> factor; `swap` exchanges the chambers, `absolute` takes the
atmosphere off the pressures, `weight` turns the axis round, `bore_m` is of all diameters,
`bore_alone` leaves the rod as it is."""


def _zero(force: Array, speed: Array, most: float) -> float:
    """The constant force between both directions, at most `most`: sensors' zeros, a bore a little
    off.
    """
    ways = [force[speed > 0.0], force[speed < 0.0]]
    if min(len(way) for way in ways) < FEW // 4:
        return 0.0
    return float(np.clip(0.5 * (np.median(ways[0]) + np.median(ways[1])), -most, most))


@dataclass(frozen=True, eq=False)
class Forces:
    """The terms of one axis' balance, N, (n,): chambers or actuator, weight, inertia and external
    force.
    """

    even: Even
    known: Known

    def left_over(self, change: Change) -> tuple[Array, Array, float]:
        """(y (n,), speed (n,), typical size of the forces): what friction has to explain after a
        change.
        """
        series, known = self.even.series, self.known
        turned = change.get("position", 1.0)
        terms = self._chambers(change)
        if "pressure_a" not in series and "force" in series:
            terms.append(change.get("force", 1.0) * series["force"])
        mass = change.get("moving_mass_kg", 1.0) * (known.moving_mass_kg or 0.0)
        if mass:
            gravity = change.get("weight", 1.0) * known.gravity_along_axis_m_s2
            terms.append(mass * (gravity - turned * self.even.acceleration_m_s2))
        if "reference" in series:
            terms.append(-change.get("reference", 1.0) * series["reference"])
        size = float(sum(np.sqrt(np.mean(term**2)) for term in terms))
        return np.sum(terms, axis=0), turned * self.even.speed_m_s, max(size, 1e-12)

    def _chambers(self, change: Change) -> list[Array]:
        """The chambers' forces after a change, N."""
        series, known = self.even.series, self.known
        pressures = [series.get("pressure_a"), series.get("pressure_b")]
        if "swap" in change:
            pressures.reverse()
        if known.rod_m is None:
            pressures[1] = None
        unit, bore = change.get("bore_m", 1.0) ** 2, change.get("bore_alone", 1.0) ** 2
        piston, rod = unit * bore * known.area_a_m2, unit * (known.area_a_m2 - known.area_b_m2)
        sides = (("pressure_a", piston), ("pressure_b", -max(piston - rod, 0.0)))
        return [
            side * (change.get(name, 1.0) * pressure - change.get("absolute", 0.0))
            for (name, side), pressure in zip(sides, pressures, strict=True)
            if pressure is not None
        ]

    def misfit(self, change: Change) -> float:
        """What friction of the right sign leaves of the balance, as a share of the forces' size."""
        rest_n, size_n = self.rest(change)
        return rest_n / size_n

    def rest(self, change: Change, zero: float = ZERO) -> tuple[float, float]:
        """(what friction of the right sign leaves of the balance, the forces' size), N.

        zero: share of the forces up to which a constant one is taken off first.
        """
        from scipy.optimize import nnls

        force, speed, size = self.left_over(change)
        moving = self.even.moving
        if moving.sum() < FEW:
            return float(np.sqrt(np.mean(force**2))), size
        rows = np.flatnonzero(moving)
        rows = rows[:: max(1, rows.size // ENOUGH)]
        force, speed = force[rows], speed[rows]
        force = force - _zero(force, speed, zero * size)
        columns = [np.sign(speed), speed / float(np.abs(speed).max())]
        if (
            self.known.moving_mass_kg is None
        ):  # an unknown mass: inertia and weight of the right sign
            acceleration = change.get("position", 1.0) * self.even.acceleration_m_s2[rows]
            columns.append(acceleration / max(float(np.abs(acceleration).max()), 1e-9))
        design = np.column_stack(columns)
        rest = force - design @ nnls(design, force)[0]
        return float(np.sqrt(np.mean(rest**2))), size
