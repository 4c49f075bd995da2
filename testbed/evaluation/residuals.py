"""Which leg stands out: the residual between the model's expected foot loads and the estimated ones.

Four loads on a stiff machine leave one combination open that equilibrium does not fix (fl + rr against fr + rl:
a tenth of a millimetre shifts hundreds of newtons). The three that it fixes, the sum, left against right and front
against rear, are enough to name one wrong leg: an error e on one leg shows as e in all three, with that leg's signs.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from testbed.parameters.names import LEGS

Array = npt.NDArray[np.float64]

SIGNS = np.array([[1, 1, 1], [1, -1, 1], [1, 1, -1], [1, -1, -1]], dtype=float)
"""Row per leg fl, fr, rl, rr: its share in sum, left minus right, front minus rear."""

SMALLEST_N = 150.0
"""Below this a leg's residual is not worth a word (E: 1.5 % of a quarter of the weight)."""
CLEAR_SHARE = 0.85
"""A leg is named when it alone explains this share of the three combinations' squares."""


@dataclass(frozen=True)
class Suspect:
    """The leg whose estimate is off by itself, by how much [N], and the share of its expected load."""

    leg: str
    error_n: float
    share: float

    def __str__(self) -> str:
        way = "less" if self.error_n > 0 else "more"
        return (
            f"{self.leg} stands out: it reads {abs(self.error_n):.0f} N ({100 * abs(self.share):.1f} %) {way} "
            "than weight, ropes and drill call for"
        )


def load_residuals(data: Mapping[str, Array], method: str) -> dict[str, Array]:
    """Expected minus estimated load per leg [N], (rows,) each; legs without both columns are left out."""
    return {
        leg: data[f"expected_{leg}"] - data[f"estimate_{method}_{leg}"]
        for leg in LEGS
        if f"expected_{leg}" in data and f"estimate_{method}_{leg}" in data
    }


def suspect(residuals_n: Mapping[str, float], expected_n: Mapping[str, float]) -> Suspect | None:
    """The one leg that explains the residuals (expected minus estimated, one number a leg), or None.

    Only combinations that equilibrium fixes are used, so shifts along the open one name nobody.
    """
    if any(leg not in residuals_n or not np.isfinite(residuals_n[leg]) for leg in LEGS):
        return None
    fixed = np.array([residuals_n[leg] for leg in LEGS]) @ SIGNS
    errors = SIGNS @ fixed / 3.0
    left = np.array([np.sum((fixed - e * signs) ** 2) for e, signs in zip(errors, SIGNS, strict=True)])
    best = int(np.argmin(left))
    if abs(errors[best]) < SMALLEST_N or left[best] > (1.0 - CLEAR_SHARE) * float(np.sum(fixed**2)):
        return None
    leg = LEGS[best]
    return Suspect(leg, float(errors[best]), float(errors[best] / expected_n[leg]))


def best_method(names: list[str]) -> str | None:
    """The estimate to look at first: the project's own, else the paper's with the least lag."""
    own = [n for n in names if n not in ("one_chamber", "two_chamber", "friction", "kbf", "modified_kbf")]
    for name in (*own, "kbf", "modified_kbf", "friction", "two_chamber", "one_chamber"):
        if name in names:
            return name
    return None
