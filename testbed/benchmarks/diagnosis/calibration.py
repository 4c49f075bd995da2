"""Fit the numbers of `testbed.diagnosis.leg.probabilities`: `testbed lab fit-diagnosis DIR`.

DIR is a folder of `testbed evaluate-diagnosis`; its rigs are development rigs from then on.
What is fitted is the mean logarithm of the probability that the distribution gives to what was
really hidden, held back by a small ridge. It is fitted on one half of the rigs and judged on the
other, both ways, before all of them are used.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from testbed.benchmarks.diagnosis.scores import Trial, calibration, truth_set
from testbed.benchmarks.harness import stored
from testbed.diagnosis.leg.probabilities import (
    FILE,
    LAPSING,
    Calibration,
    distribution,
    flow_terms_signs,
    generic_signs,
    left_signs,
    presence_signs,
    second_signs,
)
from testbed.diagnosis.leg.probabilities import calibration as shipped
from testbed.diagnosis.leg.signs import Signs
from testbed.errors import InputError
from testbed.formats.arrays import Array
from testbed.formats.files import check_file, write_text
from testbed.formats.yaml_files import yaml_text

RIDGE = 3.0
"""Weight of the squared distances from START, which rests on more rigs, against the loss summed
over all rigs; of constants it is SLIGHT."""
SLIGHT = 0.02
LEAST = 1e-3
"""Probability that counts for a set that was never tried."""
START = {
    "left": {"one": -1.791, "force": 4.627, "flow": 4.948, "pressed": 4.627, "gain": -0.5859},
    "generic": {"one": -4.4, "gain": 0.415, "share": 0.922, "fall": 0.08916, "alone": 1.197},
    "flow_terms": {"one": -3.739, "gain": 2.046, "fall": 1.722, "share": 0.9052},
    "presence": {"one": -7.823, "gain": 2.794, "fall": 2.017, "carried": 0.4325},
    "second": {
        "one": 1.311,
        "more": 1.525,
        "fall": 1.423,
        "carried": -0.02039,
        "first": -0.5,
        "left": -1.93,
        "worst": -0.4948,
        "alone": 0.6172,
    },
    "rivals": {"slack": 17.68, "share": 0.007985, "power_1": 3.233, "power_2": 3.052},
}
"""Where the fit starts and what the ridge holds it to: weights fitted before on 277 other rigs."""
LAPSES = tuple(f"{question}_{kind}" for question in LAPSING for kind in ("missed", "ghost"))
LAPSE_START = -3.5
"""Logarithm of the odds of a lapse from which the fit starts: one in 33."""
QUESTIONS = ("left", "generic", "flow_terms", "presence", "second")
RECKONED = ("edges", "late", "fading")
COMMAND = "testbed lab fit-diagnosis"


def read_trials(folders: Sequence[Path]) -> list[Trial]:
    """The single trials in folders of a blind test. Raises InputError where a folder has none."""
    return [trial for folder in folders for trial in stored(folder)]


def names_of(example: Signs) -> dict[str, list[str]]:
    """Question -> its signs."""
    of_all = (left_signs, generic_signs, flow_terms_signs)
    asked = [ask(example) for ask in of_all]
    asked += [presence_signs(example.refit), second_signs(example)]
    return {question: list(found) for question, found in zip(QUESTIONS, asked, strict=True)}


def unpacked(moved: Array, names: dict[str, list[str]]) -> Calibration:
    """The flat vector of the fit as weights: distances from START, of `rivals` in logarithms, of
    lapses in log odds. Those of the edges, of late commands and of fading friction are reckoned and
    stay: rigs of equal edges, and of which few have late commands or a drag, do not tell them.
    """
    out: dict[str, dict[str, float]] = {}
    at = 0
    for question in QUESTIONS:
        here = dict(zip(names[question], moved[at : at + len(names[question])], strict=True))
        out[question] = {
            name: float(START[question].get(name, 0.0) + value) for name, value in here.items()
        }
        at += len(here)
    rest, last = START["rivals"], moved[at + len(START["rivals"]) :]
    rivals = {
        name: float(value * np.exp(number))
        for (name, value), number in zip(rest.items(), moved[at : at + len(rest)], strict=True)
    }
    lapses = {
        lapse: float(1.0 / (1.0 + np.exp(-LAPSE_START - number)))
        for lapse, number in zip(LAPSES, last, strict=True)
    }
    reckoned = {name: getattr(shipped(), name) for name in RECKONED}
    return Calibration(**out, rivals=rivals, lapses=lapses, **reckoned)


def fit(trials: Sequence[Trial]) -> Calibration:
    """The numbers with the least loss on these rigs."""
    rigs = [(Signs.from_json(trial["signs"]), truth_set(trial)) for trial in trials]
    names = names_of(rigs[0][0])
    others = len(START["rivals"]) + len(LAPSES)
    held = [name != "one" for signs in names.values() for name in signs] + [True] * others

    def chances(moved: Array) -> Iterator[float]:
        numbers = unpacked(moved, names)
        return (given(distribution(signs, numbers), truth) for signs, truth in rigs)

    return unpacked(least_loss(chances, held), names)


def least_loss(chances: Callable[[Array], Iterator[float]], held: Sequence[bool]) -> Array:
    """Where the mean logarithm of `chances` (probabilities given to the truth) is best, from zero,
    under the ridge.

    `held`: which numbers the whole ridge holds; the others are constants.
    """
    from scipy.optimize import minimize

    ridge = np.where(held, RIDGE + SLIGHT, SLIGHT)

    def loss(moved: Array) -> float:
        total = sum(np.log(max(chance, LEAST)) for chance in chances(moved))
        return float(np.sum(ridge * moved**2) - total)

    found = minimize(loss, np.zeros(len(held)), method="BFGS", options={"maxiter": 200})
    return np.asarray(found.x)


def given(found: dict[tuple[str, ...], float], truth: frozenset[str]) -> float:
    """Probability given to a set of names."""
    return sum(probability for names, probability in found.items() if frozenset(names) == truth)


def restated(trials: Sequence[Trial], calibration: Calibration) -> list[Trial]:
    """The trials with the probabilities, the verdict and the names that these numbers would
    give.
    """
    return [
        restate(trial, distribution(Signs.from_json(trial["signs"]), calibration))
        for trial in trials
    ]


def restate(trial: Trial, chances: Mapping[tuple[str, ...], float]) -> Trial:
    """A trial with these probabilities of sets of names, and the verdict and names that they
    give.
    """
    ranked = sorted(chances.items(), key=lambda item: -item[1])
    top = ranked[0][0]
    verdict = "unnamed" if top == ("unnamed",) else "effect" if top else "none"
    hypotheses = [
        {"names": list(names), "probability": probability} for names, probability in ranked
    ]
    names = list(top) if verdict == "effect" else []
    return {**trial, "hypotheses": hypotheses, "verdict": verdict, "names": names}


def halves(trials: Sequence[Trial], every: int, fitted: Callable[..., list[Trial]]) -> list[Trial]:
    """Every trial as numbers that were fitted on the other half have it; in turn `every` seeds to
    each half.

    `fitted(judged, on)`: the trials `judged`, restated by what the trials `on` say. Raises
    InputError for too few.
    """
    one, other = (
        [trial for trial in trials if (trial["seed"] // every) % 2 == half] for half in (0, 1)
    )
    if not one or not other:
        allowed = f"at least {2 * every}"
        raise InputError("holds too few", field="trials", value=len(trials), allowed=allowed)
    return fitted(one, other) + fitted(other, one)


def as_yaml(calibration: Calibration, trials: Sequence[Trial], held_out: dict[str, Any]) -> str:
    """The numbers with where they come from."""
    seeds = [int(trial["seed"]) for trial in trials]
    row = {
        "fitted_by": f"{COMMAND} DIR, DIR of testbed evaluate-diagnosis",
        "rigs": len(seeds),
        "seeds": ranges(seeds),
        "calibration_error_across_halves": round(held_out["expected_calibration_error"], 4),
        "brier_across_halves": round(held_out["brier"], 4),
        **{
            question: rounded(getattr(calibration, question))
            for question in (*QUESTIONS, "rivals", "lapses", *RECKONED)
        },
    }
    return yaml_text(row)


def ranges(seeds: Sequence[int]) -> str:
    """`1000-1041, 1065`."""
    out: list[list[int]] = []
    for seed in sorted(set(seeds)):
        if out and seed == out[-1][1] + 1:
            out[-1][1] = seed
        else:
            out.append([seed, seed])
    return ", ".join(str(low) if low == high else f"{low}-{high}" for low, high in out)


def rounded(weights: Any) -> dict[str, float]:
    """Weights to four digits, as the files have them."""
    return {name: float(f"{weight:.4g}") for name, weight in weights.items()}


def fit_file(folders: Sequence[Path], out: Path | None = None) -> str:
    """Fit on all rigs of these folders, judge across halves, write (the shipped file if None);
    returns the text.

    Raises InputError where a folder has none.
    """
    out = check_file(out or FILE)
    trials = read_trials(folders)
    held_out = calibration(halves(trials, 8, lambda judged, on: restated(judged, fit(on))))
    text = as_yaml(fit(trials), trials, held_out)
    write_text(out, text)
    return text
