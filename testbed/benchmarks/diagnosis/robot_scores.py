"""What the blind test of the robot's diagnosis says: each run is held against what it could show.

Of what is hidden in a run some effects are visible and some are not (robot_trials). A diagnosis is
right that names all visible ones and none that is not hidden; one that is not visible may be named
or not.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from typing import Any

import numpy as np

from testbed.benchmarks.diagnosis.robot_draws import hidden_sizes
from testbed.benchmarks.diagnosis.scores import BINS, Trial, confusion, quantiles, rate
from testbed.benchmarks.diagnosis.scores import calibration as calibration_of

WORSE, ADDS, SURE = 1.05, 1.1, 0.8


def scores(trials: Sequence[Trial]) -> dict[str, Any]:
    """The contents of robot_trials.json."""
    named = [t for t in trials if t["kind"] in ("single", "double")]
    seen = [t for t in named if t["visible"]]
    unseen = [t for t in named if not t["visible"]]
    outside = [t for t in trials if t["kind"] == "outside"]
    both = [t for t in seen if t["kind"] == "double" and len(t["visible"]) == 2]
    sure = [t for t in trials if t["names"] and _stated(t) >= SURE]
    shares = [share for t in seen if (share := closed_share(t)) is not None]
    closable = [share for t in seen if (share := closed_share(t, "told")) is not None]
    closed = [t["closed"] for t in trials if t["closed"]]
    return {
        "runs": len(trials),
        "seeds": [min(t["seed"] for t in trials), max(t["seed"] for t in trials)],
        "hidden": len(named),
        "visible": len(seen),
        "place_named": rate([_fits(t, _places) for t in seen]),
        "place_among_named": rate([bool(_places(t["names"]) & _places(t["truth"])) for t in seen]),
        "name_and_place": rate([_fits(t, set) for t in seen]),
        "name_or_ambiguous": rate([_covered(t) for t in seen]),
        "named_of_all_hidden": rate([set(t["names"]) == set(t["truth"]) for t in named]),
        "two_both_named": rate([set(t["names"]) == set(t["truth"]) for t in both]),
        "unseen_not_misnamed": rate([set(t["names"]) <= set(t["truth"]) for t in unseen]),
        "sure_and_right": rate([frozenset(t["names"]) == target(t) for t in sure]),
        "clean_none": rate([t["verdict"] == "none" for t in trials if t["kind"] == "clean"]),
        "outside_unnamed": rate([t["verdict"] == "unnamed" for t in outside if t["visible"]]),
        "outside_not_named": rate([t["verdict"] != "effect" for t in outside]),
        "intervals": rate([distance <= 1.0 for t in seen for distance in distances(t)]),
        "second": second_motion([t for t in trials if t["second"]]),
        "closed_share": quantiles(shares) | {"of": len(shares)},
        "closed_of_closable": quantiles(closable) | {"of": len(closable)},
        "made_worse": rate([c["after"] > WORSE * c["before"] for c in closed]),
        "made_worse_by_the_truth": rate([c["told"] > WORSE * c["before"] for c in closed]),
        "made_worse_than_by_the_truth": rate([_harms(c) for c in closed]),
        "seconds": quantiles([t["seconds"] for t in trials]),
        "calibration": calibration(trials),
        "confusion": confusion([_asked(t) for t in trials]),
        "by_effect": {
            name: rate([name in _kinds(t["names"]) for t in seen if name in _kinds(t["visible"])])
            for name in hidden_sizes()["named"]
        },
    }


def _stated(t: Trial) -> float:
    """Probability of the set of names that was said."""
    said = {*t["names"]}
    return sum(float(h["probability"]) for h in t["hypotheses"] if {*h["names"]} == said)


def _harms(closed: Mapping[str, float]) -> bool:
    """Whether another motion is estimated worse both than as believed and than with what is really
    hidden believed to the number: by more than WORSE. What the truth makes worse no diagnosis can
    help.
    """
    return closed["after"] > WORSE * max(closed["before"], closed["told"])


def alone_of(trial: Trial) -> Trial:
    """The trial of the same run without a recording from before; nothing is done with what was
    found there.
    """
    return {**trial["alone"], "second": {}, "closed": {}, "seconds": trial["seconds"]}


def second_motion(close: Sequence[Trial]) -> dict[str, Any]:
    """Of runs whose two likeliest sets could not be distinguished: how often what is hidden was
    said without a second motion, with it, and with a third one where two still could not tell.
    """
    shown = [t for t in close if t["kind"] == "clean" or len(t["second"]["visible"])]
    motions = [t["second"]["motion"] for t in close]
    return {
        "cases": len(close),
        "without": rate([_said(t, t) for t in close]),
        "with": rate([_said(t, t["second"]) for t in close]),
        "with_third": rate([_said(t, t["second"].get("third", t["second"])) for t in close]),
        "third": sum("third" in t["second"] for t in close),
        "visible_without": rate([_said(t, t) for t in shown]),
        "visible_with": rate([_said(t, t["second"]) for t in shown]),
        "motions": {motion: motions.count(motion) for motion in sorted(set(motions))},
    }


def _said(t: Trial, answer: Mapping[str, Any]) -> bool:
    """Whether an answer is all that is hidden and nothing else."""
    if t["kind"] == "outside":
        return bool(answer["verdict"] == "unnamed")
    return set(answer["names"]) == set(t["truth"]) and answer["verdict"] != "unnamed"


def target(t: Trial) -> frozenset[str]:
    """The set that a perfect diagnosis of this run would call most probable; where what was said is
    right beyond what is visible, what was said.
    """
    if t["kind"] == "outside":
        return frozenset(["unnamed"]) if t["visible"] else frozenset()
    said = set(t["names"])
    right = set(t["visible"]) <= said <= set(t["truth"])
    return frozenset(said if right else t["visible"])


def calibration(trials: Sequence[Trial]) -> dict[str, Any]:
    """See scores.calibration; `error_of_a_perfect_one`: what so few runs would show in the mean
    were each as often right as it is stated.
    """
    stated = np.array([t["hypotheses"][0]["probability"] for t in trials])
    index = np.minimum((stated * BINS).astype(int), BINS - 1)
    right = np.random.default_rng(0).random((DRAWS, len(stated))) < stated
    off = np.abs((right - stated) @ np.eye(BINS)[index]).sum(axis=1) / len(stated)
    found = calibration_of([_asked(t) for t in trials])
    return {**found, "error_of_a_perfect_one": float(off.mean())}


DRAWS = 2000
"""Of what was right, by its stated probability."""


def _asked(t: Trial) -> Trial:
    """The trial as the scores of single axes read it."""
    truth = target(t)
    return {**t, "truth": sorted(truth), "visible": bool(truth)}


def closed_share(t: Trial, best: str = "sound") -> float | None:
    """Share of the foot-force error on another motion which is closed: of what the hidden effects
    add (`best`: sound), or of what believing them to the number would close (`told`): an effect on
    the oil moves the robot otherwise, and no belief makes up for it. None where nothing was named,
    or there is less than a tenth to close.
    """
    if best not in t["closed"]:
        return None
    before, after, least = (t["closed"][k] ** 2 for k in ("before", "after", best))
    return (before - after) / (before - least) if before > ADDS**2 * least else None


def told_numbers(t: Trial) -> Iterator[tuple[str, float, dict[str, Any]]]:
    """Of each parameter of an effect that was named rightly: `effect.parameter`, the truth, and
    what was said of it.
    """
    hidden = {f"{h['effect']}@{h['at']}": h["parameters"] for h in t["hidden"]}
    for effect in t["effects"]:
        truths = hidden.get(f"{effect['name']}@{effect['place']}", {})
        for key, truth in truths.items():
            yield f"{effect['name']}.{key}", truth, effect["parameters"][key]


def distances(t: Trial) -> Iterator[float]:
    """Of each parameter of an effect that was named rightly: how far the truth lies from the value,
    by the end of the 90 % interval on that side; up to 1 it is inside.
    """
    for _, truth, said in told_numbers(t):
        end = said["interval90"][int(truth > said["value"])]
        reach = abs(end - said["value"])
        yield abs(truth - said["value"]) / reach if reach > 0.0 else BEYOND


BEYOND = 10.0
"""How far off a truth counts that an interval of no width misses."""


def _fits(t: Trial, of: Any) -> bool:
    """Whether all that is visible was named, and nothing that is not hidden; `of`: names, or their
    places.
    """
    return bool(of(t["visible"]) <= of(t["names"]) <= of(t["truth"]))


def _covered(t: Trial) -> bool:
    """Whether each visible name was reported, or as indistinguishable from a reported one."""
    told = [{f"{e['name']}@{e['place']}", *e["ambiguous_with"]} for e in t["effects"]]
    return all(any(name in names for names in told) for name in t["visible"])


def _places(names: Sequence[str]) -> set[str]:
    return {name.partition("@")[2] for name in names}


def _kinds(names: Sequence[str]) -> set[str]:
    return {name.partition("@")[0] for name in names}
