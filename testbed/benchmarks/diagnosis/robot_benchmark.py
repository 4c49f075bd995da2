"""The blind test of the whole robot's diagnosis: how often effect and place are named, and what
believing them closes.

Its numbers were fitted on other seeds (see robot_calibration).
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from testbed.benchmarks.diagnosis.robot_scores import alone_of, scores
from testbed.benchmarks.diagnosis.robot_trials import ALL_ASKED, Asked, trial
from testbed.benchmarks.diagnosis.scores import Trial
from testbed.benchmarks.harness import Answers, Benchmark
from testbed.errors import InputError
from testbed.report.page import Table


@dataclass(frozen=True)
class RobotBlindTest(Benchmark[int]):
    """`runs` runs of consecutive seeds."""

    name = "robot_trials"
    noun = "runs"
    runs: int = 60
    first_seed: int = 2000
    asked: Asked = ALL_ASKED

    def cases(self) -> Mapping[str, int]:
        """The seeds."""
        return {str(seed): seed for seed in range(self.first_seed, self.first_seed + self.runs)}

    def work(self, case: int) -> Trial:
        """See robot_trials.trial; `refused` where control will not walk with what it believes."""
        try:
            return trial(case, self.asked)
        except InputError as error:
            return {"seed": case, "refused": str(error)}

    def made_from(self, case: int) -> str:
        """Where runs are kept has no say."""
        return repr((case, self.asked.second, self.asked.closed))

    def without(self) -> tuple[str, ...]:
        """How answers are scored, and the other benchmarks of this folder."""
        names = ("*scores.py", "*calibration.py", "trials.py", "benchmark.py", "measured_rigs.py")
        return tuple(f"benchmarks/diagnosis/{name}" for name in names)

    def summarise(self, answers: Answers) -> dict[str, Any]:
        """See scores."""
        made = [answer for answer in answers.values() if "refused" not in answer]
        alone = scores([alone_of(answer) for answer in made])
        return {"refused": len(answers) - len(made), **scores(made), "alone": alone}

    def tables(self, result: dict[str, Any]) -> Sequence[Table]:
        """The marks, what became of each hidden effect, and how far stated probabilities can be
        trusted.
        """
        return [
            _marks(result, "given a run of the sound machine from before"),
            _marks(result["alone"], "alone"),
            _second(result),
            _closed(result),
            _by_effect(result),
            _calibration(result),
        ]


def _marks(found: Mapping[str, Any], given: str) -> Table:
    asked = {
        "something visible: places right, no wrong one": found["place_named"],
        "something visible: a right place among those named": found["place_among_named"],
        "something visible: names and places right, no wrong one": found["name_and_place"],
        "something visible: named, or said to be like what was named": found["name_or_ambiguous"],
        "all hidden effects, visible or not: names and places right": found["named_of_all_hidden"],
        "two effects, both visible: both named": found["two_both_named"],
        "hidden and not visible: nothing wrong named": found["unseen_not_misnamed"],
        "sound machine: nothing named": found["clean_none"],
        "named at 0.8 or more: right": found["sure_and_right"],
        "effects outside the list, visible: called unnamed": found["outside_unnamed"],
        "effects outside the list: given no name": found["outside_not_named"],
        "90 % intervals of parameters hold the truth": found["intervals"],
        "another motion is estimated worse by more than 5 %": found["made_worse"],
        "... by what is hidden, believed to the number": found["made_worse_by_the_truth"],
        "... than as believed and than by what is hidden": found["made_worse_than_by_the_truth"],
    }
    rows = [
        [what, f"{r['share']:.1%}", str(r["of"]), f"{r['low95']:.1%} to {r['high95']:.1%}"]
        for what, r in asked.items()
        if r["of"]
    ]
    first, last = found["seeds"]
    title = f"Blind test on the robot, {given}: {found['runs']} runs, seeds {first} to {last}"
    return Table(title, ["what", "share", "of", "95 %"], rows)


def _second(found: Mapping[str, Any]) -> Table:
    second = found["second"]
    asked = {"all of them": ("without", "with"), "shown": ("visible_without", "visible_with")}
    rows = []
    for which, keys in asked.items():
        before, after = (second[key] for key in keys)
        if before["of"]:
            within = f"{after['low95']:.1%} to {after['high95']:.1%}"
            rows.append(
                [
                    which,
                    str(before["of"]),
                    f"{before['share']:.1%}",
                    f"{after['share']:.1%}",
                    within,
                ]
            )
    title = "Runs whose two likeliest sets lie within 0.3: what is hidden is said"
    return Table(title, ["runs", "of", "without a second motion", "with it", "95 %"], rows)


def _closed(found: Mapping[str, Any]) -> Table:
    asked = {
        "of what the hidden effects add": found["closed_share"],
        "of what believing them to the number closes": found["closed_of_closable"],
    }
    rows = [
        [what, str(shares["of"]), *(f"{shares[k]:.2f}" for k in ("p10", "p50", "p90"))]
        for what, shares in asked.items()
        if shares["of"]
    ]
    title = "Share of the foot-force error that is closed on another motion"
    return Table(title, ["share", "runs", "10th percentile", "median", "90th percentile"], rows)


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
