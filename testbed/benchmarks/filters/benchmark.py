"""The force filters compared: six scenes, six rivals each with its best constant, lock-out and
delay of true steps.

All filters share Q and R (the noise is known, and how smooth the plain filter shall be is a
choice). In every scene a rival counts with the constant that suits it best there; the testbed's own
filter has one setting for all.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from testbed.benchmarks.filters.rivals import NOISE_N, OWN, RATE_HZ, RIVALS, SCENES, Filter, scene
from testbed.benchmarks.harness import Answers, Benchmark
from testbed.formats.arrays import Array
from testbed.report.page import Table

Tree = dict[str, Any]
FILTERS = {filter_.name: filter_ for filter_ in (*RIVALS, OWN)}
Q_N2, R_N2 = 9.0, NOISE_N**2
"""R is the noise; Q gives the plain filter a time constant of 20 ms at 1 kHz."""
SETTLE = 200
STEP_AT = 200
"""Samples: left out at the start of a scene; before the step in the trial of steps."""


@dataclass(frozen=True)
class SceneResult:
    """Root mean square errors in N of one scene, and own / best rival."""

    scene: str
    rmse_n: dict[str, float]
    constants: dict[str, dict[str, float]]
    ratio: float


@dataclass(frozen=True)
class StepResult:
    """What becomes of true steps: locked out = never half way within the trial; delay to half
    height, ms.
    """

    filter: str
    steps: int
    locked_out: int
    delay_median_ms: float
    delay_p95_ms: float
    delay_worst_ms: float


def rmse_n(filter_: Filter, constants: dict[str, float], name: str, seeds: int) -> float:
    """Root mean square error in N over `seeds` runs of a scene."""
    squares = []
    for seed in range(seeds):
        truth, measured = scene(name, seed)
        error = (filter_(measured, Q_N2, R_N2, constants) - truth)[SETTLE:]
        squares.append(float(np.mean(error**2)))
    return float(np.sqrt(np.mean(squares)))


def compare_scene(name: str, seeds: int = 5) -> SceneResult:
    """All filters on one scene."""
    errors, constants = {}, {}
    for rival in RIVALS:
        tried = [(rmse_n(rival, choice, name, seeds), choice) for choice in rival.choices]
        errors[rival.name], constants[rival.name] = min(tried, key=lambda result: result[0])
    usual = OWN.choices[0]
    ours = rmse_n(OWN, usual, name, seeds)
    ratio = ours / min(errors.values())
    return SceneResult(name, errors | {OWN.name: ours}, constants | {OWN.name: usual}, ratio)


def half_height_delays(filter_: Filter, heights_n: Array, seed: int = 0) -> Array:
    """Samples from each true step to half its height, inf where it is not reached in 800 samples.

    The same noise for every filter, so that delays compare step by step.
    """
    rng = np.random.default_rng(seed)
    delays = np.full(heights_n.size, np.inf)
    for index, height in enumerate(heights_n):
        measured = rng.normal(0.0, NOISE_N, STEP_AT + 800)
        measured[STEP_AT:] += height
        answered = filter_(measured, Q_N2, R_N2)[STEP_AT:] * np.sign(height)
        reached = np.nonzero(answered >= 0.5 * abs(height))[0]
        if reached.size:
            delays[index] = reached[0]
    return delays


def step_trial(filter_: Filter, steps: int = 10_000) -> StepResult:
    """True steps of 0.3 to 10 kN, both ways, log-uniform, through a filter with its usual
    constant.
    """
    rng = np.random.default_rng(11)
    sizes_n = np.exp(rng.uniform(np.log(300.0), np.log(10_000.0), steps))
    delay = half_height_delays(filter_, sizes_n * rng.choice([-1.0, 1.0], steps))
    median, p95 = np.percentile(delay, [50.0, 95.0], method="lower") * 1e3 / RATE_HZ
    worst = float(delay.max()) * 1e3 / RATE_HZ
    lost = int(np.isinf(delay).sum())
    return StepResult(filter_.name, steps, lost, float(median), float(p95), worst)


@dataclass(frozen=True)
class Filters(Benchmark[str]):
    """Six scenes with `seeds` runs each; `steps` true steps through every filter."""

    name = "filters"
    noun = "trials"
    seeds: int = 5
    steps: int = 10_000

    def cases(self) -> Mapping[str, str]:
        """The scenes, then the filters that see the steps."""
        scenes = {f"{name}, {self.seeds} seeds": name for name in SCENES}
        return scenes | {f"{self.steps} steps, {name}": name for name in FILTERS}

    def made_from(self, case: str) -> str:
        """The case and how much of it."""
        return f"{case} {self.seeds if case in SCENES else self.steps}"

    def work(self, case: str) -> SceneResult | StepResult:
        """All filters on a scene, or all steps through a filter."""
        if case in SCENES:
            return compare_scene(case, self.seeds)
        return step_trial(FILTERS[case], self.steps)

    def summarise(self, answers: Answers) -> Tree:
        """Scenes and steps, in order."""
        found = list(answers.values())
        scenes, steps = found[: len(SCENES)], found[len(SCENES) :]
        return {"q_n2": Q_N2, "r_n2": R_N2, "scenes": scenes, "steps": steps}

    def tables(self, result: Tree) -> Sequence[Table]:
        """RMSE in N per scene, then what becomes of true steps."""
        names, steps = list(FILTERS), result["steps"]
        rows = [
            [
                f"{scene['scene']}, N",
                *(f"{scene['rmse_n'][n]:.1f}" for n in names),
                f"{scene['ratio']:.2f}",
            ]
            for scene in result["scenes"]
        ]
        plain, own = steps[0], steps[-1]
        for key, label in (
            ("locked_out", f"locked out of {plain['steps']} true steps"),
            ("delay_median_ms", "step delay, median, ms"),
            ("delay_p95_ms", "step delay, 95 %, ms"),
            ("delay_worst_ms", "step delay, worst, ms"),
        ):
            ratio = "" if key == "locked_out" else f"{own[key] / plain[key]:.2f} of kf"
            rows.append([label, *(_number(step[key]) for step in steps), ratio])
        return [Table("Force filters, RMSE", ["scene", *names, "own / best"], rows)]


def _number(value: float) -> str:
    return "never" if np.isinf(value) else f"{value:.0f}"
