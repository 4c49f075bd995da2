"""Signs and scales of forces: the one change of sign, scale or place that would make the force
balance close.

A recording in which friction (forces.py) does not oppose motion, but would with one channel turned
round, scaled by a unit's factor or exchanged for the other chamber's, has that channel wrong. What
no single change mends is left to the diagnosis: it may be an effect.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from testbed.recording.checker.finding import Finding
from testbed.recording.checker.forces import FEW, Change, Forces
from testbed.recording.checker.zero import constant_force, zero_finding
from testbed.recording.known import Known

SAME_SHAPE = 0.9
"""Correlation from which on a load cell moves with the pressures' force."""
SAME_SCALE = 0.7, 1.4
"""Factors between which both have the same scale."""

WORST, MENDED = 0.008, 0.5
"""What is left of the balance, as a share of its forces, that calls for a change; and to which
share of that a change must bring it. Effects that a model lacks leave a few per cent and are mended
by no change of sign or scale."""
GROSS, CLOSED = 0.1, 0.05
"""A wrong unit leaves more than this share of the forces, and less than that once it is right."""
NEAR_SCALE = 0.87, 1.15
"""Factors between which a sensor's gain is off, which is for the diagnosis to find."""
BORES = 0.5, 2.0
"""Factors between which a bore may be another cylinder's; beyond them it is in another unit."""
NEAR_MASS = 0.4, 2.5
"""Factors between which a mass is off, which is for the diagnosis to find: a load on the piston."""
FAR_BETTER = 0.3
"""A scale that leaves less than this share of what a turned sign leaves is the better reason."""
FORCES = ("pressure_a", "pressure_b", "force", "reference")
DOES_NOT_CLOSE = 0.3
"""Share of the forces that is left where recordings are of no use, whatever the reason."""
ATMOSPHERE_PA = 101325.0
ALIKE = 1.25
"""Changes that mend the balance nearly as well as the best are named beside it."""
RIVAL = 3.0
"""Times what the best scale of one channel leaves, up to which another is named beside it."""
SCALES = {"bar": 1e5, "kPa": 1e3, "MPa": 1e6, "psi": 6894.76}
FORCE_SCALES = {"kN": 1e3, "kgf": 9.80665, "lbf": 4.44822}
DECLARED_SCALES = {
    "moving_mass_kg": {"g": 1e-3, "t": 1e3, "lb": 0.45359},
    "bore_m": {"cm": 0.01, "mm": 1e-3, "dm": 0.1, "in": 0.0254, "half of it, the radius": 2.0},
}
"""Declared number -> unit in which it may have been written, and what that is in SI."""
SMALLEST_PA = 1e3
"""No cylinder works below it."""
SILENT = 0.01
"""A chamber whose pressure stays below this share of the other's is not scaled by a gain that is
off: the sensor says nothing.
"""


@dataclass(frozen=True)
class Suspect:
    """One change that could be called for: of which channel, what that would mean, what to do
    then.
    """

    channel: str
    what: str
    advice: str
    change: Change


def suspects(forces: Forces, names: Mapping[str, str]) -> Iterator[Suspect]:
    """Every single change that could be called for; `names`: name in the balance -> channel of the
    recording.
    """
    here = set(forces.even.series)
    for name, label in names.items():
        if name in here:
            yield Suspect(label, "its sign is turned round", "turn its sign", {name: -1.0})
    if forces.even.moving.sum() >= FEW:
        position = names.get("position", "position")
        yield Suspect(position, "its sign is turned round", "turn its sign", {"position": -1.0})
    if {"pressure_a", "pressure_b"} <= here:
        both = f"{names['pressure_a']}, {names['pressure_b']}"
        yield Suspect(both, "the chambers are exchanged", "exchange their columns", {"swap": 1.0})
        yield _from_the_rod_end(both)
        for unit, factor in SCALES.items():
            yield from _scaled(both, unit, factor, ("pressure_a", "pressure_b"))
    pressures = sorted({"pressure_a", "pressure_b"} & here)
    for name in pressures:
        for unit, factor in SCALES.items():
            yield from _scaled(names[name], unit, factor, (name,))
    if pressures:
        label = ", ".join(names[name] for name in pressures)
        advice = "take 1.013 bar off (offset in the map), or declare gauge pressures"
        yield Suspect(label, "is absolute, not gauge", advice, {"absolute": ATMOSPHERE_PA})
    for name in sorted({"reference", "force"} & here):
        for unit, factor in FORCE_SCALES.items():
            yield from _scaled(names[name], unit, factor, (name,))
    yield from _declared(forces.known)


