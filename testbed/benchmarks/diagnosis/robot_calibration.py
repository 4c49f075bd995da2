"""Fit the numbers of `testbed.diagnosis.robot.probabilities`: `testbed lab fit-robot-diagnosis
DIR...`.

DIR is a folder of `testbed lab robot-diagnosis`; its runs are development runs from then on. What
is fitted is the mean logarithm of the probability that the distribution gives to what was hidden,
held back by a ridge; it is fitted on one half of the runs and judged on the other, both ways,
before all of them are used.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from testbed.benchmarks.diagnosis.calibration import (
    halves,
    least_loss,
    ranges,
    read_trials,
    restate,
    rounded,
)
from testbed.benchmarks.diagnosis.robot_intervals import fitted_doubt
from testbed.benchmarks.diagnosis.robot_scores import alone_of, calibration, target
from testbed.benchmarks.diagnosis.scores import Trial
from testbed.diagnosis.robot.motion_kinds import DRILL, SECOND, SWAY, WALK
from testbed.diagnosis.robot.probabilities import (
    FILE,
    NO_NAME,
    RobotSigns,
    Weighed,
    chances,
    distribution,
    leading,
    sort_of,
)
from testbed.diagnosis.robot.probabilities import calibration as calibration_numbers
from testbed.formats.arrays import Array, Flags
from testbed.formats.files import check_file, write_text
from testbed.formats.yaml_files import yaml_text

Numbers = dict[str, Any]
Sound = Mapping[str, Mapping[str, float]]
START: dict[str, float] = {
    "share": 0.6,
    "share_named": 0.6,
    "share_second": 0.5,
    "share_unnamed": 0.3,
    "one": 5.0,
    "two": 4.0,
    "unnamed": 6.0,
    "form_here": 0.15,
    "rest": 0.3,
}
"""Where the fit starts and what the ridge holds it to, in logarithms (E)."""
MUCH = 13.0
"""Evidence from which on more of it counts ever less: runs tell only how much `share` times it is,
and by less of it two effects at one place would seldom be said (E).
"""
SOUND_SHARE = 0.93
"""Evidence counts from what its sort of effect reaches in so many runs of sound machines in the
same kind of motion (E).
"""
SOUND = "clean"
COMMAND, KEEP_SOUND = "testbed lab fit-robot-diagnosis", " --keep-sound"


def unpacked(moved: Array) -> Numbers:
    """The flat vector of the fit as numbers."""
    fitted = {k: float(v * np.exp(by)) for (k, v), by in zip(START.items(), moved, strict=True)}
    return fitted | {"much": MUCH}


def fit(trials: Sequence[Trial], sound: Sound | None = None) -> Numbers:
    """The numbers with the least loss on these runs; `sound`: what each sort of effect reaches in
    sound machines, where these runs are not to show it.
    """
    runs = [(RobotSigns.from_json(t["signs"]), target(t)) for t in trials]
    sound = {**(sound or sound_of(trials))}
    weighed = [(Weighed.of(signs, {"sound": sound}), truth) for signs, truth in runs]
    asked = [(w, _rows(w, truth), not truth) for w, truth in weighed]

    def given(moved: Array) -> Iterator[float]:
        numbers = unpacked(moved)
        for one, rows, none in asked:
            sets, nothing = chances(one.scores(numbers))
            yield float(sets[rows].sum() + nothing * none)

    found = unpacked(least_loss(given, [True] * len(START)))
    doubt = fitted_doubt(trials)
    found |= {"sound": sound, "width": doubt.width, "law": dict(doubt.law)}
    return found | {"lapse": fitted_lapse(trials, found)}


def _rows(weighed: Weighed, truth: frozenset[str]) -> Flags:
    """(k,) which of the sets is the truth."""
    return np.array([frozenset(names) == truth for names in weighed.names], dtype=bool)


def sound_of(trials: Sequence[Trial]) -> dict[str, dict[str, float]]:
    """Kind of motion -> `sound_reach` of the sound machines in it; of two recordings that are
    weighed together these runs show nothing, and what is shipped stays.
    """
    runs = [RobotSigns.from_json(t["signs"]) for t in trials if t["kind"] == SOUND]
    out = {m: sound_reach([r for r in runs if r.motions == (m,)]) for m in (SWAY, WALK, DRILL)}
    return out | {SECOND: dict(calibration_numbers()["sound"].get(SECOND, {}))}


def sound_reach(runs: Sequence[RobotSigns]) -> dict[str, float]:
    """Sort of effect (`sort_of`) -> ln of the Bayes factor that its best place reaches in
    SOUND_SHARE of the runs of sound machines, where that is above nothing.
    """
    if not runs:
        return {}
    best: dict[str, list[float]] = {}
    for signs in runs:
        here: dict[str, float] = {}
        for names, factor in signs.sets:
            if len(names) == 1:
                sort = sort_of(names[0])
                here[sort] = max(here.get(sort, 0.0), factor)
        for sort, factor in here.items():
            best.setdefault(sort, []).append(factor)
    out = {}
    for sort, found in sorted(best.items()):
        whole = np.array(found + [0.0] * (len(runs) - len(found)))
        out[sort] = float(np.quantile(whole, SOUND_SHARE))
    return {sort: reach for sort, reach in out.items() if reach > 0.0}


def fitted_lapse(trials: Sequence[Trial], numbers: Numbers) -> float:
    """Share of what is stated of names that must go to none of them, so that names are as often
    right as is stated, over all runs in which one is said.
    """
    said = [t for t in restated(trials, numbers | {"lapse": 0.0}) if t["names"]]
    stated = sum(_probability(t, frozenset(t["names"])) for t in said)
    right = sum(frozenset(t["names"]) == target(t) for t in said)
    return float(np.clip(1.0 - right / stated, 0.0, 0.5)) if said else 0.0


def _probability(trial: Trial, names: frozenset[str]) -> float:
    """What a trial states of a set of names."""
    return sum(float(h["probability"]) for h in trial["hypotheses"] if {*h["names"]} == names)


def restated(trials: Sequence[Trial], numbers: Mapping[str, float]) -> list[Trial]:
    """The trials with the probabilities, the verdict and the names that these numbers would
    give.
    """
    return [_restated(t, numbers) for t in trials]


def _restated(trial: Trial, numbers: Mapping[str, float]) -> Trial:
    """A trial with the probabilities of sets of names that these numbers give, and what the
    diagnosis says of them.
    """
    found = distribution(RobotSigns.from_json(trial["signs"]), numbers)
    said = leading(found, numbers["lapse"])
    verdict = "none" if not said else "unnamed" if said == NO_NAME else "effect"
    names = list(said) if verdict == "effect" else []
    return {**restate(trial, found), "verdict": verdict, "names": names}


def as_yaml(
    numbers: Numbers, trials: Sequence[Trial], held_out: Mapping[str, Any], kept: str = ""
) -> str:
    """The numbers with where they come from; `kept`: the option by which some are older."""
    row = {
        "fitted_by": f"{COMMAND} DIR{kept}, DIR of testbed lab robot-diagnosis",
        "runs": len(trials),
        "seeds": ranges([int(t["seed"]) for t in trials]),
        "calibration_error_across_halves": round(held_out["expected_calibration_error"], 4),
        "brier_across_halves": round(held_out["brier"], 4),
        **rounded({k: v for k, v in numbers.items() if k not in ("law", "sound")}),
        "law": rounded(numbers["law"]),
        "sound": {motion: rounded(reach) for motion, reach in numbers["sound"].items()},
    }
    return yaml_text(row)


def fit_file(folders: Sequence[Path], out: Path | None = None, keep_sound: bool = False) -> str:
    """Fit on all runs of these folders, judge across halves, write (the shipped file if None);
    returns the text. `keep_sound`: what sound machines reach stays as shipped, for a share of few
    runs is not told by these.

    Raises InputError where a folder has none.
    """
    out = check_file(out or FILE)
    sound = calibration_numbers()["sound"] if keep_sound else None
    made = [t for t in read_trials(folders) if "refused" not in t]
    trials = [*made, *(alone_of(t) for t in made if "alone" in t)]
    held_out = halves(trials, 10, lambda judged, on: restated(judged, fit(on, sound)))
    kept = KEEP_SOUND if keep_sound else ""
    text = as_yaml(fit(trials, sound), trials, calibration(held_out), kept)
    write_text(out, text)
    return text
