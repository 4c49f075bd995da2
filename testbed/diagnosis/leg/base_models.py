"""The published model before any effect: friction (5) identified in the air, then on everything."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
import numpy.typing as npt

from testbed.diagnosis.leg.evidence import evidence
from testbed.diagnosis.leg.fit import Fit, solve
from testbed.diagnosis.leg.hypotheses import available
from testbed.diagnosis.leg.points import (
    DECLARED,
    HELD,
    MOST_N,
    NUISANCE,
    ZERO,
    Point,
    friction_coordinates,
    restarted,
)
from testbed.diagnosis.leg.problem import Problem
from testbed.diagnosis.leg.series import Series
from testbed.effects import of_declared
from testbed.effects.active import Active
from testbed.effects.base import Effect
from testbed.effects.terms import Coordinate
from testbed.errors import InputError
from testbed.estimation.friction.declared_numbers import MOST
from testbed.estimation.friction.evidence import check_opposes
from testbed.estimation.leg.balance import corrected, force_terms, without_friction_n
from testbed.estimation.leg.flow import EDGES, SMOOTH_DROP_PA, Edges
from testbed.recording.axis import Rig
from testbed.recording.known import DEFAULT_TOLERANCE
from testbed.recording.leg_model import Friction, LegModel

Array = npt.NDArray[np.float64]
FEWEST_SAMPLES = 30
"""Sliding samples, either way, without which no friction shows."""
MOVED_BY_EDGES = ("flow", "supply")
UNEQUAL, MOST_UNEQUAL = 0.04, 0.1
"""Share by which one metering edge differs from the four: standard deviation, and bound. E, the
triangle of `testbed/machine/workshop.yaml`: notches of one spool scatter by some per cent."""
OVERLAPPED, MOST_OVERLAPPED = 0.002, 0.006
"""Share of its travel by which a spool's edges open earlier or later than its declared dead band
says: standard deviation, and bound. E: some micrometres of a spool of a millimetre or two; far
below the `valve.deadband` that is looked for."""
METERING = (
    Coordinate(
        NUISANCE,
        "gain",
        start=1.0,
        low=0.8,
        high=1.25,
        scale=0.004,
        moves=MOVED_BY_EDGES,
        prior=(1.0, DEFAULT_TOLERANCE),
    ),
    *(
        Coordinate(
            NUISANCE,
            edge,
            start=1.0,
            low=1.0 - MOST_UNEQUAL,
            high=1.0 + MOST_UNEQUAL,
            scale=0.004,
            moves=MOVED_BY_EDGES,
            prior=(1.0, UNEQUAL),
        )
        for edge in EDGES
    ),
    Coordinate(
        NUISANCE,
        "smooth_pa",
        start=SMOOTH_DROP_PA,
        low=1e3,
        high=3e5,
        scale=0.5,
        log=True,
        moves=MOVED_BY_EDGES,
        prior=(float(np.log(SMOOTH_DROP_PA)), 0.7),
    ),
    *(
        Coordinate(
            NUISANCE,
            lap,
            start=0.0,
            low=-MOST_OVERLAPPED,
            high=MOST_OVERLAPPED,
            scale=0.001,
            moves=MOVED_BY_EDGES,
            prior=(0.0, OVERLAPPED),
        )
        for lap in ("lap_out", "lap_in")
    ),
)
"""A valve differs from its plate, and its edges from each other: never a finding."""
MOST_LATE, USUAL_LATE = 3.0, 0.75
"""Samples by which a command may act later or earlier than a row of the usual recorder says."""


def zero_force(force_scale: float) -> Coordinate:
    """Of a bench's pressure sensor and load cell, of a drive's force: nobody declares them, and
    they are no finding. `force_scale`: that of the rig's friction, N, by which a step goes.
    """
    return Coordinate(ZERO, "zero_n", 0.0, -MOST_N, MOST_N, force_scale)


def declared(rig: Rig, identified: LegModel | None = None) -> LegModel:
    """The declared model without friction; what is declared as null and cannot be 0 is filled from
    the data, a mass and a rod by their identification. The mass of a bench or a drive stays null
    where identification finds none.
    """
    known = rig.known
    changes: dict[str, float] = {}
    if identified is not None:
        # an axis that lies and goes steadily shows no mass, and a leg needs none then
        found = {number: getattr(identified.known, number) for number in not_declared(rig)}
        may_be_null = () if rig.kind == "vertical-leg" else ("moving_mass_kg",)
        changes.update(
            {
                name: value or 0.0
                for name, value in found.items()
                if value or name not in may_be_null
            }
        )
    if known.stroke_m is None:
        position_m = np.concatenate([recording.position_m for recording in rig.identify])
        changes["stroke_m"] = float(max(np.ptp(position_m), 1e-3))
    return LegModel(rig=rig.kind, known=known.model_copy(update=changes))  # type: ignore[arg-type]


def not_declared(rig: Rig) -> tuple[str, ...]:
    """Numbers that identification finds where the rig declares none: no findings."""
    needed = {
        "moving_mass_kg": True,
        "rod_m": any(recording.pressure_b_pa is not None for recording in rig.identify),
    }
    return tuple(
        name for name, needs in needed.items() if needs and getattr(rig.known, name) is None
    )


SEEN_OF_SUPPLY = Coordinate(
    NUISANCE,
    "supply_share",
    start=0.5,
    low=0.0,
    high=1.0,
    scale=0.1,
    moves=MOVED_BY_EDGES[:1],
    prior=(0.5, 0.5),
)
"""Where the supply's pressure is measured: by how much of what it wanders there it does so in front
of the edges, too."""


SET, MOST_SET = 0.01, 0.05
"""Share of the declared supply pressure by which a valve is set beside it, or its sensor reads
beside the truth: standard deviation, and bound (E). It is there without any flow."""


def _set_supply(problem: Problem) -> Coordinate:
    """By how much the supply is beside what is declared, whatever is drawn from it."""
    declared_pa = problem.base.known.supply_pressure_nominal_pa or 0.0
    most, usual = MOST_SET * declared_pa, SET * declared_pa
    moves, prior = MOVED_BY_EDGES[1:], (0.0, usual)
    return Coordinate(
        NUISANCE, "supply_off_pa", 0.0, -most, most, 0.1 * usual, moves=moves, prior=prior
    )


def _clocked(problem: Problem) -> Coordinate:
    """By how much later the command acts than the rows say: each recorder has its own order."""
    sample_s = 1.0 / min(one.full_rate_hz for one in problem.series)
    most, usual = MOST_LATE * sample_s, USUAL_LATE * sample_s
    return Coordinate(
        NUISANCE,
        "late_s",
        0.0,
        -most,
        most,
        0.1 * sample_s,
        moves=("flow",),
        prior=(0.0, usual),
    )


USUALLY_HELD, HELD_SPREAD = 0.25, 0.25
"""Samples by which a drive's force acts later than its row, and their standard deviation (E): half
a sample that of a command held until the next, none that of a sensor."""


def _commanded(problem: Problem) -> Coordinate:
    """How much later a drive's force acts than its row says, a sample at most: the recorder's, and
    no finding.
    """
    sample_s = 1.0 / min(one.full_rate_hz for one in problem.series)
    usual, spread = USUALLY_HELD * sample_s, HELD_SPREAD * sample_s
    start, scale = problem.base.force_held_s, 0.1 * sample_s
    return Coordinate(HELD, "held_s", start, 0.0, sample_s, scale, prior=(usual, spread))


def first_friction(
    series: Sequence[Series], model: LegModel, believed: Sequence[Active] = (), bench: bool = True
) -> tuple[Friction, float]:
    """(a rough friction from medians, the scale of forces in N): where the fit starts.

    `bench`: the external force is known, so that friction must oppose the motion. Raises InputError
    where it does not, or where the piston hardly moves.
    """
    total, speed = [], []
    for s in series:
        signals = corrected(s.signals, believed)
        terms = force_terms(model, signals, believed)
        y = without_friction_n(signals, terms) - (
            s.reference_n if s.reference_n is not None else 0.0
        )
        total.append(y[s.trusted])
        speed.append(s.signals.velocity_m_s[s.trusted])
    y, v = np.concatenate(total), np.concatenate(speed)
    if min((v > 0).sum(), (v < 0).sum()) < FEWEST_SAMPLES:
        raise InputError(
            f"position hardly moves: {len(v)} samples faster than 3 mm/s, both directions needed",
            allowed="recordings in which the piston slides both ways",
        )
    if bench:
        check_opposes(v, y)
    plus, minus = float(np.median(y[v > 0])), float(np.median(-y[v < 0]))
    scale = max(
        0.1 * (abs(plus) + abs(minus)), 0.3 * float(np.median(np.abs(y - np.median(y)))), 0.05
    )
    typical = max(float(np.median(np.abs(v))), 1e-3)
    viscous = 0.2 * max(plus + minus, 0.0) / 2.0 / typical
    return Friction(
        viscous_plus_n_s_m=viscous,
        coulomb_plus_n=max(plus, 0.0),
        stribeck_plus_n=0.1 * scale,
        stribeck_speed_plus_m_s=0.01,
        viscous_minus_n_s_m=viscous,
        coulomb_minus_n=max(minus, 0.0),
        stribeck_minus_n=0.1 * scale,
        stribeck_speed_minus_m_s=0.01,
    ), scale


AGAIN_M_S = 0.02
"""Stribeck speed, both ways, from which a leg's friction is fitted a second time."""


