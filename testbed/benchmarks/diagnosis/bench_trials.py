"""The diagnosis on simulated benches and drives: `testbed lab bench-diagnosis`, and the fit of its
few numbers.

A law is a family: what is quoted of rigs with a law is said with numbers that were fitted on rigs
without it.
"""

from __future__ import annotations

import time
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from testbed.benchmarks.diagnosis.bench_rigs import make_bench
from testbed.benchmarks.diagnosis.calibration import ranges, rounded
from testbed.benchmarks.diagnosis.scores import rate
from testbed.benchmarks.harness import Answers, Benchmark, stored
from testbed.diagnosis.leg.bench_probabilities import (
    FILE,
    BenchCalibration,
    BenchSigns,
    distribution,
    signs,
)
from testbed.diagnosis.leg.bench_probabilities import calibration as shipped
from testbed.diagnosis.leg.diagnose import diagnose
from testbed.diagnosis.leg.probabilities import answer
from testbed.formats.files import check_file, write_text
from testbed.formats.yaml_files import yaml_text
from testbed.report.page import Table

Trial = dict[str, Any]
FIRST_SEED = 600
"""Seeds below were looked at, and the numbers fitted on some of them."""
SURE = 0.95
"""An answer from which on, both ways, it is counted how often it is wrong."""
RIDGE = 0.002
"""Weight of a squared weight against the mean loss of a rig."""
SPEAKS_AGAINST = ("closed",)
"""Signs that can only speak against a law without a name; all others can only speak for one. Signs
that go together would else be set off against each other: that generic terms take most of the
residual away spoke against such a law, as long as the residual itself spoke for it.
"""


def trial(seed: int) -> Trial:
    """One rig: what was hidden, what was said, and the signs that it was said from."""
    rig, hidden = make_bench(seed)
    began = time.perf_counter()
    found = diagnose(rig)
    assert found.proof is not None
    companion = max(found.companions.values(), default=0.0)
    judged_signs = signs(found.state, found.proof, found.found, companion)
    return {
        "seed": seed,
        "rig": rig.kind,
        **vars(hidden),
        "seconds": time.perf_counter() - began,
        "kept": list(found.proof.kept.names),
        "signs": judged_signs.as_json(),
        "verdict": found.verdict.kind,
        "names": [entry.name for entry in found.entries],
        "goes_with": dict(found.verdict.goes_with),
        "probability": found.verdict.hypotheses[0][1],
        "error": found.errors.total("force_n"),
    }


@dataclass(frozen=True)
class BenchTest(Benchmark[int]):
    """`rigs` benches and drives of consecutive seeds."""

    name = "bench_evaluation"
    noun = "rigs"
    rigs: int = 60
    first_seed: int = FIRST_SEED

    def cases(self) -> Mapping[str, int]:
        """The seeds."""
        return {str(seed): seed for seed in range(self.first_seed, self.first_seed + self.rigs)}

    def work(self, case: int) -> Trial:
        """See `trial`."""
        return trial(case)

    def summarise(self, answers: Answers) -> dict[str, Any]:
        """Shares of right verdicts."""
        return shares(list(answers.values()))

    def tables(self, result: dict[str, Any]) -> Sequence[Table]:
        """One table."""
        rows = [
            [key, f"{value['right']} of {value['of']}", _span(value)]
            for key, value in result.items()
        ]
        heads = ["what is in the rig", "verdict right", "95 % interval"]
        return [Table("Diagnosis of simulated benches and drives", heads, rows)]


def right(trial: Trial) -> bool:
    """Whether the verdict is what is there: of a listed effect, its name and no other."""
    if trial["kind"] == "listed":
        return bool(trial["names"] == [trial["law"]])
    return bool(trial["verdict"] == {"outside": "unnamed", "clean": "none"}[trial["kind"]])


def shares(trials: Sequence[Trial]) -> dict[str, Any]:
    """Kind of rig and of what is in it -> how many verdicts are right, of how many, with Wilson's
    interval.
    """
    out: dict[str, Any] = {}
    for rig in ("drive", "cylinder"):
        for kind in ("outside", "listed", "clean"):
            judged_signs = [
                right(trial) for trial in trials if trial["rig"] == rig and trial["kind"] == kind
            ]
            if judged_signs:
                out[f"{rig}, {kind}"] = {"right": sum(judged_signs), **rate(judged_signs)}
    return out


def _span(share: Mapping[str, float]) -> str:
    return f"{100 * share['low95']:.0f} to {100 * share['high95']:.0f} %"


