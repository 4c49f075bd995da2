"""Fit the numbers of `testbed.diagnosis.robot.probabilities`: `testbed lab fit-robot-diagnosis DIR...`.

DIR is a folder of `testbed lab robot-diagnosis`; its runs are development runs from then on. What is fitted is the
mean logarithm of the probability that the distribution gives to what was hidden, held back by a ridge; it is fitted on
one half of the runs and judged on the other, both ways, before all of them are used.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt
import yaml

from testbed.benchmarks.diagnosis.calibration import LEAST, RIDGE, SLIGHT, given, ranges, rounded
from testbed.benchmarks.diagnosis.scores import Trial, calibration, truth_set
from testbed.benchmarks.harness import stored
from testbed.diagnosis.robot.probabilities import FILE, RobotSigns, distribution
from testbed.errors import InputError
from testbed.formats.files import check_file, write_text

Array = npt.NDArray[np.float64]
Weights = dict[str, dict[str, float]]
START: Weights = {
    "strange": {"one": -5.5, "worst": 3.0},
    "presence": {"one": -4.0, "gain": 2.0, "fall": 1.0},
    "second": {"one": -2.0, "more": 1.5, "fall": 2.0, "first": -0.7},
    "rivals": {"slack": 5.0, "share": 0.05, "power": 3.0},
}
"""Where the fit starts and what the ridge holds it to (E)."""
COMMAND = "testbed lab fit-robot-diagnosis"


def read_trials(folders: Sequence[Path]) -> list[Trial]:
    """The single runs in folders of `testbed lab robot-diagnosis`. Raises InputError without any."""
    return [trial for folder in folders for trial in stored(folder)]


def unpacked(moved: Array) -> Weights:
    """The flat vector of the fit as weights: distances from START, of `rivals` in logarithms."""
    places = [(question, sign) for question, row in START.items() for sign in row]
    out: Weights = {question: {} for question in START}
    for (question, sign), by in zip(places, moved, strict=True):
        start = START[question][sign]
        out[question][sign] = float(start * np.exp(by) if question == "rivals" else start + by)
    return out


def fit(trials: Sequence[Trial]) -> Weights:
    """The numbers with the least loss on these runs."""
    from scipy.optimize import minimize

    runs = [(RobotSigns.from_json(t["signs"]), truth_set(t)) for t in trials]
    held = np.array([sign != "one" for row in START.values() for sign in row])

    def loss(moved: Array) -> float:
        weights = unpacked(moved)
        total = sum(np.log(max(given(distribution(s, weights), truth), LEAST)) for s, truth in runs)
        return float(-total + RIDGE * np.sum(moved[held] ** 2) + SLIGHT * np.sum(moved**2))

    return unpacked(
        np.asarray(minimize(loss, np.zeros(len(held)), method="BFGS", options={"maxiter": 200}).x)
    )


def restated(trials: Sequence[Trial], weights: Mapping[str, Mapping[str, float]]) -> list[Trial]:
    """The trials with the probabilities and the verdict that these numbers would give."""
    out = []
    for t in trials:
        ranked = sorted(
            distribution(RobotSigns.from_json(t["signs"]), weights).items(),
            key=lambda item: -item[1],
        )
        top = ranked[0][0]
        verdict = "unnamed" if top == ("unnamed",) else "effect" if top else "none"
        out.append(
            {
                **t,
                "hypotheses": [{"names": list(n), "probability": p} for n, p in ranked],
                "verdict": verdict,
            }
        )
    return out


def halves(trials: Sequence[Trial]) -> list[Trial]:
    """Every run restated by numbers that were fitted on the other half."""
    parts = [[t for t in trials if (t["seed"] // 10) % 2 == k] for k in (0, 1)]
    if not all(parts):
        raise InputError(
            "holds too few runs", field="runs", value=len(trials), allowed="at least 20"
        )
    return restated(parts[0], fit(parts[1])) + restated(parts[1], fit(parts[0]))


def as_yaml(weights: Weights, trials: Sequence[Trial], held_out: Mapping[str, Any]) -> str:
    """The numbers with where they come from."""
    row = {
        "fitted_by": f"{COMMAND} DIR, DIR of testbed lab robot-diagnosis",
        "runs": len(trials),
        "seeds": ranges([int(t["seed"]) for t in trials]),
        "calibration_error_across_halves": round(held_out["expected_calibration_error"], 4),
        "brier_across_halves": round(held_out["brier"], 4),
        **{question: rounded(values) for question, values in weights.items()},
    }
    return yaml.safe_dump(row, sort_keys=False)


def fit_file(folders: Sequence[Path], out: Path | None = None) -> str:
    """Fit on all runs of these folders, judge across halves, write (the shipped file if None); returns the text.

    Raises InputError where a folder has none.
    """
    out = check_file(out or FILE)
    trials = read_trials(folders)
    held_out = calibration(halves(trials))
    text = as_yaml(fit(trials), trials, held_out)
    write_text(out, text)
    return text
