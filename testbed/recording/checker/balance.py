"""Signs and scales of forces: the one change of sign, scale or place that would make the force
balance close.

Friction opposes motion. Written out, pA A_A - pB A_B + m (g cos(inclination) - a) - F_ext must look
like C sign(v) + sigma v with C, sigma >= 0. A recording in which it does not, but would with one
channel turned round, scaled by a unit's factor or exchanged for the other chamber's, has that
channel wrong. What no single change mends is
left to the diagnosis: it may be an effect.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass

import numpy as np

from testbed.recording.checker.finding import Finding
from testbed.recording.checker.motion import Even
from testbed.recording.checker.raw import Array
from testbed.recording.known import Known

SAME_SHAPE = 0.9
"""Correlation from which on a load cell moves with the pressures' force."""
SAME_SCALE = 0.7, 1.4
"""Factors between which both have the same scale."""

WORST, MENDED = 0.008, 0.5
"""What is left of the balance, as a share of its forces, that calls for a change; and to which
share of that a change must bring it. Effects that a model lacks leave a few per cent and are mended
by no change of sign or scale."""
ALIKE = 1.25
"""Changes that mend the balance nearly as well as the best are named beside it."""
SCALES = {"bar": 1e5, "kPa": 1e3, "MPa": 1e6, "psi": 6894.76}
FORCE_SCALES = {"kN": 1e3, "kgf": 9.80665, "lbf": 4.44822}
ZERO = 0.03
"""A constant force up to this share of the forces is a zero, and no sign or scale."""
FEW = 200
"""Fewer moving samples than this say nothing about friction."""

Change = dict[str, float]
"""Channel -> factor; `swap` exchanges the chambers."""


def _zero(force: Array, speed: Array, most: float) -> float:
    """The constant force between both directions, at most `most`: sensors' zeros, a bore a little
    off.
    """
    ways = [force[speed > 0.0], force[speed < 0.0]]
    if min(len(way) for way in ways) < FEW // 4:
        return 0.0
    return float(np.clip(0.5 * (np.median(ways[0]) + np.median(ways[1])), -most, most))


@dataclass(frozen=True)
class Suspect:
    """One change that could be called for: of which channel, what that would mean, what to do
    then.
    """

    channel: str
    what: str
    advice: str
    change: Change


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
        pressure_a, pressure_b = series.get("pressure_a"), series.get("pressure_b")
        if "swap" in change:
            pressure_a, pressure_b = pressure_b, pressure_a
        terms = []
        if pressure_a is not None:
            terms.append(change.get("pressure_a", 1.0) * pressure_a * known.area_a_m2)
        if pressure_b is not None and known.rod_m is not None:
            terms.append(-change.get("pressure_b", 1.0) * pressure_b * known.area_b_m2)
        if pressure_a is None and "force" in series:
            terms.append(change.get("force", 1.0) * series["force"])
        mass = known.moving_mass_kg or 0.0
        if mass:
            gravity = known.gravity_along_axis_m_s2
            terms.append(mass * (gravity - turned * self.even.acceleration_m_s2))
        if "reference" in series:
            terms.append(-change.get("reference", 1.0) * series["reference"])
        size = float(sum(np.sqrt(np.mean(term**2)) for term in terms))
        return np.sum(terms, axis=0), turned * self.even.speed_m_s, max(size, 1e-12)

    def misfit(self, change: Change) -> float:
        """What friction of the right sign leaves of the balance, as a share of the forces' size."""
        from scipy.optimize import nnls

        force, speed, size = self.left_over(change)
        moving = self.even.moving
        if moving.sum() < FEW:
            return float(np.sqrt(np.mean(force**2))) / size
        force, speed = force[moving], speed[moving]
        force = force - _zero(force, speed, ZERO * size)
        columns = [np.sign(speed), speed / float(np.abs(speed).max())]
        if (
            self.known.moving_mass_kg is None
        ):  # an unknown mass: inertia and weight of the right sign
            acceleration = change.get("position", 1.0) * self.even.acceleration_m_s2[moving]
            columns.append(acceleration / max(float(np.abs(acceleration).max()), 1e-9))
        design = np.column_stack(columns)
        rest = force - design @ nnls(design, force)[0]
        return float(np.sqrt(np.mean(rest**2))) / size


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
        for unit, factor in SCALES.items():
            yield from _scaled(both, unit, factor, ("pressure_a", "pressure_b"))
    for name in {"pressure_a", "pressure_b"} & here:
        for unit, factor in SCALES.items():
            yield from _scaled(names[name], unit, factor, (name,))
    for name in {"reference", "force"} & here:
        for unit, factor in FORCE_SCALES.items():
            yield from _scaled(names[name], unit, factor, (name,))


def _scaled(label: str, unit: str, factor: float, names: tuple[str, ...]) -> Iterator[Suspect]:
    advice = f"declare unit {unit!r} if the column is in it"
    yield Suspect(label, f"is too small by {factor:g}", advice, dict.fromkeys(names, factor))
    yield Suspect(
        label,
        f"is too large by {factor:g}",
        "declare the unit that the column is in",
        dict.fromkeys(names, 1.0 / factor),
    )


def check_balance(forces: Forces, names: Mapping[str, str]) -> Iterator[Finding]:
    """The one change of sign, scale or place that the force balance calls for, if there is one."""
    as_it_is = forces.misfit({})
    if as_it_is < WORST:
        return
    trials = sorted(
        ((forces.misfit(suspect.change), suspect) for suspect in suspects(forces, names)),
        key=lambda trial: trial[0],
    )
    if not trials or trials[0][0] > MENDED * as_it_is:
        return
    best = trials[0][0]
    alike = [change for left, change in trials if left <= max(ALIKE * best, best + 0.1 * WORST)]
    first, others = alike[0], alike[1:4]
    what = first.what
    if others:
        what += " (or " + ", or ".join(f"{other.channel}: {other.what}" for other in others) + ")"
    yield Finding(
        "error",
        first.channel,
        what,
        f"the force balance leaves {100 * as_it_is:.3g} % of the forces as it is, "
        f"{100 * best:.2g} % after the change",
        first.advice,
    )


def check_reference(forces: Forces, label: str) -> Iterator[Finding]:
    """A load cell that moves with the piston's force, but by another factor than 1."""
    series = forces.even.series
    if "reference" not in series:
        return
    total, _, _ = forces.left_over({"reference": 0.0})
    cell = series["reference"]
    if np.std(cell) < 0.05 * np.std(total) and np.std(cell) < 0.05 * np.abs(np.mean(total)):
        return
    with_mean = float(np.mean(cell * total)) / max(float(np.mean(total**2)), 1e-12)
    alike = float(np.corrcoef(cell, total)[0, 1]) if np.std(cell) * np.std(total) > 0.0 else 0.0
    if alike > SAME_SHAPE and not SAME_SCALE[0] < with_mean < SAME_SCALE[1]:
        yield Finding(
            "error",
            label,
            "has another scale than the force of the pressures",
            f"{with_mean:.4g} of it, correlation {alike:.3f}",
            "put the unit of the load cell, the pressures' calibration or the bore right",
        )
