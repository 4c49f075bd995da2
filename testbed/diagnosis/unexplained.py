"""What the best set of names leaves unexplained: excess over the sensors' floor, and what generic terms find."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from testbed.diagnosis.evidence import Key, evidence
from testbed.diagnosis.floor import group_floors
from testbed.diagnosis.hypotheses import fit_with
from testbed.diagnosis.problem import Problem
from testbed.diagnosis.search import Candidate, Search
from testbed.effects import unnamed
from testbed.parameters.recording import Recording


@dataclass(frozen=True, eq=False)
class Unexplained:
    """`excess`: group -> residual scale over floor, for the refit and for the best set; `floors`: the floors.
    `encoder_m`: standard deviation of the encoder's rounding.

    `generic_gain`: held-out log-likelihood that the generic terms add to the best set; `generic_fall`: relative fall.
    """

    excess_refit: dict[Key, float]
    excess_best: dict[Key, float]
    generic_gain: float
    generic_fall: float
    generic: Candidate
    floors: dict[Key, float]
    encoder_m: float


def unexplained(state: Search, recordings: Sequence[Recording]) -> Unexplained:
    """Compare the best set with the floor and with the best set plus generic terms."""
    best = state.best or state.refit
    floors = group_floors(state.problem, recordings, best.fit.at.friction)
    fit = fit_with(state.problem, best.fit, unnamed.EFFECT, generic_names(state.problem), iterations=5)
    generic = Candidate((*best.names, "unnamed"), fit, evidence(state.problem, fit))
    return Unexplained(
        {k: state.refit.evidence.scale[k] / f for k, f in floors.items() if k in state.refit.evidence.scale},
        {k: best.evidence.scale[k] / f for k, f in floors.items() if k in best.evidence.scale},
        generic.evidence.gain_over(best.evidence, generic.evidence),
        generic.evidence.largest_fall(best.evidence),
        generic,
        floors,
        max(r.position_resolution_m for r in recordings) / 12.0**0.5,
    )


def generic_names(problem: Problem) -> tuple[str, ...]:
    """Generic terms that this rig's channels give; the constant among them is friction's own."""
    found = unnamed.basis(problem.series[0].signals)
    return tuple(name for name in found if name != "bias")
