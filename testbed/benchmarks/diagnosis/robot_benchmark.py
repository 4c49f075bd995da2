"""The blind test of the whole robot's diagnosis: how often leg and effect are named.

Thresholds were set on other seeds (see robot_calibration).
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from testbed.benchmarks.diagnosis.robot_trials import hidden_sizes, trial
from testbed.benchmarks.diagnosis.scores import Trial, calibration, confusion, quantiles, rate
from testbed.benchmarks.harness import Answers, Benchmark
from testbed.report.tables import Table


@dataclass(frozen=True)
class RobotBlindTest(Benchmark[int]):
    """`runs` runs of consecutive seeds."""

    name = "robot_trials"
    noun = "runs"
    runs: int = 60
    first_seed: int = 1

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
        """The marks, what became of each hidden effect, and how far stated probabilities can be trusted."""
        return [_marks(result), _by_effect(result), _calibration(result)]


def scores(trials: Sequence[Trial]) -> dict[str, Any]:
    """The contents of robot_trials.json."""
    hidden = [t for t in trials if t["truth"] and t["visible"]]
    return {
        "runs": len(trials),
        "seeds": [min(t["seed"] for t in trials), max(t["seed"] for t in trials)],
        "leg_and_effect_named": rate([t["names"] == t["truth"] for t in hidden]),
        "leg_named": rate(
            [{_place(n) for n in t["names"]} == {_place(n) for n in t["truth"]} for t in hidden]
        ),
        "among_first_two": rate(
            [t["truth"] in [h["names"] for h in t["hypotheses"][:2]] for t in hidden]
        ),
        "clean_none": rate([t["verdict"] == "none" for t in trials if not t["truth"]]),
        "intervals": rate([hit for t in hidden if t["names"] == t["truth"] for hit in _held(t)]),
        "error_after_over_refit": quantiles(
            [t["error"]["after"] / t["error"]["refit"] for t in hidden]
        ),
        "calibration": calibration(trials),
        "confusion": confusion(trials),
        "by_effect": {
            name: rate([t["names"] == t["truth"] for t in hidden if t["truth"][0].startswith(name)])
            for name in hidden_sizes()
            if name
        },
    }


def _place(name: str) -> str:
    return name.partition("@")[2]


def _held(t: Trial) -> list[bool]:
    """Of each parameter of the one effect that was named: whether its 90 % interval holds the truth."""
    given = t["effects"][0]["parameters"]
    pairs = [(given[k]["interval90"], v) for k, v in t["numbers"].items() if k in given]
    return [interval[0] <= v <= interval[1] for interval, v in pairs if interval]


def _marks(found: Mapping[str, Any]) -> Table:
    asked = {
        "leg and effect named, nothing else": found["leg_and_effect_named"],
        "leg named, no other leg": found["leg_named"],
        "right among the first two hypotheses": found["among_first_two"],
        "sound machine: nothing named": found["clean_none"],
        "90 % intervals of parameters hold the truth": found["intervals"],
    }
    rows = [
        [what, f"{r['share']:.1%}", str(r["of"]), f"{r['low95']:.1%} to {r['high95']:.1%}"]
        for what, r in asked.items()
        if r["of"]
    ]
    first, last = found["seeds"]
    title = f"Blind test on the robot: {found['runs']} runs, seeds {first} to {last}"
    return Table(title, ["what", "share", "of", "95 %"], rows)


def _by_effect(found: Mapping[str, Any]) -> Table:
    rows = [
        [name, f"{r['share']:.0%}", str(r["of"])]
        for name, r in found["by_effect"].items()
        if r["of"]
    ]
    return Table("By hidden effect", ["hidden effect", "named", "of"], rows)


def _calibration(found: Mapping[str, Any]) -> Table:
    heads = ["expected calibration error", "Brier score", "the same of base rates"]
    c = found["calibration"]
    row = [c["expected_calibration_error"], c["brier"], c["brier_of_base_rates"]]
    return Table("Stated probabilities", heads, [[f"{value:.3f}" for value in row]])
