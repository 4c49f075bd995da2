"""Which leg stands out: the model's expected foot loads against the estimated ones.

Where the estimate comes with its set (at rest friction may take any value between the two
break-away forces), a leg stands out when its expected load lies outside the set: friction hardly
explains it. The set is laid about what the leg's own cylinder says: an estimate that is fused with
the other legs may already have learnt that a sensor lies. Where an estimate tells its spread, the
set is that of the spread: an interval holds seals that are stuck at their utmost, too, beside which
no leg ever stands out.

Where there is only a value, three combinations of the four loads are compared, those that
equilibrium fixes: the sum, left against right and front against rear. The fourth, fl + rr against
fr + rl, is open (a tenth of a millimetre shifts hundreds of newtons). An error e on one leg shows
as e in all three, with that leg's signs.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from testbed.formats.arrays import Array
from testbed.formats.intervals import Z90
from testbed.machine.names import LEGS
from testbed.machine.scale import ROBOCLIMBER_NOMINAL_N

SIGNS = np.array([[1, 1, 1], [1, -1, 1], [1, 1, -1], [1, -1, -1]], dtype=float)
"""Row per leg fl, fr, rl, rr: its share in sum, left minus right, front minus rear."""

SMALLEST_SHARE = 0.015
"""Below this share of a foot's nominal load a leg's residual is not worth a word (E)."""
CLEAR_SHARE = 0.85
"""A leg is named when it alone explains this share of the three combinations' squares."""


@dataclass(frozen=True)
class Suspect:
    """The leg whose estimate is off by itself, by how much [N], and the share of its expected
    load: None where that is not larger than the error, of a foot in the air above all.
    """

    leg: str
    error_n: float
    share: float | None
    friction_allowed: bool = False
    """The error is what is left after friction has explained all it can."""

    def __str__(self) -> str:
        way = "less" if self.error_n > 0 else "more"
        share = "" if self.share is None else f" ({100 * abs(self.share):.1f} %)"
        size = f"{abs(self.error_n):.0f} N{share} {way}"
        least = "at least " if self.friction_allowed else ""
        end = ", more than friction mostly hides" if self.friction_allowed else ""
        return f"{self.leg} stands out: it reads {least}{size} than weight, ropes and drill call for{end}"


def share_of(error_n: float, expected_n: float) -> float | None:
    """An error as a share of the load that was expected; None where it is larger than that."""
    return None if abs(error_n) > abs(expected_n) else error_n / expected_n


def leg_alone(
    data: Mapping[str, Array], method: str, leg: str
) -> tuple[Array, Array | None, Array | None]:
    """Load of a leg from its own cylinder, and the ends of what friction leaves open of it [N],
    (rows,) each.

    The paper's (7) with the set of `method` about it, from its spread where it tells one; without
    either, `method`'s own value and set, None without a set.
    """
    low, high = (data.get(f"{method}_{end}_{leg}") for end in ("low", "high"))
    value, spread = data.get(f"estimate_friction_{leg}"), data.get(f"{method}_spread_{leg}")
    if low is None or high is None or value is None:
        return data[f"estimate_{method}_{leg}"], low, high
    half = 0.5 * (high - low) if spread is None else Z90 * spread
    return value, value - half, value + half


def load_residuals(data: Mapping[str, Array], method: str) -> dict[str, Array]:
    """Expected load less that of `leg_alone` [N], (rows,) each; legs without both columns are left
    out.
    """
    return {
        leg: data[f"expected_{leg}"] - leg_alone(data, method, leg)[0]
        for leg in LEGS
        if f"expected_{leg}" in data and f"estimate_{method}_{leg}" in data
    }


