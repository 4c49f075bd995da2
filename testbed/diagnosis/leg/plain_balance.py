"""The force residual in one compiled pass, where friction has no memory: most of a fit's time goes
here.
"""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
import numpy.typing as npt

from testbed.compiled import njit
from testbed.diagnosis.leg.series import Series
from testbed.effects.terms import ForceTerms, Signals
from testbed.estimation.cylinder import (
    EXTENDING,
    RETRACTING,
    Conditions,
    friction_value,
    stribeck_of,
    stribeck_share,
)
from testbed.estimation.leg.balance import conditions_over
from testbed.recording.leg_model import Friction

Array = npt.NDArray[np.float64]
Balance = tuple[Signals, ForceTerms, Array]
"""One recording's corrected signals, its terms, and F_ext + F_f in N."""


class PlainRows(NamedTuple):
    """The samples of one recording, each channel of shape (n,)."""

    total_n: Array
    """F_ext + F_f."""
    velocity_m_s: Array
    reference_n: Array
    used: npt.NDArray[np.bool_]
    friction: npt.NDArray[Any]
    """Equation (5): one record `Stribeck`, shape (1,)."""
    coulomb_scale: Array
    coulomb_add_n: Array
    viscous_scale: Array
    load_coefficient: float


def is_plain(terms: ForceTerms) -> bool:
    """Whether friction has no memory and grows straight with the load, and no band is taken out."""
    straight = terms.load_coefficient == 0.0 or terms.load_exponent == 1.0
    return straight and terms.presliding is None and not terms.narrow_bands


def plain_rows(series: Series, balance: Balance, friction: Friction) -> PlainRows:
    """The samples of a series whose balance `is_plain`."""
    signals, terms, total = balance
    reference = np.zeros_like(total) if series.reference_n is None else series.reference_n
    return PlainRows(
        total,
        signals.velocity_m_s,
        reference,
        series.trusted & series.clear,
        stribeck_of(friction),
        *conditions_over(signals, terms),
        float(terms.load_coefficient),
    )


@njit
def binned_error_n(rows: PlainRows, width: int) -> Array:
    """Estimated less known external force, mean over the used samples of each bin; shape (n //
    width,).
    """
    out = np.empty(len(rows.total_n) // width)
    for index in range(len(out)):
        total, count = 0.0, 0
        for sample in range(index * width, (index + 1) * width):
            if not rows.used[sample]:
                continue
            speed = rows.velocity_m_s[sample]
            now = Conditions(
                rows.coulomb_scale[sample],
                rows.coulomb_add_n[sample],
                rows.viscous_scale[sample],
                0.0,
            )
            force = rows.total_n[sample] - friction_value(speed, rows.friction[0], now)
            if force > 0.0:
                force /= 1.0 + np.sign(speed) * rows.load_coefficient
            total += force - rows.reference_n[sample]
            count += 1
        out[index] = total / max(count, 1)
    return out


@njit
def binned_columns(rows: PlainRows, width: int) -> Array:
    """Derivatives of `binned_error_n` for the numbers of (5) that enter straight; shape (n //
    width, 6).

    Viscous, Coulomb and Stribeck number of extension, then of retraction.
    """
    out = np.zeros((len(rows.total_n) // width, 6))
    for index in range(len(out)):
        count = 0
        for sample in range(index * width, (index + 1) * width):
            if not rows.used[sample]:
                continue
            count += 1
            speed, scale, thin = (
                rows.velocity_m_s[sample],
                rows.coulomb_scale[sample],
                rows.viscous_scale[sample],
            )
            column = 0 if speed >= 0.0 else 3
            way = np.sign(speed) if speed >= 0.0 else -1.0
            now = Conditions(scale, rows.coulomb_add_n[sample], thin, 0.0)
            force = rows.total_n[sample] - friction_value(speed, rows.friction[0], now)
            side = rows.friction[0].sides[EXTENDING if speed >= 0.0 else RETRACTING]
            share = -1.0 / (1.0 + way * rows.load_coefficient) if force > 0.0 else -1.0
            out[index, column] += share * thin * speed
            out[index, column + 1] += share * way * scale
            out[index, column + 2] += share * way * stribeck_share(abs(speed), side)
        out[index] /= max(count, 1)
    return out
