"""From signs to a distribution over sets of names, for legs whose sensors and valve are declared.

Eight questions L, each a logistic regression on a few signs, and rivalry among sets of the same
size:

    P(no name covers it) = 1 - (1 - L(left)) (1 - L(generic)) (1 - L(flow terms))
                                    (1 - L(edges)) (1 - L(late)) (1 - L(fading))
    P(an effect | a name would cover it) = the largest L(presence) of a single one
    P(a second one | an effect) = L(second)
    P(this set | its size) ~ (1 + (behind the leader) / (slack + share * leader's gain)) ^ -power,
    of a single effect times its L(presence)

A question may be answered wrongly however clear its signs are: instead of L, the probability is
missed + (1 - missed - ghost) L, with the rates at which a sure "no" and a sure "yes" turn out to be
wrong.

The last falls as a power, not exponentially: the noise's model is not exact, and a leader far ahead
may still be the wrong name for a law of another form. The numbers are in `calibration.yaml`, with
the rigs they were fitted on; `testbed lab fit-diagnosis` fits them.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, fields, replace
from functools import cache
from pathlib import Path

import numpy as np

from testbed.diagnosis.leg.fading_friction import fading_signs
from testbed.diagnosis.leg.signs import SetSigns, Signs

FILE = Path(__file__).with_name("calibration.yaml")
Names = tuple[str, ...]


@dataclass(frozen=True)
class Calibration:
    """Question -> sign -> weight; `rivals`: slack, share, power for single effects, power for
    larger sets; `lapses`: rates at which a sure "no" (`..._missed`) and a sure "yes" (`..._ghost`)
    are wrong, for LAPSING.
    """

    left: Mapping[str, float]
    generic: Mapping[str, float]
    flow_terms: Mapping[str, float]
    presence: Mapping[str, float]
    second: Mapping[str, float]
    rivals: Mapping[str, float]
    lapses: Mapping[str, float] = field(default_factory=dict)
    edges: Mapping[str, float] = field(default_factory=lambda: {"one": -30.0})
    late: Mapping[str, float] = field(default_factory=lambda: {"one": -30.0})
    fading: Mapping[str, float] = field(default_factory=lambda: {"one": -30.0})

    def lapsed(self, question: str, answer: float) -> float:
        """The probability of a yes, as far from certain as this question's answers have been."""
        missed, ghost = (self.lapses.get(f"{question}_{kind}", 0.0) for kind in ("missed", "ghost"))
        return missed + (1.0 - missed - ghost) * answer


LAPSING = ("unnamed", "presence", "second")
"""Is there what no name covers? Is there an effect? Is there a second one?"""


@cache
def calibration() -> Calibration:
    """The numbers that this version ships."""
    import yaml

    row = yaml.safe_load(FILE.read_text())
    return Calibration(
        **{field.name: row[field.name] for field in fields(Calibration) if field.name in row}
    )


def _log(value: float, least: float) -> float:
    return float(np.log(max(value, least)))


def _size(value: float) -> float:
    """A logarithm for numbers of either sign, straight near 0."""
    return float(np.arcsinh(value / 5.0))


def presence_signs(single: SetSigns) -> dict[str, float]:
    """What tells whether a single effect is one at all."""
    return {
        "one": 1.0,
        "gain": _log(single.gain, 0.5),
        "fall": _log(single.fall, 1e-3),
        "carried": _size(single.carried),
    }


def second_signs(signs: Signs) -> dict[str, float]:
    """What tells whether there is a second effect beside the first.

    What a strong first effect's own formula leaves over looks like a small second one: hence the
    first one's gain, and what is left even with the second, and whether others in its place would
    gain almost as much.
    """
    first, second = signs.first or signs.refit, signs.second or signs.refit
    return {
        "one": 1.0,
        "more": _log(second.more, 0.5),
        "fall": _log(second.fall, 1e-3),
        "carried": _size(second.carried),
        "first": _log(first.gain, 0.5),
        "left": _log(max(second.force, second.flow, second.pressed), 1.0),
        "worst": _log(1.0 + min(second.worst, 2.0), 1.0),
        "alone": _alone(signs),
    }


