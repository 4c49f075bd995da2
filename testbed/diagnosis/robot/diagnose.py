"""`testbed diagnose RUN`: which effects the whole robot has and its model lacks, and where.

The measurements of a recording are compared with the believed machine in four kinds of balances
(groups.py). In a sound machine their residuals come from tolerances and noise; each effect at each
place adds a signature of its own. The evidence for every single effect, for pairs, and for an
effect without a name (hypotheses.py) is turned into probabilities (probabilities.py). A named
effect also has to predict the part of the recording that was kept back.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path

import numpy as np
import numpy.typing as npt

from testbed.diagnosis.robot.bins import BIN_S, SETTLING_S
from testbed.diagnosis.robot.groups import FORCES, GROUND, Balances
from testbed.diagnosis.robot.hypotheses import Hypothesis, Ledger
from testbed.diagnosis.robot.kept_back_part import kept_back, predicts
from testbed.diagnosis.robot.motion_kinds import motion_kinds
from testbed.diagnosis.robot.naming import failed_names, without
from testbed.diagnosis.robot.nonlinear_fit import weighed_by_law
from testbed.diagnosis.robot.parameters import Doubt, Found, found_in
from testbed.diagnosis.robot.probabilities import (
    NO_NAME,
    Names,
    RobotSigns,
    calibration,
    distribution,
    has_names,
    leading,
)
from testbed.diagnosis.robot.second_effects import foretold_alike, shown_by_both
from testbed.diagnosis.robot.walking_bias import hangs
from testbed.effects import ALL, place_of
from testbed.effects.signature import Signature
from testbed.errors import InputError

Array = npt.NDArray[np.float64]
SHORTEST_S = SETTLING_S + 40 * BIN_S
LONGEST_S = 150.0
"""Of what is weighed together: bins share their noise, whose covariance takes 7 GB for so long."""
NO_ROPES = (
    "no rope pulls; probabilities were fitted on machines that hang on theirs, and of nine sound"
    " ones that swayed on level ground without any four were given an effect"
)
SAME_PLACE = (
    "{} shows by how steep the ground seems beside the earlier recording alone; that both are of one"
    " place is known from the surveyed ropes alone, and a robot that was moved to other ground looks"
    " the same (--moved says that it was)"
)
MAY_BE_SOUND = "a sound machine is likelier than any one set of names: worth a look, not a repair"
PREDICTS_WORSE = "what was found predicts the kept-back forces worse than refitted tolerances do"
SIZE_UNKNOWN = "its force is known where this recording went, and may be of any size elsewhere"
PLACE_IN_DOUBT = (
    "it is not sure enough that something is wrong at its place (below 0.8): another motion decides"
    " (--suggest writes one, --also weighs both)"
)
LIKELY_PLACE = 0.8
"""Least probability of a place at which forces are corrected for what was found: a wrong correction
may do more harm than a right one does good, and a second motion decides. Chosen after a sensor's
zero, called a shifted centre of mass with 0.76, had made another motion worse by half. Beside a
recording of that motion it is *unnamed* with 1.00.
"""
AMBIGUOUS = 3.0
"""Rivals within this of a name, in calibrated log evidence, are reported as ambiguous with it."""


@dataclass(frozen=True)
class Verdict:
    """`kind`: effect, none or unnamed. `chosen`: the most probable set of effects. `hypotheses`:
    (names, probability), most probable first.
    """

    kind: str
    chosen: Hypothesis
    hypotheses: tuple[tuple[Names, float], ...]
    ambiguous: Mapping[str, tuple[str, ...]]

    def probability(self, name: str) -> float:
        """Probability that the effect is present: the sum over all sets that contain it."""
        return float(sum(p for names, p in self.hypotheses if name in names))

    def probability_at(self, place: str) -> float:
        """Probability that an effect is present at a place, whatever it is called."""
        places = [({place_of(name) for name in names}, p) for names, p in self.hypotheses]
        return float(sum(p for there, p in places if place in there))

    @property
    def probability_of_kind(self) -> float:
        """Probability of all sets of the verdict's kind together."""
        kinds = {(): "none", NO_NAME: "unnamed"}
        return sum(p for names, p in self.hypotheses if kinds.get(names, "effect") == self.kind)


