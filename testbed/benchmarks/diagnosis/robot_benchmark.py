"""The blind test of the whole robot's diagnosis: how often effect and place are named, and what
believing them closes.

Its numbers were fitted on other seeds (see robot_calibration).
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from testbed.benchmarks.diagnosis.robot_draws import hidden_sizes
from testbed.benchmarks.diagnosis.robot_trials import trial
from testbed.benchmarks.diagnosis.scores import Trial, calibration, confusion, quantiles, rate
from testbed.benchmarks.harness import Answers, Benchmark
from testbed.report.tables import Table

WORSE = 1.05


@dataclass(frozen=True)
class RobotBlindTest(Benchmark[int]):
    """`runs` runs of consecutive seeds."""

    name = "robot_trials"
    noun = "runs"
    runs: int = 60
    first_seed: int = 2000

    def cases(self) -> Mapping[str, int]:
        """The seeds."""
        return {str(seed): seed for seed in range(self.first_seed, self.first_seed + self.runs)}

    def work(self, case: int) -> Trial:
        """See robot_trials.trial."""
        return trial(case)

    def without(self) -> tuple[str, ...]:
        """How answers are scored, and the other benchmarks of this folder."""
        names = ("scores.py", "*calibration.py", "trials.py", "benchmark.py", "measured_rigs.py")
        return tuple(f"benchmarks/diagnosis/{name}" for name in names)

    def summarise(self, answers: Answers) -> dict[str, Any]:
        """See scores."""
        return scores(list(answers.values()))

    def tables(self, result: dict[str, Any]) -> Sequence[Table]:
        """The marks, what became of each hidden effect, and how far stated probabilities can be
        trusted.
        """
        return [_marks(result), _closed(result), _by_effect(result), _calibration(result)]


def scores(trials: Sequence[Trial]) -> dict[str, Any]:
    """The contents of robot_trials.json."""
    named = [t for t in trials if t["kind"] in ("single", "double")]
    seen = [t for t in named if t["visible"]]
    outside = [t for t in trials if t["kind"] == "outside"]
    shares = [share for t in seen if (share := closed_share(t)) is not None]
    ratios = [t["closed"]["after"] / t["closed"]["before"] for t in trials if t["closed"]]
    return {
        "runs": len(trials),
        "seeds": [min(t["seed"] for t in trials), max(t["seed"] for t in trials)],
        "hidden": len(named),
        "visible": len(seen),
        "place_named": rate([_places(t["names"]) == _places(t["truth"]) for t in seen]),
        "place_among_named": rate([bool(_places(t["names"]) & _places(t["truth"])) for t in seen]),
        "name_and_place": rate([set(t["names"]) == set(t["truth"]) for t in seen]),
        "name_or_ambiguous": rate([_covered(t) for t in seen]),
        "named_of_all_hidden": rate([set(t["names"]) == set(t["truth"]) for t in named]),
        "two_both_named": rate(
            [set(t["names"]) == set(t["truth"]) for t in seen if t["kind"] == "double"]
        ),
        "clean_none": rate([t["verdict"] == "none" for t in trials if t["kind"] == "clean"]),
        "outside_unnamed": rate([t["verdict"] == "unnamed" for t in outside if t["visible"]]),
        "outside_not_named": rate([t["verdict"] != "effect" for t in outside]),
        "intervals": rate([hit for t in seen for hit in held(t)]),
        "closed_share": quantiles(shares),
        "made_worse": rate([ratio > WORSE for ratio in ratios]),
        "seconds": quantiles([t["seconds"] for t in trials]),
        "calibration": calibration(trials),
        "confusion": confusion(trials),
        "by_effect": {
            name: rate([name in _kinds(t["names"]) for t in seen if name in _kinds(t["truth"])])
            for name in hidden_sizes()["named"]
        },
    }


def closed_share(t: Trial) -> float | None:
    """Share of the foot-force error that the hidden effects add on another motion which is closed;
    None where nothing was named, or the effects add less than a tenth.
    """
    if not t["closed"]:
        return None
    before, after, sound = (t["closed"][k] ** 2 for k in ("before", "after", "sound"))
    return (before - after) / (before - sound) if before > ADDS**2 * sound else None


ADDS = 1.1


def held(t: Trial) -> Iterator[bool]:
    """Of each parameter of an effect that was named rightly: whether its 90 % interval holds the
    truth.
    """
    hidden = {f"{h['effect']}@{h['at']}": h["parameters"] for h in t["hidden"]}
    for effect in t["effects"]:
        truth = hidden.get(f"{effect['name']}@{effect['place']}", {})
        for key, value in truth.items():
            low, high = effect["parameters"][key]["interval90"]
            yield low <= value <= high


def _covered(t: Trial) -> bool:
    """Whether each hidden name was said, or said to be not told apart from one that was said."""
    told = [{f"{e['name']}@{e['place']}", *e["ambiguous_with"]} for e in t["effects"]]
    return all(any(name in names for names in told) for name in t["truth"])


def _places(names: Sequence[str]) -> set[str]:
    return {name.partition("@")[2] for name in names}


def _kinds(names: Sequence[str]) -> set[str]:
    return {name.partition("@")[0] for name in names}


def _marks(found: Mapping[str, Any]) -> Table:
    asked = {
        "visible effects: all places right, no other": found["place_named"],
        "visible effects: a right place among those named": found["place_among_named"],
        "visible effects: names and places right, nothing else": found["name_and_place"],
        "visible effects: named, or said to be like what was named": found["name_or_ambiguous"],
        "all hidden effects, visible or not: names and places right": found["named_of_all_hidden"],
        "two effects, both visible: both named": found["two_both_named"],
        "sound machine: nothing named": found["clean_none"],
        "no name covers it, visible: called unnamed": found["outside_unnamed"],
        "no name covers it: given no name": found["outside_not_named"],
        "90 % intervals of parameters hold the truth": found["intervals"],
        "another motion is estimated worse by more than 5 %": found["made_worse"],
    }
    rows = [
        [what, f"{r['share']:.1%}", str(r["of"]), f"{r['low95']:.1%} to {r['high95']:.1%}"]
        for what, r in asked.items()
        if r["of"]
    ]
    first, last = found["seeds"]
    title = f"Blind test on the robot: {found['runs']} runs, seeds {first} to {last}"
    return Table(title, ["what", "share", "of", "95 %"], rows)


def _closed(found: Mapping[str, Any]) -> Table:
    shares = found["closed_share"]
    row = [f"{shares[k]:.2f}" if shares else "" for k in ("p10", "p50", "p90")]
    title = "Share of the foot-force error that is closed on another motion"
    return Table(title, ["10th percentile", "median", "90th percentile"], [row])


def _by_effect(found: Mapping[str, Any]) -> Table:
    rows = [
        [name, f"{r['share']:.0%}", str(r["of"])]
        for name, r in found["by_effect"].items()
        if r["of"]
    ]
    return Table("By hidden effect, where visible", ["hidden effect", "named", "of"], rows)


def _calibration(found: Mapping[str, Any]) -> Table:
    heads = ["expected calibration error", "Brier score", "the same of base rates"]
    c = found["calibration"]
    row = [c["expected_calibration_error"], c["brier"], c["brier_of_base_rates"]]
    return Table("Stated probabilities", heads, [[f"{value:.3f}" for value in row]])