def _alone(signs: Signs) -> float:
    """Share of the second effect's gain that the next best in its place does not reach, 0 to 1."""
    first = signs.first or signs.refit
    more = sorted(
        (gain - first.gain for names, gain in signs.gains if len(names) > 1), reverse=True
    )
    if not more or more[0] <= 0.0:
        return 0.0
    return 1.0 - max(more[1] if len(more) > 1 else 0.0, 0.0) / more[0]


FORCE_LEFT, FLOW_LEFT, PRESSED_LEFT = (2.5, 0.05), (1.75, 0.03), (7.0, 0.05)
"""Noise over the sensors' floor that a sound leg may leave, as its friction and its valve are never
quite the formulas; and the share of what there was that a named effect of another form may leave on
top. On the load cell a sound leg leaves up to seven times the floor, of force and flow alike: it
lands, and sticks and slips within one count of the encoder, faster than any channel is smoothed
(E)."""


def quiet(best: SetSigns) -> float:
    """How far below what a sound leg may leave in the air that is which a set leaves there, 0 to 1:
    at 1 there is nothing but the floor, and what generic terms gain is of no size. Landings say
    nothing.
    """
    pairs = ((best.force, FORCE_LEFT), (best.flow, FLOW_LEFT))
    most = max((left - 1.0) / (sound[0] - 1.0) for left, sound in pairs)
    return float(np.clip(1.0 - most, 0.0, 1.0))


def left_signs(signs: Signs) -> dict[str, float]:
    """What tells that no name covers what is there: more is left than the form of a law explains.

    A name that gained much is forgiven more. What is left on the load cell is judged by a floor of
    its own, PRESSED_LEFT.
    """
    best = signs.best
    pressed = PRESSED_LEFT[0] + PRESSED_LEFT[1] * signs.refit.pressed
    return {
        "one": 1.0,
        "quiet": quiet(best),
        "pressed": _log(best.pressed / pressed, 1.0),
        "force": _log(best.force / (FORCE_LEFT[0] + FORCE_LEFT[1] * signs.refit.force), 1.0),
        "flow": _log(best.flow / (FLOW_LEFT[0] + FLOW_LEFT[1] * signs.refit.flow), 1.0),
        "gain": _log(best.gain, 6.0),
    }


def generic_signs(signs: Signs) -> dict[str, float]:
    """Features of generic terms of the force balance: they gain, and not little beside what
    names gained; or they alone gain more than the names do.
    """
    generic = max(signs.generic_gain, 0.5)
    share = generic / (generic + max(signs.best.gain, 0.5))
    ahead = signs.alone_gain - signs.best.gain  # which is 0 of no name
    return {
        "one": 1.0,
        "quiet": quiet(signs.best),
        "gain": _log(generic, 0.5),
        "share": _log(share, 1e-3),
        "fall": _log(signs.generic_fall, 1e-3),
        "alone": _log(ahead / AHEAD, 1.0),
    }


AHEAD, FLOW_GAIN, FLOW_FALL = 5.0, 1000.0, 0.3
"""Log-likelihood that generic terms may lead names by for nothing; and what linear terms gain, and
how far they lower the noise, in the flow balances of a sound leg, whose edges and spool are never
quite the formulas."""


def flow_terms_signs(signs: Signs) -> dict[str, float]:
    """Features of linear terms of the flow balances, again beside what names gained."""
    gain = max(signs.flow_gain, 1.0)
    share = gain / (gain + max(signs.best.gain, 0.5))
    return {
        "one": 1.0,
        "gain": _log(gain / FLOW_GAIN, 0.1),
        "fall": _log(signs.flow_fall / FLOW_FALL, 0.1),
        "share": _log(share, 1e-3),
    }


def edges_signs(signs: Signs) -> dict[str, float]:
    """Features of metering edges that are more unlike each other than a workshop leaves them.

    Its weights are reckoned, not fitted: ln 0.03, the odds of what is without a name and meters
    (E), and of three ratios of four edges their logarithmic probability if they differ by 15 % (E)
    less that if they differ by a workshop's 4 % (base_models.UNEQUAL).
    """
    return {"one": 1.0, "uneven": signs.best.uneven}


def late_signs(signs: Signs) -> dict[str, float]:
    """Features of commands that act later or earlier than any recorder writes them.

    Its weights are reckoned, not fitted: ln 0.03, the odds of what is without a name and meters
    (E), and of the samples the logarithmic probability if they scatter by 5 (E: a dead time) less
    that if they scatter by a recorder's 0.75 (base_models.USUAL_LATE).
    """
    return {"one": 1.0, "square": signs.best.late**2}