@dataclass(frozen=True, eq=False)
class RobotDiagnosis:
    """The diagnosis of one run. `errors`: group -> stage (`before`, `refit`, `after`) -> RMS
    residual on the part that was kept back (N, m3/s, m or Pa).
    """

    name: str
    balances: Balances
    signs: RobotSigns
    verdict: Verdict
    found: tuple[Found, ...]
    errors: Mapping[str, Mapping[str, float]]
    left_out: Mapping[str, tuple[str, ...]]
    """Kind of effect -> places at which an effect of the usual size would not show here."""
    resembles: str = ""
    """The kind that an unnamed effect resembles most."""
    beyond: str = ""
    """In what the run is unlike all that the probabilities were fitted to, or what nobody measured
    that a finding rests on, in words.
    """
    not_recalled: Mapping[str, int] = field(default_factory=dict)
    """Group of balances -> how many of a machine's numbers its earlier recording shows beyond what
    any workshop leaves: so many are not taken from it.
    """
    added_n2: Array = field(default_factory=lambda: np.zeros(0))
    """By how much the effects add to the mean square error of the kept-back forces beside what the
    tolerances of a sound machine leave, second by second.
    """
    without_doubts: tuple[Found, ...] = ()
    """Of several effects of which some are in doubt, by their place or size: the others, with the
    numbers that they have by themselves, where these predict the kept-back forces.
    """

    @property
    def predicts_forces(self) -> bool:
        """Whether the effects predict the kept-back forces about as well as the tolerances of a
        sound machine do, or better; or hardly worse beside all that is missing without either; or
        not surely worse, by how much its seconds differ. If not, they are reported but not put into
        the model.
        """
        return predicts(self.errors[FORCES], self.added_n2)

    def place_is_likely(self, one: Found) -> bool:
        """Whether it is likely, by LIKELY_PLACE, that something is wrong at the place of what was
        found, whatever that may be called.
        """
        return self.verdict.probability_at(one.place) >= LIKELY_PLACE

    @property
    def not_believed(self) -> str:
        """Why what was found is not put into the model, or not all of it; empty where it is."""
        if not self.predicts_forces:
            return PREDICTS_WORSE
        if any(found.may_be_nothing for found in self.found):
            return SIZE_UNKNOWN
        return "" if all(map(self.place_is_likely, self.found)) else PLACE_IN_DOUBT

    @property
    def believed(self) -> tuple[Found, ...]:
        """What is put into the model: all that was found, or what is left without what is in
        doubt.
        """
        return self.without_doubts if self.not_believed else self.found


def check_duration(time_s: Array, file: Path) -> float:
    """A run's seconds, from its times (n,). Raises InputError where that is too short to learn
    from.
    """
    duration = float(time_s[-1] - time_s[0])
    if duration < SHORTEST_S:
        raise InputError(
            f"is too short to learn from: {duration:.3g} s",
            file=file,
            allowed=f"at least {SHORTEST_S:.3g} s",
        )
    return duration


def check_memory(runs: Iterable[tuple[float, Path]]) -> None:
    """Refuse runs (seconds, file) that are too long to be weighed together."""
    total = 0.0
    for duration, file in runs:
        total += duration
        if total > LONGEST_S:
            raise InputError(
                f"is too long to be weighed: {total:.4g} s in all",
                file=file,
                allowed=f"at most {LONGEST_S:g} s; memory grows with the square of that",
            )


def beyond_what_was_tried(balances: Balances) -> str:
    """In what a run, or one of several, is unlike those that the probabilities were fitted to, in
    words; empty where in nothing.
    """
    hanging = (hangs(body.seen, body.foot_force) for body in balances.bodies)
    return "" if all(hanging) else NO_ROPES


def judged(name: str, balances: Balances, granted: Iterable[str] = ()) -> RobotDiagnosis:
    """The diagnosis from the balances of one recording, or of several together; `granted`: names
    (effect@place) that are not searched for.
    """
    ledger = Ledger(balances, left_out=granted)
    searched = foretold_alike(ledger, ledger.best())
    tried = shown_by_both(ledger, weighed_by_law(ledger, searched))
    signs = RobotSigns.of(tried, motion_kinds(balances))
    weights = distribution(signs, calibration())
    verdict = _verdict(ledger, tried, weights, {})
    found = found_in(balances, verdict.chosen, Doubt.shipped())
    while verdict.kind == "effect":
        failed = failed_names(ledger, verdict.chosen, found)
        if not failed:
            break
        weights = without(weights, failed)
        verdict = _verdict(ledger, tried, weights, failed)
        found = found_in(balances, verdict.chosen, Doubt.shipped())
    unnamed = [h for h in tried if not has_names(h.names)]
    signatures = _scaled(balances, verdict.chosen)
    kept = {key: kept_back(group, signatures) for key, group in balances.raw.items()}
    said = RobotDiagnosis(
        name=name,
        balances=balances,
        signs=signs,
        verdict=verdict,
        found=found,
        errors={key: one.errors for key, one in kept.items()},
        left_out=_left_out(ledger),
        resembles=unnamed[0].names[0] if verdict.kind == "unnamed" and unnamed else "",
        beyond="; ".join(_doubts(ledger, verdict)),
        not_recalled=balances.not_recalled(),
        added_n2=kept[FORCES].added_each_second,
    )
    return replace(said, without_doubts=_without_doubts(said, ledger))


