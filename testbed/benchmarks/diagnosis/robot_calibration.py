"""Fit the numbers of `testbed.diagnosis.robot.belief`: `python -m testbed.benchmarks.diagnosis.robot_calibration DIR...`.

DIR is a folder of `testbed.benchmarks.diagnosis.robot_trials`; its runs are development runs from then on. What is fitted is the
mean logarithm of the probability that the distribution gives to what was hidden, held back by a ridge; it is fitted on
one half of the runs and judged on the other, both ways, before all of them are used.
"""

from __future__ import annotations

import argparse
import json
import sys
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt
import yaml

from testbed.benchmarks.diagnosis.calibration import LEAST, RIDGE, SLIGHT, given, ranges, rounded
from testbed.benchmarks.diagnosis.scores import Trial, calibration, truth_set
from testbed.diagnosis.robot.belief import FILE, RobotSigns, distribution
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
COMMAND = "python -m testbed.benchmarks.diagnosis.robot_calibration"


def read_trials(folders: Sequence[Path]) -> list[Trial]:
    """The runs below folders of robot_trials, by seed. Raises InputError without any."""
    paths = sorted(path for folder in folders for path in (folder / "runs").glob("*.json"))
    if not paths:
        raise InputError(
            "holds no runs",
            file=folders[0],
            allowed="what testbed.benchmarks.diagnosis.robot_trials wrote",
        )
    return [json.loads(path.read_text(encoding="utf-8")) for path in paths]


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
        "fitted_by": f"{COMMAND} DIR, DIR of testbed.benchmarks.diagnosis.robot_trials",
        "runs": len(trials),
        "seeds": ranges([int(t["seed"]) for t in trials]),
        "calibration_error_across_halves": round(held_out["expected_calibration_error"], 4),
        "brier_across_halves": round(held_out["brier"], 4),
        **{question: rounded(values) for question, values in weights.items()},
    }
    return yaml.safe_dump(row, sort_keys=False)


def main(arguments: Sequence[str] | None = None) -> int:
    """Fit, judge across halves, write. Returns the exit status."""
    parser = argparse.ArgumentParser(prog=COMMAND, description=__doc__)
    parser.add_argument(
        "folders", nargs="+", type=Path, help="folders of testbed.benchmarks.diagnosis.robot_trials"
    )
    parser.add_argument("--out", type=Path, default=FILE, help="file to write")
    asked = parser.parse_args(arguments)
    try:
        check_file(asked.out)
        trials = read_trials(asked.folders)
        held_out = calibration(halves(trials))
        write_text(asked.out, as_yaml(fit(trials), trials, held_out))
    except (InputError, OSError) as error:
        print(error, file=sys.stderr)
        return 2
    print(asked.out.read_text(encoding="utf-8"))
    return 0


if __name__ == "__main__":
    sys.exit(main())
