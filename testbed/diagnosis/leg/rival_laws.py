"""Shapes that bend a name's law into one of another kind, which has no name on an axis: a gain
error that is gone at a pressure that the sensor still reads is a bow.
"""

from __future__ import annotations

from testbed.diagnosis.leg.entries import entries_of, memory_of
from testbed.diagnosis.leg.evidence import evidence
from testbed.diagnosis.leg.hypotheses import fit_shapes
from testbed.diagnosis.leg.prediction import block_covariance
from testbed.diagnosis.leg.search import Candidate, Search
from testbed.effects import by_name

BENT = 0.8
"""Share of a leg whose name explains with another law's shape that no name covers (E)."""


def other_laws(state: Search, chosen: Candidate) -> frozenset[str]:
    """The names of a set whose fitted shapes stand for a law that has no name on an axis."""
    observed = state.problem.observed(chosen.fit.at.friction)
    return frozenset(
        active.effect.name
        for active in chosen.fit.at.effects
        if active.effect.name in chosen.names
        and active.effect.another_law(active.values, observed) is not None
    )


def other_laws_within(state: Search, chosen: Candidate, name: str) -> tuple[str, ...]:
    """The laws of another kind that lie within the 90 % intervals of what bends a name's law: what
    these recordings cannot tell from it. They are fitted for this where it is named without.
    """
    effect, problem = by_name(name), state.problem
    if not effect.may_be_another_law:
        return ()
    fit = fit_shapes(problem, chosen.fit, effect)
    memory = memory_of(evidence(problem, fit))
    entries = entries_of(fit, memory, block_covariance(problem, fit))
    values = next(active.values for active in fit.at.effects if active.effect.name == name)
    observed = problem.observed(fit.at.friction)
    found = set()
    for entry in entries:
        for shape in effect.shapes if entry.name == name else ():
            within = entry.parameters.get(shape)
            for end in (within.interval90 or ()) if within else ():
                found.add(effect.another_law({**values, shape: end}, observed))
    return tuple(sorted(law for law in found if law is not None))