def _from_the_rod_end(label: str) -> Suspect:
    turned = {"swap": 1.0, "position": -1.0, "reference": -1.0, "weight": -1.0}
    return Suspect(
        label,
        "all is counted from the rod's end, where chamber A has the smaller area",
        "exchange their columns, and turn the signs of position, forces and valve, and the axis",
        turned,
    )


def _declared(known: Known) -> Iterator[Suspect]:
    """Declared numbers in another unit, and an axis that is said to stand on its head."""
    for number, units in DECLARED_SCALES.items():
        if getattr(known, number):
            for unit, factor in units.items():
                what = f"is hardly in {number.rsplit('_', 1)[-1]}: {unit}?"
                yield Suspect(f"known.{number}", what, "put it right", {number: factor})
    if known.moving_mass_kg and abs(known.gravity_along_axis_m_s2) > 1.0:
        what = "the axis is turned round: extension points up"
        yield Suspect("known.inclination_deg", what, "180 less of it", {"weight": -1.0})


def _scaled(label: str, unit: str, factor: float, names: tuple[str, ...]) -> Iterator[Suspect]:
    advice = f"declare unit {unit!r} if the column is in it"
    yield Suspect(label, f"is too small by {factor:g}", advice, dict.fromkeys(names, factor))
    yield Suspect(
        label,
        f"is too large by {factor:g}",
        "declare the unit that the column is in",
        dict.fromkeys(names, 1.0 / factor),
    )


def check_balance(
    forces: Forces,
    names: Mapping[str, str],
    near: tuple[float, float] = NEAR_SCALE,
    exact: bool = True,
) -> Iterator[Finding]:
    """The one change of sign, scale or place that the force balance calls for, if there is one.

    near: factors between which another scale of one channel is a warning, for the reference is no
    better known.
    exact: whether the reference is known well enough to tell a sensor's zero, or a bore.
    """
    as_it_is = forces.misfit({})
    if as_it_is < WORST:
        return
    trials = sorted(
        ((forces.misfit(suspect.change), suspect) for suspect in suspects(forces, names)),
        key=lambda trial: trial[0],
    )
    silent = _silent(forces) if as_it_is > GROSS else None
    trials = [
        trial
        for trial in trials
        if (silent is None or silent in trial[1].change)
        and _called_for(trial[1].change, as_it_is, trial[0])
        and _at_work(forces, trial[1].change)
        and _reads_negative(forces, trial[1].change)
        and leaves_fewer_newtons(forces, trial[1].change)
    ]
    if silent is not None and not trials:
        yield _says_nothing(names[silent], as_it_is)
        return
    scales = [] if silent is not None else _other_scales(forces, names, as_it_is, exact)
    trials = [trial for trial in trials if not _no_more_than_a_gain(trial, scales)]
    constant = constant_force(forces) if exact else None
    if (
        constant is not None
        and (not scales or constant.left < ALIKE * scales[0][0])
        and (not trials or constant.left < FAR_BETTER * trials[0][0])
    ):
        beside = [
            f"{label}: its scale" for left, label, _ in scales if left < RIVAL * constant.left
        ]
        yield zero_finding(constant, forces, names, as_it_is, beside)
        return
    open_yet = not trials or trials[0][0] > WORST
    if not trials or (open_yet and scales and scales[0][0] < FAR_BETTER * trials[0][0]):
        yield from _scaled_or_open(forces, scales, as_it_is, near)
        return
    best = trials[0][0]
    alike = [change for left, change in trials if left <= max(ALIKE * best, best + 0.1 * WORST)]
    first, others = alike[0], [f"{other.channel}: {other.what}" for other in alike[1:4]]
    others += [f"{label}: its scale, by {by:.3g}" for left, label, by in scales if left <= best]
    what = first.what + (f" (or {', or '.join(others)})" if others else "")
    yield Finding(
        "error",
        first.channel,
        what,
        f"the force balance leaves {100 * as_it_is:.3g} % of the forces as it is, "
        f"{100 * best:.2g} % after the change",
        first.advice,
    )