def _without_doubts(said: RobotDiagnosis, ledger: Ledger) -> tuple[Found, ...]:
    """See RobotDiagnosis."""
    sure = [f.name for f in said.found if said.place_is_likely(f) and not f.may_be_nothing]
    if len(sure) in (0, len(said.found)):
        return ()
    balances, chosen = said.balances, ledger.hypothesis(tuple(sure))
    kept = kept_back(balances.raw[FORCES], _scaled(balances, chosen))
    alone = replace(
        said,
        found=found_in(balances, chosen, Doubt.shipped()),
        errors={FORCES: kept.errors},
        added_n2=kept.added_each_second,
    )
    return () if alone.not_believed else alone.found


def _doubts(ledger: Ledger, verdict: Verdict) -> Iterator[str]:
    """Why a verdict is to be trusted less, in words."""
    unlike = beyond_what_was_tried(ledger.balances)
    if unlike:
        yield unlike
    if verdict.kind == "effect" and not verdict.hypotheses[0][0]:
        yield MAY_BE_SOUND
    yield from map(SAME_PLACE.format, shown_by_place(ledger, verdict.chosen.names))


def shown_by_place(ledger: Ledger, names: Names) -> tuple[str, ...]:
    """The effects of a set that only show because the ground is as steep as it was: without that
    balance their names would raise the evidence of the others by less than VISIBLE, and it is worth
    AMBIGUOUS or more.
    """
    balances = ledger.balances
    if GROUND not in balances.groups:
        return ()
    raw = {key: group for key, group in balances.raw.items() if key != GROUND}
    groups = {key: group for key, group in balances.groups.items() if key != GROUND}
    elsewhere = Ledger(replace(balances, raw=raw, groups=groups))

    def worth(name: str, of: Ledger) -> float:
        rest = tuple(other for other in names if other != name)
        return of.hypothesis(names).log_factor - of.hypothesis(rest).log_factor

    left = {name: worth(name, elsewhere) for name in names}
    return tuple(
        name
        for name, worth_elsewhere in left.items()
        if worth_elsewhere < VISIBLE and worth(name, ledger) - worth_elsewhere >= AMBIGUOUS
    )


VISIBLE = 6.0
"""Log Bayes factor from which an effect would be visible to someone who knows its name."""


def _left_out(ledger: Ledger) -> dict[str, tuple[str, ...]]:
    """Kind of named effect -> the places at which these balances would not show it."""
    out = {}
    for effect in ALL:
        if effect.is_tolerance:
            continue
        names = {place: f"{effect.kind}@{place}" for place in effect.places_on_robot}
        shown = {p for p, n in names.items() if n in ledger.names and ledger.expected(n) >= VISIBLE}
        if len(shown) < len(names):
            out[effect.kind] = tuple(place for place in names if place not in shown)
    return out


def _verdict(
    ledger: Ledger,
    tried: Sequence[Hypothesis],
    weights: Mapping[Names, float],
    failed: Mapping[str, str],
) -> Verdict:
    ranked = tuple(sorted(weights.items(), key=lambda item: -item[1]))
    top = leading(weights, float(calibration()["lapse"]))
    if top in ((), NO_NAME):
        return Verdict("unnamed" if top else "none", ledger.hypothesis(()), ranked, {})
    chosen = ledger.hypothesis(top)
    return Verdict("effect", chosen, ranked, _ambiguous(chosen, tried))


def _ambiguous(chosen: Hypothesis, tried: Sequence[Hypothesis]) -> dict[str, tuple[str, ...]]:
    """For each chosen name, the names that could replace it at nearly the same evidence
    (AMBIGUOUS).
    """
    limit = AMBIGUOUS / float(calibration()["share"])
    least = next(h.log_factor for h in tried if h.names == chosen.names) - limit
    out = {}
    for name in chosen.names:
        rest = set(chosen.names) - {name}
        rivals = [
            (h.log_factor + h.price, next(iter(set(h.names) - rest)))
            for h in tried
            if len(h.names) == len(chosen.names) and rest < set(h.names) and name not in h.names
        ]
        near = sorted((f, n) for f, n in rivals if f > least)
        out[name] = tuple(n for _, n in reversed(near))
    return out


def _scaled(balances: Balances, chosen: Hypothesis) -> list[Signature]:
    """Signatures of a set, scaled to a prior standard deviation of 1 for each number."""
    return [
        {n: change.times(s) for (n, change), s in zip(c.signature.items(), c.spreads, strict=True)}
        for c in (balances.candidates[name] for name in chosen.names)
    ]
