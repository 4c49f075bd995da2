"""`testbed diagnose RUN`: which effects the whole robot has and its model lacks, and where.

The measurements of a recording are compared with the believed machine in four kinds of balances
(groups.py). In a sound machine their residuals come from tolerances and noise; each effect at each
place adds a signature of its own. The evidence for every single effect, for pairs, and for an
effect without a name (hypotheses.py) is turned into probabilities (probabilities.py). A named
effect also has to predict the part of the recording that was kept back.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path

import numpy as np
import numpy.typing as npt

from testbed.diagnosis.robot.bins import BIN_S, SETTLING_S
from testbed.diagnosis.robot.evidence import RawGroup
from testbed.diagnosis.robot.groups import FORCES, GROUND, Balances
from testbed.diagnosis.robot.hypotheses import Hypothesis, Ledger
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
LEARNT_SHARE = 0.65
"""Share of a run that is learnt from; the rest is kept back and predicted."""
SHORTEST_S = SETTLING_S + 40 * BIN_S
LONGEST_S = 150.0
"""Of what is weighed together: bins share their noise, whose covariance takes 7 GB for so long."""
ALIKE = 1.02
"""Two errors on the kept-back forces whose ratio is below this count as equal, as for single legs
(E).
"""
HARDLY_WORSE = 0.05
"""What effects add to the error of the kept-back forces (root of the difference of squares) is
little below this share of what the machine as believed misses there (E).
"""
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
    "that something is wrong at its place is not sure enough for forces to be corrected (below 0.8);"
    " another motion decides (--suggest writes one, --also weighs both)"
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

    @property
    def predicts_forces(self) -> bool:
        """Whether the effects predict the kept-back forces about as well as the tolerances of a
        sound machine do, or better; or hardly worse beside all that is missing without either; or
        not surely worse, by how much its seconds differ. If not, they are reported but not put into
        the model.
        """
        force = self.errors[FORCES]
        added = force["after"] ** 2 - force["refit"] ** 2
        little = added <= (HARDLY_WORSE * force["before"]) ** 2
        alike = force["after"] <= force["refit"] * ALIKE
        return little or alike or not surely_more(self.added_n2)

    @property
    def places_are_likely(self) -> bool:
        """Whether for each effect it is likely, by LIKELY_PLACE, that something is wrong at its
        place, whatever that may be called. If not, they are reported but not put into the model.
        """
        places = {found.place for found in self.found}
        return all(self.verdict.probability_at(place) >= LIKELY_PLACE for place in places)

    @property
    def not_believed(self) -> str:
        """Why what was found is not put into the model, in words; empty where it is."""
        if not self.predicts_forces:
            return PREDICTS_WORSE
        if any(found.may_be_nothing for found in self.found):
            return SIZE_UNKNOWN
        return "" if self.places_are_likely else PLACE_IN_DOUBT


def surely_more(added: Array) -> bool:
    """Whether numbers (k,) of which each comes from a second of its own are more than nothing in
    the mean, with 95 %; of too few nobody knows, and they count.
    """
    if len(added) < FEWEST_S:
        return True
    return float(np.mean(added)) > SURE * float(np.std(added, ddof=1)) / math.sqrt(len(added))


FEWEST_S, SURE = 4, 1.645
"""Fewest seconds that tell a spread, and how many of its deviations are sure with 95 % (E)."""


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
    return RobotDiagnosis(
        name=name,
        balances=balances,
        signs=signs,
        verdict=verdict,
        found=found,
        errors={key: _errors(balances, verdict.chosen, key) for key in balances.raw},
        left_out=_left_out(ledger),
        resembles=unnamed[0].names[0] if verdict.kind == "unnamed" and unnamed else "",
        beyond="; ".join(_doubts(ledger, verdict)),
        not_recalled=balances.not_recalled(),
        added_n2=_added_each_second(balances, verdict.chosen),
    )


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


def _errors(balances: Balances, chosen: Hypothesis, key: str) -> dict[str, float]:
    """RMS residual of a group on the part that was kept back: as believed, with the tolerances
    refitted, and with the effects as well.
    """
    group = balances.raw[key]
    kept = group.time_s >= _until(group)
    refit, after = group.unpredicted(_until(group), _scaled(balances, chosen.names))
    before = group.size(group.missing[kept], kept)
    return {"before": before, "refit": refit, "after": after}


def _added_each_second(balances: Balances, chosen: Hypothesis) -> Array:
    """See RobotDiagnosis.added_n2."""
    group = balances.raw[FORCES]
    until = _until(group)
    alone, beside = group.left_unpredicted(until, _scaled(balances, chosen.names))
    time = group.time_s[group.time_s >= until]
    second = np.unique((time - time.min()) // 1.0, return_inverse=True)[1]
    return np.bincount(second, beside**2 - alone**2) / np.bincount(second)


def _scaled(balances: Balances, names: Sequence[str]) -> list[Signature]:
    """Signatures of a set, scaled to a prior standard deviation of 1 for each number."""
    return [
        {n: change.times(s) for (n, change), s in zip(c.signature.items(), c.spreads, strict=True)}
        for c in (balances.candidates[name] for name in names)
    ]


def _until(group: RawGroup) -> float:
    """Start of the part that is kept back, s."""
    first, last = float(group.time_s.min()), float(group.time_s.max())
    return first + LEARNT_SHARE * (last - first)
