"""Friction (5) identified from recordings: eight parameters with 90 % intervals, and which of them
are not shown.

A rig with recordings in the air is identified on those alone, all else as declared. A rig without
any (a bench with a load cell, a drive) is identified on all of `identify`, together with what it
leaves undeclared: its mass, and the constant force of a sensor's zero. What it declares (bore, rod,
mass) moves within its tolerance at most, and is reported. There the parts of (5) that do not help
to predict a recording set aside are left out.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from testbed.errors import InputError
from testbed.estimation.friction.declared_numbers import ASYMMETRY, PARTS, Used, fit_declared
from testbed.estimation.friction.evidence import (
    MINIMUM_ROWS,
    Evidence,
    check_closes,
    check_opposes,
    gather,
)
from testbed.estimation.friction.posterior import Side, curve, fit_side
from testbed.formats.arrays import Array
from testbed.recording.axis import Recording, Rig
from testbed.recording.known import Known
from testbed.recording.leg_model import Friction, LegModel

WIDEST_STRIBECK = 4.0
"""Ratio of an interval's ends beyond which the Stribeck speed is not known."""

SIDES = ("plus", "minus")
FIELDS = ("viscous_{}_n_s_m", "coulomb_{}_n", "stribeck_{}_n", "stribeck_speed_{}_m_s")
UNITS = ("N s/m", "N", "N", "m/s")
COULOMB = FIELDS.index("coulomb_{}_n")
OTHER_PARTS = "do not tell the Coulomb from the other parts"
BESIDE_A_CONSTANT = (
    "a constant force was found beside it: no motion parts it from friction that differs by way"
)


@dataclass(frozen=True)
class Identified:
    """One parameter: value, 90 % interval, whether the motion shows it, and if not, why."""

    name: str
    value: float
    unit: str
    interval90: tuple[float, float]
    shown: bool
    why: str = ""


@dataclass(frozen=True)
class Identification:
    """What an identification found: the model, its parameters, the residual per side in N, rows
    used, recordings.
    """

    model: LegModel
    parameters: tuple[Identified, ...]
    residual_n: tuple[float, float]
    rows: int
    recordings: tuple[str, ...]
    used: tuple[Used, ...] = ()
    """Numbers that were changed within their tolerance, or found where nothing was declared."""

    def tree(self) -> dict[str, object]:
        """As JSON carries it."""
        return {
            "parameters": {
                parameter.name: {
                    "value": parameter.value,
                    "unit": parameter.unit,
                    "interval90": list(parameter.interval90),
                    "shown": parameter.shown,
                }
                | ({"why": parameter.why} if parameter.why else {})
                for parameter in self.parameters
            },
            "residual_n": dict(zip(SIDES, self.residual_n, strict=True)),
            "declared": {unknown.name: vars(unknown) for unknown in self.used},
            "rows": self.rows,
            "recordings": list(self.recordings),
        }


def identify_rig(rig: Rig) -> Identification:
    """Identify a rig on its `identify` recordings. Raises InputError where they cannot serve,
    naming which and why.
    """
    free = [recording for recording in rig.identify if recording.is_free]
    return identify(free or list(rig.identify), rig.known, rig.kind)


def identify(
    recordings: Sequence[Recording], known: Known, kind: str = "vertical-leg"
) -> Identification:
    """Identify from given recordings whose external force is known (0 N in the air, or a load
    cell's).
    """
    evidence = gather(recordings, known)
    taken = fit_declared(evidence, known, kind)
    evidence = taken.evidence
    sides = [_side(evidence, sign, recordings, taken.form) for sign in (1.0, -1.0)]
    check_closes(max(side.residual_n for side in sides), recordings)
    check_opposes(evidence.velocity_m_s, evidence.force_n, recordings[0].folder.parent)
    if taken.constant_found:
        sides = _lopsided(sides)
    parameters = tuple(
        parameter
        for name, side in zip(SIDES, sides, strict=True)
        for parameter in _parameters(name, side, evidence, taken.constant_found)
    )
    friction = Friction(**{parameter.name: parameter.value for parameter in parameters})
    names = tuple(recording.name for recording in recordings)
    intervals = ", ".join(
        f"{parameter.name} [{parameter.interval90[0]:.4g}, {parameter.interval90[1]:.4g}]"
        for parameter in parameters
    )
    unseen = ", ".join(parameter.name for parameter in parameters if not parameter.shown)
    model = LegModel(
        rig=kind,  # type: ignore[arg-type]
        known=taken.known,
        friction=friction,
        force_offset_n=taken.offset_n,
        description=f"friction (5) identified on {', '.join(names)}; 90 % intervals: {intervals}"
        + (f"; not shown by the motion: {unseen}" if unseen else "")
        + "".join(f"; {unknown}" for unknown in taken.used),
    )
    return Identification(
        model,
        parameters,
        (sides[0].residual_n, sides[1].residual_n),
        len(evidence),
        names,
        taken.used,
    )