def _no_more_than_a_gain(trial: tuple[float, Suspect], scales: Sequence[Scale]) -> bool:
    """Whether an absolute pressure is told by no more than a gain that is a little off tells, too:
    that is for the diagnosis to find.
    """
    left, suspect = trial
    near = (scale for scale in scales if NEAR_SCALE[0] < _of_force(scale) < NEAR_SCALE[1])
    return "absolute" in suspect.change and any(scale[0] <= ALIKE * left for scale in near)


def _called_for(change: Change, before: float, after: float) -> bool:
    """Whether a change mends the balance; one of a unit has to make it close, where it did not at
    all: a channel that is scaled up beyond all others leaves little beside itself in any case.
    """
    if after > MENDED * before:
        return False
    if "absolute" in change:
        return after < min(CLOSED, MENDED**2 * before)
    if "weight" in change:
        return after < CLOSED
    turned = all(abs(factor) == 1.0 for factor in change.values())
    return turned or (before > GROSS and after < CLOSED)


def _at_work(forces: Forces, change: Change) -> bool:
    """Whether the pressures that a change scales are still those of a cylinder at work."""
    return all(
        abs(factor) * _highest_pa(forces, name) >= SMALLEST_PA
        for name, factor in change.items()
        if name.startswith("pressure") and abs(factor) < 1.0
    )


def _reads_negative(forces: Forces, change: Change) -> bool:
    """Whether the pressures whose sign a change turns read below 0, as no sound gauge does."""
    return all(
        float(np.median(forces.even.series[name])) < 0.0
        for name, factor in change.items()
        if name.startswith("pressure") and factor < 0.0
    )


def _highest_pa(forces: Forces, name: str) -> float:
    return float(np.quantile(np.abs(forces.even.series[name]), 0.99))


def _silent(forces: Forces) -> str | None:
    """The chamber whose pressure is next to nothing beside the other's, if there is one."""
    names = [name for name in ("pressure_a", "pressure_b") if name in forces.even.series]
    if len(names) < 2:
        return None
    low, high = sorted(names, key=lambda name: _highest_pa(forces, name))
    return low if _highest_pa(forces, low) < SILENT * _highest_pa(forces, high) else None


def leaves_fewer_newtons(forces: Forces, change: Change) -> bool:
    """Whether a change mends the balance in N too, and not only as a share of forces that it makes
    large.
    """
    return forces.rest(change)[0] < MENDED * forces.rest({})[0]


Scale = tuple[float, str, float]
"""(share that is left, channel's label, factor that leaves it)."""


def _other_scales(
    forces: Forces, names: Mapping[str, str], as_it_is: float, bores: bool
) -> list[Scale]:
    """The factors of single channels that make the balance close, the best first; `bores`: that of
    the declared bore, too.
    """
    labels = {"position": "position", "moving_mass_kg": "known.moving_mass_kg", **names}
    if bores:
        labels["bore_alone"] = "known.bore_m"
    found = []
    for name, label in labels.items():
        mass = forces.known.moving_mass_kg
        inertia = name in ("position", "moving_mass_kg") and mass
        bore = name == "bore_alone" and "pressure_a" in forces.even.series
        if (name in FORCES and name in forces.even.series) or inertia or bore:
            factor = _best_factor(forces, name)
            left = forces.misfit({name: factor})
            closes = left < min(MENDED**2 * as_it_is, max(CLOSED, GROSS * as_it_is))
            closes &= not bore or BORES[0] < factor < BORES[1]
            if closes and leaves_fewer_newtons(forces, {name: factor}):
                found.append((left, label, factor))
    found.sort()
    return [scale for scale in found if scale[0] <= RIVAL * found[0][0] + 0.1 * WORST]