def _better(problem: Problem, fit: Fit) -> Fit:
    """The fit, or the one from other Stribeck speeds where that predicts held-out blocks better:
    valleys are flat.
    """
    coordinates = [restarted(coordinate, fit.at) for coordinate in fit.coordinates]
    coordinates = [
        replace(coordinate, start=AGAIN_M_S)
        if coordinate.name.startswith("stribeck_speed")
        else coordinate
        for coordinate in coordinates
    ]
    again = solve(problem, coordinates, fit.at, iterations=20)
    found = evidence(problem, again)
    return again if found.gain_over(evidence(problem, fit), found) > 0.0 else fit


def fit_base(problem: Problem) -> tuple[Fit, LegModel]:
    """Friction (5), a mass that is declared as null, and the nuisance; (fit, model with friction
    and mass).

    A bench that hardly accelerates shows no mass: there a null mass stays null.
    """
    friction, scale = first_friction(
        problem.series, problem.base, problem.believed, bench=problem.kind != "robot"
    )
    coordinates = friction_coordinates(friction, scale)
    if problem.with_flow:
        coordinates += [*METERING, _clocked(problem)]
        if "supply" in problem.channels():
            coordinates += [SEEN_OF_SUPPLY, _set_supply(problem)]
    if problem.kind in ("cylinder", "drive"):
        coordinates.append(zero_force(scale))
    if problem.kind == "drive":
        coordinates.append(_commanded(problem))
    if problem.base.rig == "drive" and problem.base.known.moving_mass_kg is None:
        friction = _fit_mass(problem, coordinates, friction)
        start = Point(friction, Edges(), problem.believed)
        coordinates = [restarted(coordinate, start) for coordinate in coordinates]
    coordinates += within_tolerance(problem)
    usual = usual_effects(problem)
    coordinates += [one for effect in usual for one in _usual_coordinates(problem, effect.effect)]
    effects = (*problem.believed, *usual)
    fit = solve(problem, coordinates, Point(friction, Edges(), effects), iterations=20)
    if problem.kind == "vertical-leg":
        fit = _better(problem, fit)
    if fit.at.off:
        fit = _held_to_declared(problem, fit)
    return fit, fit.model(problem.base)