def suspect(
    residuals_n: Mapping[str, float],
    expected_n: Mapping[str, float],
    nominal_n: float = ROBOCLIMBER_NOMINAL_N,
) -> Suspect | None:
    """The one leg that explains the residuals (expected minus estimated, one number a leg), or
    None.

    Only combinations that equilibrium fixes are used, so shifts along the open one name nobody.
    """
    if any(leg not in residuals_n or not np.isfinite(residuals_n[leg]) for leg in LEGS):
        return None
    fixed = np.array([residuals_n[leg] for leg in LEGS]) @ SIGNS
    errors = SIGNS @ fixed / 3.0
    left = np.array(
        [np.sum((fixed - error * signs) ** 2) for error, signs in zip(errors, SIGNS, strict=True)]
    )
    best = int(np.argmin(left))
    if abs(errors[best]) < SMALLEST_SHARE * nominal_n or left[best] > (1.0 - CLEAR_SHARE) * float(
        np.sum(fixed**2)
    ):
        return None
    leg = LEGS[best]
    error_n = float(errors[best])
    return Suspect(leg, error_n, share_of(error_n, expected_n[leg]))


def beyond_friction(data: Mapping[str, Array], method: str) -> dict[str, Array]:
    """Per leg: how far the expected load lies above (+) or below (-) the estimate's set, 0 inside
    [N], (rows,).

    Legs whose estimate has no set are left out.
    """
    out = {}
    for leg in LEGS:
        expected = data.get(f"expected_{leg}")
        if expected is None or f"estimate_{method}_{leg}" not in data:
            continue
        _, low, high = leg_alone(data, method, leg)
        if low is not None and high is not None:
            out[leg] = np.maximum(expected - high, 0.0) + np.minimum(expected - low, 0.0)
    return out


def odd_one_out(
    gaps_n: Mapping[str, float],
    expected_n: Mapping[str, float],
    nominal_n: float = ROBOCLIMBER_NOMINAL_N,
) -> Suspect | None:
    """The one leg whose gap friction cannot explain while the others' it can, or None.

    `gaps_n`: median of `beyond_friction`, one number a leg. A leg is named when its gap is worth a
    word and more than three times any other's: a load that moved from one pair of feet to the other
    shows on all of them.
    """
    if any(leg not in gaps_n for leg in LEGS):
        return None
    first, second = sorted(LEGS, key=lambda leg: -abs(gaps_n[leg]))[:2]
    if not abs(gaps_n[first]) > max(SMALLEST_SHARE * nominal_n, 3.0 * abs(gaps_n[second])):
        return None
    share = share_of(gaps_n[first], expected_n[first])
    return Suspect(first, gaps_n[first], share, friction_allowed=True)


def residual_summary(
    data: Mapping[str, Array], names: list[str], nominal_n: float = ROBOCLIMBER_NOMINAL_N
) -> dict[str, Any]:
    """Method looked at, median residual and gap per leg [N], and the leg that stands out (None
    where nobody does).
    """
    method = best_method(names)
    if method is None:
        return {"method": None, "median_n": {}, "beyond_friction_n": {}, "stands_out": None}
    medians, gaps = (
        {leg: float(np.nanmedian(value)) for leg, value in by_leg.items()}
        for by_leg in (load_residuals(data, method), beyond_friction(data, method))
    )
    expected = {leg: float(np.nanmedian(data[f"expected_{leg}"])) for leg in medians}
    named = (
        odd_one_out(gaps, expected, nominal_n) if gaps else suspect(medians, expected, nominal_n)
    )
    return {
        "method": method,
        "median_n": medians,
        "beyond_friction_n": gaps,
        "stands_out": None if named is None else dict(named.__dict__),
    }


def best_method(names: list[str]) -> str | None:
    """The estimate to look at first: the project's own, else the paper's with the least lag."""
    own = [
        key
        for key in names
        if key not in ("one_chamber", "two_chamber", "friction", "kbf", "modified_kbf")
    ]
    for name in (*own, "kbf", "modified_kbf", "friction", "two_chamber", "one_chamber"):
        if name in names:
            return name
    return None