def answer(signs: Mapping[str, float], weights: Mapping[str, float]) -> float:
    """A logistic regression's probability of a yes; signs without a weight do not count."""
    total = sum(weights[name] * sign for name, sign in signs.items() if name in weights)
    return float(1.0 / (1.0 + np.exp(-np.clip(total, -30.0, 30.0))))


def distribution(signs: Signs, calibration: Calibration) -> dict[Names, float]:
    """Set of names -> probability, adding up to 1; the empty set is `none`, ("unnamed",) what no
    name covers.
    """
    covered = (1.0 - answer(left_signs(signs), calibration.left)) * (
        1.0 - answer(generic_signs(signs), calibration.generic)
    )
    covered *= 1.0 - answer(flow_terms_signs(signs), calibration.flow_terms)
    covered *= 1.0 - answer(edges_signs(signs), calibration.edges)
    covered *= 1.0 - answer(late_signs(signs), calibration.late)
    covered *= 1.0 - answer(fading_signs(signs.best.fading), calibration.fading)
    missing = calibration.lapsed("unnamed", 1.0 - covered)
    present = {
        single.names: calibration.lapsed(
            "presence", answer(presence_signs(single), calibration.presence)
        )
        for single in signs.singles
    }
    singles = [(n, gain) for n, gain in signs.gains if len(n) == 1]
    larger = [(n, gain) for n, gain in signs.gains if len(n) > 1]
    some = max(present.values(), default=0.0)
    two = (
        calibration.lapsed("second", answer(second_signs(signs), calibration.second))
        if larger
        else 0.0
    )
    out: dict[Names, float] = {("unnamed",): missing, (): (1.0 - missing) * (1.0 - some)}
    rivals = calibration.rivals
    of_one = weighed(rivalry(singles, rivals["slack"], rivals["share"], rivals["power_1"]), present)
    of_more = rivalry(larger, rivals["slack"], rivals["share"], rivals["power_2"])
    for shares, whole in ((of_one, some * (1.0 - two)), (of_more, some * two)):
        for names, share in shares:
            out[names] = out.get(names, 0.0) + (1.0 - missing) * whole * share
    return out


def beyond_none(signs: Signs, calibration: Calibration) -> float:
    """Probability that something is there, if no name is: by what is left without any, and what
    generic terms add to that. `distribution` asks the same of the best set, which may leave little
    where no name leaves much.
    """
    bare = replace(signs, singles=(), second=None, generic_gain=signs.alone_gain)
    sound = (1.0 - answer(left_signs(bare), calibration.left)) * (
        1.0 - answer(generic_signs(bare), calibration.generic)
    )
    sound *= 1.0 - answer(fading_signs(signs.refit.fading), calibration.fading)
    return calibration.lapsed("unnamed", 1.0 - sound)


def standing(weights: Mapping[Names, float], beyond: float) -> dict[Names, float]:
    """The weights with at least the share `beyond` of what sets without names have for what no name
    covers: that nothing is missing has to stand on what it leaves, as every other answer has.
    """
    unnamed = weights.get(("unnamed",), 0.0)
    nameless = weights.get((), 0.0) + unnamed
    unnamed = max(unnamed, beyond * nameless)
    return dict(weights) | {(): nameless - unnamed, ("unnamed",): unnamed}


def weighed(
    shares: Sequence[tuple[Names, float]], weights: Mapping[Names, float]
) -> list[tuple[Names, float]]:
    """The shares times the weights of their names, adding up to 1 again: a name that is no effect
    by itself is no rival of one that is, however much it gains.
    """
    found = [(names, share * weights[names]) for names, share in shares]
    total = sum(share for _, share in found)
    return [(names, share / total) for names, share in found]


def rivalry(
    group: Sequence[tuple[Names, float]], slack: float, share: float, power: float
) -> list[tuple[Names, float]]:
    """Shares of the sets of one size, adding up to 1: (names, gain) -> (names, share)."""
    if not group:
        return []
    gains = np.array([gain for _, gain in group])
    behind = (gains.max() - gains) / (slack + share * max(float(gains.max()), 0.0))
    belief = (1.0 + behind) ** -power
    return [
        (names, float(belief_))
        for (names, _), belief_ in zip(group, belief / belief.sum(), strict=True)
    ]