def within_tolerance(problem: Problem) -> list[Coordinate]:
    """How far a bench's declared bore and, where its chamber shows, rod, and the mass of benches
    and drives, are off, as shares: priors, and no findings. A mass that nobody declares stays as
    good as free beside whatever else is fitted.

    A leg's declared numbers are those of a machine that was measured: they stay.
    """
    known, unknown = problem.base.known, problem.not_declared
    if problem.kind not in ("cylinder", "drive"):
        return []
    numbers = ["bore_m"] if problem.kind == "cylinder" else []
    if numbers and all(series.signals.pressure_b_pa is not None for series in problem.series):
        numbers.append("rod_m")
    numbers.append("moving_mass_kg")
    out = []
    for number in numbers:
        width = UNKNOWN_SHARE if number in unknown else known.tolerance(number)
        low, high = max(-MOST * width, -0.99), MOST * width
        if getattr(known, number):
            prior = (0.0, width)
            out.append(Coordinate(DECLARED, number, 0.0, low, high, 0.1 * width, prior=prior))
    return out


def usual_effects(problem: Problem) -> tuple[Active, ...]:
    """The effects that a sound rig of this kind has a little of, none of them there yet: no
    findings.
    """
    found, _ = available(problem)
    return tuple(
        Active(effect, effect.complete({effect.required[0]: 0.0}))
        for effect in found
        if effect.usual_on(problem.kind, problem.sample_s)
    )


