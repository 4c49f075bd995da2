"""A constant force that is missing both ways: a sensor's zero, or a weight that is not declared.

Friction turns round with the motion, a zero does not. Where what is left of the balance has the
same sign both ways, or nearly so, no friction explains it.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from testbed.recording.checker.finding import Finding
from testbed.recording.checker.forces import FEW, Forces

LARGE = 0.05
"""Share of the forces from which a constant one is more than sensors' zeros and a bore a little off
may leave together (E)."""
BEYOND_FRICTION = 0.6
"""Share of friction that a constant force has to exceed: seals hold one way more than the other,
but not four times as much (E)."""
AGAINST_LEFT = 3.0
"""Times that a constant force has to exceed what is left beside it, RMS."""


@dataclass(frozen=True)
class Constant:
    """A force that is missing both ways, N (+ as the chambers push), and what is left of the
    balance beside it, as a share of the forces.
    """

    force_n: float
    left: float


def constant_force(forces: Forces) -> Constant | None:
    """The force that is missing both ways; None where there is none, or a weight that nobody
    declares may be it.
    """
    known, moving = forces.known, forces.even.moving
    lies = abs(known.gravity_along_axis_m_s2) < 1.0
    if moving.sum() < FEW or (known.moving_mass_kg is None and not lies):
        return None
    force, speed, size_n = forces.left_over({})
    ways = [force[moving & (sign * speed > 0.0)] for sign in (1.0, -1.0)]
    if min(len(way) for way in ways) < FEW // 4:
        return None
    out, back = (float(np.median(way)) for way in ways)
    constant, friction = 0.5 * (out + back), 0.5 * abs(out - back)
    rest_n, _ = forces.rest({}, np.inf)
    enough = max(LARGE * size_n, BEYOND_FRICTION * friction, AGAINST_LEFT * rest_n)
    return Constant(constant, rest_n / size_n) if abs(constant) > enough else None


def zero_finding(
    constant: Constant,
    forces: Forces,
    names: Mapping[str, str],
    as_it_is: float,
    beside: Sequence[str] = (),
) -> Finding:
    """What a constant force may be: the zero of each sensor of the balance, the weight, or what is
    `beside` them.
    """
    known, series = forces.known, forces.even.series
    areas = {"pressure_a": known.area_a_m2, "pressure_b": -known.area_b_m2}
    zeros = {
        names[name]: f"{constant.force_n / area:.3g} Pa"
        for name, area in areas.items()
        if name in series and area
    }
    if "reference" in series:
        zeros[names["reference"]] = f"{-constant.force_n:.3g} N"
    elif "pressure_a" not in series:
        zeros[names["force"]] = f"{constant.force_n:.3g} N"
    first, *others = zeros
    return Finding(
        "warning",
        first,
        f"its zero is off by {zeros[first]}"
        + "".join(f"; or {name}: by {zeros[name]}" for name in others)
        + "".join(f"; or {other}" for other in beside)
        + "; or a weight is not declared",
        f"{constant.force_n:.3g} N are missing both ways; the force balance leaves "
        f"{100 * as_it_is:.3g} % of the forces as it is, {100 * constant.left:.2g} % without them",
        "put the sensor's zero, the declared mass or the inclination right",
    )