def _side(evidence: Evidence, sign: float, recordings: Sequence[Recording], form: str) -> Side:
    rows = evidence.velocity_m_s * sign > 0.0
    if rows.sum() < MINIMUM_ROWS // 2:
        way = "extends" if sign > 0 else "retracts"
        raise InputError(
            f"the piston hardly ever {way}: {int(rows.sum())} rows",
            file=recordings[0].folder.parent,
            allowed=f"at least {MINIMUM_ROWS // 2} rows in each direction",
        )
    return fit_side(np.abs(evidence.velocity_m_s[rows]), sign * evidence.force_n[rows], PARTS[form])


def _lopsided(sides: Sequence[Side]) -> list[Side]:
    """Both sides with draws as far apart as friction out and in may differ, which counts as alike
    where a constant force is found beside it.
    """
    sd = ASYMMETRY * float(np.mean([side.value[COULOMB] for side in sides]))
    out = []
    for side in sides:
        rng, draws = np.random.default_rng(0), side.draws.copy()
        draws[:, COULOMB] = np.maximum(draws[:, COULOMB] + rng.normal(0.0, sd, len(draws)), 0.0)
        out.append(replace(side, draws=draws))
    return out


def _parameters(
    name: str, side: Side, evidence: Evidence, constant_found: bool
) -> list[Identified]:
    low, high = np.quantile(side.draws, [0.05, 0.95], axis=0)
    low, high = np.minimum(low, side.value), np.maximum(high, side.value)
    speeds = np.abs(evidence.velocity_m_s[(evidence.velocity_m_s > 0) == (name == "plus")])
    reasons = _unseen(side, low, high, speeds)
    if constant_found and reasons[COULOMB].endswith(OTHER_PARTS):
        reasons[COULOMB] = BESIDE_A_CONSTANT
    return [
        Identified(
            field.format(name),
            float(side.value[index]),
            UNITS[index],
            (float(low[index]), float(high[index])),
            not reasons[index],
            reasons[index],
        )
        for index, field in enumerate(FIELDS)
    ]


def _unseen(side: Side, low: Array, high: Array, speed: Array) -> list[str]:
    """Why a parameter is not shown by the motion, '' where it is.

    A force counts as shown when its interval is narrower than a quarter of the friction's mean; the
    viscous one at the highest speed; the Stribeck speed when its interval spans less than a factor
    4 and F_s0 is not 0.
    """
    mean = max(float(np.mean(curve(side.value, speed))), 1e-9)
    slow, fast = np.quantile(speed, [0.02, 0.98])
    width = high - low
    span = f"speeds from {slow * 1e3:.1f} to {fast * 1e3:.1f} mm/s"
    out = ["", "", "", ""]
    if width[0] * fast > 0.25 * mean:
        out[0] = f"{span} hardly change the friction"
    if width[1] > 0.25 * mean:
        out[1] = f"{span} {OTHER_PARTS}"
    if width[2] > 0.25 * mean:
        out[2] = f"{span} hold too little of the Stribeck range"
    if low[2] <= 0.02 * mean:
        out[3] = "the Stribeck part may be absent"
    elif high[3] / low[3] > WIDEST_STRIBECK:
        out[3] = f"{span} hold too little of the Stribeck range"
    for index in range(3):
        if not side.parts[index]:
            out[index] = (
                f"left out: {span} do not show it, or data set aside are predicted no better with it"
            )
        elif high[index] <= 0.0:
            out[index] = "at its bound 0: these data would have it negative"
    return out
