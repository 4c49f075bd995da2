"""What the best set of names leaves unexplained: excess over the sensors' floor, and what generic
terms find.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from testbed.diagnosis.leg.evidence import Evidence, Key, evidence
from testbed.diagnosis.leg.fit import Fit, solve
from testbed.diagnosis.leg.floor import group_floors
from testbed.diagnosis.leg.flow_structure import flow_structure
from testbed.diagnosis.leg.model_form_error import form_floors
from testbed.diagnosis.leg.points import Point, restarted
from testbed.diagnosis.leg.problem import Problem
from testbed.diagnosis.leg.search import Candidate, Search
from testbed.diagnosis.leg.slow_noise import slow_noise_n
from testbed.effects import by_name
from testbed.effects.terms import Coordinate
from testbed.effects.unnamed import UNNAMED, basis
from testbed.recording.axis import Recording

SEAL_SPEED_M_S, SEAL_RISE = 0.04, 0.3
"""Fastest Stribeck speed of a seal that slides in oil, and the share of Coulomb friction from which
its rise is fitted: with a freer one, the published friction imitates a drag that grows with the
square of the speed."""


@dataclass(frozen=True, eq=False)
class Unexplained:
    """`excess_best`: group -> residual scale over floor of the best set; `floors`: the floors.
    `usual`: group of a bench's or a drive's force -> what a sound one leaves beside that floor, N:
    slow noise of its sensors, and what no formula is true to. `encoder_m`: standard deviation of
    the encoder's rounding.

    `generic_gain`: held-out log-likelihood that the generic terms add to the best set;
    `generic_fall`: relative fall.
    `alone_gain`: what they add to the refit without any name. `flow_gain`, `flow_fall`: what linear
    terms add to the best set's flow balances.
    """

    excess_best: dict[Key, float]
    generic_gain: float
    generic_fall: float
    generic: Candidate
    alone_gain: float
    flow_gain: float
    flow_fall: float
    floors: dict[Key, float]
    encoder_m: float
    usual: dict[Key, float] = field(default_factory=dict)

    @property
    def excess(self) -> float:
        """Geometric mean of what the best set leaves over the floor, each group at least 1."""
        return _mean_excess(self.excess_best)


def _mean_excess(excess: Mapping[Key, float]) -> float:
    logs = [np.log(max(value, 1.0)) for value in excess.values()]
    return float(np.exp(np.mean(logs))) if logs else 1.0


def excess_over(found: Evidence, floors: Mapping[Key, float]) -> float:
    """Geometric mean of what an evidence leaves over the sensors' floors, each group at least 1.

    What is left counts by the larger of its scale and its root mean square: a force that comes for
    moments, as after each reversal, is in few bins and hardly moves the scale. Of 23 sound benches
    and drives of two simulators no recording's root mean square is over 0.83 of what it may be, of
    nine whose friction is of bristles of many stiffnesses the largest is 1.2 and more.
    """
    known = [name for name in floors if name in found.scale]
    return _mean_excess(
        {name: max(found.scale[name], found.rms[name]) / floors[name] for name in known}
    )


def unexplained(state: Search, recordings: Sequence[Recording]) -> Unexplained:
    """Compare the best set with the floor and with the best set plus generic terms."""
    best = state.best or state.refit
    floors = group_floors(state.problem, recordings, best.fit.at.friction)
    generic = _generic(state.problem, best)
    alone = _generic(state.problem, state.refit) if best.names else generic
    flow_gain, flow_fall = flow_structure(state.problem, best.fit)
    return Unexplained(
        {
            name: best.evidence.scale[name] / floor
            for name, floor in floors.items()
            if name in best.evidence.scale
        },
        generic.evidence.gain_over(best.evidence, generic.evidence),
        generic.evidence.largest_fall(best.evidence),
        generic,
        alone.evidence.gain_over(state.refit.evidence, alone.evidence),
        flow_gain,
        flow_fall,
        floors,
        max(recording.position_resolution_m for recording in recordings) / 12.0**0.5,
        usual_of_benches(state.problem, best.fit, recordings),
    )


def is_as_sound(problem: Problem, found: Candidate, recordings: Sequence[Recording]) -> bool:
    """Whether a set of names leaves no more in any recording than a sound bench or drive does."""
    floors = group_floors(problem, recordings, found.fit.at.friction)
    usual = usual_of_benches(problem, found.fit, recordings)
    beside = {key: float(np.hypot(floor, usual.get(key, 0.0))) for key, floor in floors.items()}
    return excess_over(found.evidence, beside) <= 1.0


def usual_of_benches(
    problem: Problem, fit: Fit, recordings: Sequence[Recording]
) -> dict[Key, float]:
    """Group of the force -> what a sound bench or drive leaves beside its sensors' white noise, N;
    none of other rigs.
    """
    if problem.kind not in ("cylinder", "drive"):
        return {}
    form, noise = form_floors(problem, fit), slow_noise_n(problem, recordings)
    return {key: float(np.hypot(form[key], value)) for key, value in noise.items()}


def _generic(problem: Problem, before: Candidate) -> Candidate:
    """A set with the generic terms, friction being a seal's, or as it was where that predicts
    better.

    Beside bristles, which take long to compute and hold the friction's shape themselves, only as it
    was.
    """
    held = any(by_name(name).replaces_friction for name in before.names)
    starts = (False,) if held else (True, False)
    fits = [fit_generic(problem, before.fit, seal) for seal in starts]
    found = [Candidate((*before.names, UNNAMED.name), fit, evidence(problem, fit)) for fit in fits]
    return max(found, key=lambda c: c.evidence.gain_over(before.evidence, c.evidence))


def fit_generic(problem: Problem, at: Fit, seal: bool) -> Fit:
    """A fit with the generic terms; `seal`: its Stribeck effect starts, and stays, like a
    seal's.
    """
    coordinates = [restarted(coordinate, at.at) for coordinate in at.coordinates]
    if seal:
        coordinates = [_like_a_seal(coordinate, at.at) for coordinate in coordinates]
    coordinates += UNNAMED.coordinates(shapes=generic_names(problem))
    effects = (*at.at.effects, UNNAMED.active())
    return solve(problem, coordinates, replace(at.at, effects=effects), 15 if seal else 5, at.scale)


def _like_a_seal(coordinate: Coordinate, at: Point) -> Coordinate:
    if coordinate.name.startswith("stribeck_speed"):
        return replace(
            coordinate, start=min(coordinate.start, 0.25 * SEAL_SPEED_M_S), high=SEAL_SPEED_M_S
        )
    if coordinate.name.startswith("stribeck"):
        most = SEAL_RISE * max(at.friction.coulomb_plus_n, at.friction.coulomb_minus_n)
        return replace(coordinate, start=min(coordinate.start, most))
    return coordinate


def generic_names(problem: Problem) -> tuple[str, ...]:
    """Generic terms that this rig's channels give; the constant among them is friction's own."""
    found = basis(problem.series[0].signals)
    return tuple(name for name in found if name != "bias")