def _of_force(scale: Scale) -> float:
    """By how much a scale multiplies forces: that of a bore by its square."""
    _, label, factor = scale
    return factor**2 if label == "known.bore_m" else factor


def _says_nothing(label: str, as_it_is: float) -> Finding:
    return Finding(
        "error",
        label,
        "reads next to nothing beside the other chamber",
        f"the force balance leaves {100 * as_it_is:.3g} % of the forces, and no unit of this "
        "channel makes it close",
        "look at its cable and its calibration",
    )


def _scaled_or_open(
    forces: Forces,
    scales: Sequence[Scale],
    as_it_is: float,
    near: tuple[float, float] = NEAR_SCALE,
) -> Iterator[Finding]:
    """The channel that wants another factor than that of a unit; or that nothing mends a balance
    which is far from closing.
    """
    shares = f"the force balance leaves {100 * as_it_is:.3g} % of the forces as it is"
    far = [scale for scale in scales if not NEAR_SCALE[0] < _of_force(scale) < NEAR_SCALE[1]]
    if scales and len(far) == len(scales):
        left, label, factor = far[0]
        others = ", ".join(f"{other}: by {by:.3g}" for _, other, by in far[1:])
        declared = "moving mass" if label == "actuator_force" else "bore"
        no_wonder = any(near[0] < _of_force(scale) < near[1] for scale in far) or any(
            label == "known.moving_mass_kg" and NEAR_MASS[0] < by < NEAR_MASS[1]
            for _, label, by in far
        )
        yield Finding(
            "warning" if no_wonder else "error",
            label,
            f"has another scale: the forces balance once it is multiplied by {factor:.3g}"
            + (f" (or {others})" if others else ""),
            f"{shares}, {100 * left:.2g} % then",
            f"put its unit, its calibration or the declared {declared} right",
        )
    elif not scales and as_it_is > DOES_NOT_CLOSE and "pressure_a" in forces.even.series:
        yield Finding(
            "warning",
            "force balance",
            "does not close",
            f"{shares}; no change of one sign, unit or scale mends it",
            "look at bore, rod, mass and inclination, and at every channel's sign and unit",
        )


def _best_factor(forces: Forces, name: str) -> float:
    """The factor of one channel with which friction of the right sign leaves least."""
    from scipy.optimize import minimize_scalar

    def left(power: float) -> float:
        return forces.misfit({name: 10.0**power})

    near = min(np.arange(-2.0, 2.1, 0.5), key=left)
    found = minimize_scalar(left, bounds=(near - 0.5, near + 0.5), options={"xatol": 1e-4})
    return float(10.0**found.x)


def check_reference(forces: Forces, label: str) -> Iterator[Finding]:
    """A load cell that moves with the piston's force, but by another factor than 1: of their sizes
    as of their swings. A constant force (a weight, a sensor's zero or gain) changes only the sizes.
    """
    series = forces.even.series
    if "reference" not in series:
        return
    total, _, _ = forces.left_over({"reference": 0.0})
    cell = series["reference"]
    if np.std(cell) < 0.05 * np.std(total) and np.std(cell) < 0.05 * np.abs(np.mean(total)):
        return
    with_mean = float(np.mean(cell * total)) / max(float(np.mean(total**2)), 1e-12)
    alike = float(np.corrcoef(cell, total)[0, 1]) if np.std(cell) * np.std(total) > 0.0 else 0.0
    of_swings = alike * float(np.std(cell)) / max(float(np.std(total)), 1e-12)
    if alike > SAME_SHAPE and not any(
        SAME_SCALE[0] < factor < SAME_SCALE[1] for factor in (with_mean, of_swings)
    ):
        yield Finding(
            "error",
            label,
            "has another scale than the force of the pressures",
            f"{with_mean:.4g} of it, correlation {alike:.3f}",
            "put the unit of the load cell, the pressures' calibration or the bore right",
        )