def _usual_coordinates(problem: Problem, effect: Effect) -> list[Coordinate]:
    """How much a sound rig has of an effect, within what is usual."""
    usual = effect.usual_on(problem.kind, problem.sample_s)
    assert usual is not None
    low, high = usual
    (first, *_) = effect.coordinates()
    low, high = max(low, first.low), min(high, first.high)
    return [replace(first, start=0.0, low=low, high=high, prior=(0.0, USUAL_SD * high))]


USUAL_SD = 0.5
"""Standard deviation of what a sound rig has of an effect, as a share of the largest (E)."""


def _held_to_declared(problem: Problem, fit: Fit) -> Fit:
    """The fit with declared numbers held by their tolerance as independent samples would be:
    correlated ones would outweigh it.
    """
    memory = max(np.median(list(evidence(problem, fit).memory.values())), 1.0)
    coordinates = [restarted(coordinate, fit.at) for coordinate in fit.coordinates]
    coordinates = [
        replace(coordinate, prior=(coordinate.prior[0], coordinate.prior[1] / np.sqrt(memory)))
        if coordinate.owner == DECLARED and coordinate.prior is not None
        else coordinate
        for coordinate in coordinates
    ]
    return solve(problem, coordinates, fit.at, iterations=20)


UNKNOWN_MASS_KG, UNKNOWN_SHARE = 10.0, 0.5
"""Start and scale of a mass that nobody declares; and the share by which what was fitted for it may
still be off.
"""


def _fit_mass(problem: Problem, coordinates: Sequence[Coordinate], friction: Friction) -> Friction:
    """Put the mass that fits best into the problem's base model; the friction that goes with it."""
    mass = of_declared("moving_mass_kg")
    (parameter,) = mass.required
    unknown = [
        replace(coordinate, start=UNKNOWN_MASS_KG, low=0.0, scale=UNKNOWN_MASS_KG, prior=None)
        for coordinate in mass.coordinates()
    ]
    active = Active(mass, mass.complete({parameter: UNKNOWN_MASS_KG}))
    fixed = Point(friction, Edges(), (*problem.believed, active))
    found = solve(problem, [*coordinates, *unknown], fixed, iterations=20)
    known = problem.base.known.model_copy(
        update={"moving_mass_kg": found.at.effects[-1].values[parameter]}
    )
    problem.base = problem.base.model_copy(update={"known": known})
    problem.series = tuple(series.declared(known) for series in problem.series)
    problem.not_declared = ("moving_mass_kg",)
    return found.at.friction