def fit(trials: Sequence[Trial]) -> BenchCalibration:
    """A ridge regression, and how often names are wrong that passed their trials where names cover
    what is there.
    """
    rows = [BenchSigns.from_json(trial["signs"]).of_unnamed() for trial in trials]
    outside = [trial["kind"] == "outside" for trial in trials]
    weights = _regression(rows, outside)
    proven = [trial for trial in trials if trial["kind"] != "outside" and trial["kept"]]
    stray = _rate([[trial["law"]] not in _said(trial) for trial in proven])
    judged_signs = [(answer(row, weights), there) for row, there in zip(rows, outside, strict=True)]
    sure = [
        (found > 0.5) != there for found, there in judged_signs if abs(found - 0.5) > SURE - 0.5
    ]
    return BenchCalibration(weights, stray, _rate(sure), shipped().fading)


def _said(trial: Trial) -> list[list[str]]:
    """The names that passed their trials, and the sets that the data cannot tell from them."""
    others = [list(names) for names, _ in trial["signs"].get("exchanged", ())]
    return [list(trial["kept"]), *others]


def _rate(wrong: Sequence[bool]) -> float:
    """How often it is to be expected, after Laplace."""
    return (sum(wrong) + 1.0) / (len(wrong) + 2.0)


def _regression(rows: Sequence[Mapping[str, float]], yes: Sequence[bool]) -> dict[str, float]:
    """Weights of a logistic regression, signs in their own units, each in the sense in which it can
    speak at all; the constant `one` is free and not held back.
    """
    from scipy.optimize import minimize

    names = list(rows[0])
    features = np.array([[row[name] for name in names] for row in rows])
    size = np.maximum(np.abs(features).max(axis=0), 1e-9)
    sign = np.where(np.array(yes), 1.0, -1.0)
    held = np.array([name != "one" for name in names])

    def loss(weights: Any) -> float:
        fits = np.logaddexp(0.0, -sign * (features / size @ weights))
        return float(np.mean(fits) + RIDGE * np.sum(weights[held] ** 2) / len(names))

    senses = [_sense(name) for name in names]
    learnt = minimize(loss, np.zeros(len(names)), method="L-BFGS-B", bounds=senses).x / size
    return dict(zip(names, map(float, learnt), strict=True))


def _sense(sign: str) -> tuple[float | None, float | None]:
    """The least and the largest weight of a sign."""
    if sign == "one":
        return None, None
    return (None, 0.0) if sign in SPEAKS_AGAINST else (0.0, None)


def restated(trial: Trial, calibration: BenchCalibration) -> Trial:
    """The trial with the verdict that other numbers would give."""
    found = distribution(BenchSigns.from_json(trial["signs"]), tuple(trial["kept"]), calibration)
    top, probability = max(found.items(), key=lambda item: item[1])
    verdict = "unnamed" if top == ("unnamed",) else "effect" if top else "none"
    names = list(top) if verdict == "effect" else []
    return {**trial, "verdict": verdict, "names": names, "probability": probability}


def left_out(trials: Sequence[Trial]) -> list[Trial]:
    """Every rig restated by numbers fitted without its family: its law, or of clean rigs its
    sensor's noise.
    """

    def family(trial: Trial) -> str:
        return str(trial["law"] or trial["noise"])

    out = []
    for one in sorted({family(trial) for trial in trials}):
        numbers = fit([trial for trial in trials if family(trial) != one])
        out += [restated(trial, numbers) for trial in trials if family(trial) == one]
    return out


def fit_file(folders: Sequence[Path], out: Path | None = None) -> str:
    """Fit on all rigs of these folders, judge with families left out, write (the shipped file if
    None).
    """
    out = check_file(out or FILE)
    trials = [trial for folder in folders for trial in stored(folder)]
    numbers, judged = fit(trials), left_out(trials)
    stated = float(np.mean([trial["probability"] for trial in judged]))
    row = {
        "fitted_by": "testbed lab fit-bench-diagnosis DIR, DIR of testbed lab bench-diagnosis",
        "rigs": len(trials),
        "seeds": ranges([int(trial["seed"]) for trial in trials]),
        "families_left_out_in_turn": {
            name: f"{share['right']} of {share['of']}" for name, share in shares(judged).items()
        },
        "right_and_stated": [
            round(float(np.mean([right(trial) for trial in judged])), 3),
            round(stated, 3),
        ],
        "unnamed": rounded(numbers.unnamed),
        "stray": round(numbers.stray, 4),
        "lapse": round(numbers.lapse, 4),
        "fading": dict(numbers.fading),
    }
    text = yaml_text(row)
    write_text(out, text)
    return text
