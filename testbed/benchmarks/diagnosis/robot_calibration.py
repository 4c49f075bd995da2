"""Fit the numbers of `testbed.diagnosis.robot.probabilities`: `testbed lab fit-robot-diagnosis DIR...`.

DIR is a folder of `testbed lab robot-diagnosis`; its runs are development runs from then on. What is fitted is the
mean logarithm of the probability that the distribution gives to what was hidden, held back by a ridge; it is fitted on
one half of the runs and judged on the other, both ways, before all of them are used.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from testbed.benchmarks.diagnosis.calibration import (
    given,
    halves,
    least_loss,
    ranges,
    read_trials,
    restate,
    rounded,
)
from testbed.benchmarks.diagnosis.scores import Trial, calibration, truth_set
from testbed.diagnosis.robot.probabilities import FILE, RobotSigns, distribution
from testbed.formats.files import check_file, write_text
from testbed.formats.yaml_files import yaml_text

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
    runs = [(RobotSigns.from_json(t["signs"]), truth_set(t)) for t in trials]

    def chances(moved: Array) -> Iterator[float]:
        weights = unpacked(moved)
        return (given(distribution(signs, weights), truth) for signs, truth in runs)

    return unpacked(least_loss(chances, [s != "one" for row in START.values() for s in row]))


def restated(trials: Sequence[Trial], weights: Mapping[str, Mapping[str, float]]) -> list[Trial]:
    """The trials with the probabilities, the verdict and the names that these numbers would give."""
    return [restate(t, distribution(RobotSigns.from_json(t["signs"]), weights)) for t in trials]


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
    return yaml_text(row)


def fit_file(folders: Sequence[Path], out: Path | None = None) -> str:
    """Fit on all runs of these folders, judge across halves, write (the shipped file if None); returns the text.

    Raises InputError where a folder has none.
    """
    out = check_file(out or FILE)
    trials = read_trials(folders)
    held_out = calibration(halves(trials, 10, lambda judged, on: restated(judged, fit(on))))
    text = as_yaml(fit(trials), trials, held_out)
    write_text(out, text)
    return text
