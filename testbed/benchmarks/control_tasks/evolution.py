"""Learning a correction of a tuned rule by an evolution strategy, generation by generation.

A generation draws CASES new cases below the scored seeds. In each the rule goes alone until the
fault, from where PAIRS of networks go on: the mean with some noise added, and with the same noise
taken away. Both tries of a pair see the same case and the same noise of the sensors, so that their
difference is the noise's doing alone; the mean moves along the noises, each as much as its pair
differed by the measure of what pairs have differed by so far. What is written as the policy is a
running mean of the means.

A generation's draws depend on the training's seed and its number alone: one that was killed is made
again, and the training ends with the very weights of one that was not. A folder holds

    training.json   task, method, seed, settings
    state.npz       where it stands after the last whole generation
    episodes.csv    a line a case: generation, steps so far, seed of the case, score of the rule
                    alone, mean score of the tried networks
    policy.npz      the policy
"""

from __future__ import annotations

import zipfile
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from testbed.benchmarks.control_tasks.benchmark import SCORING_SEED
from testbed.benchmarks.control_tasks.corrected import FEATURES, OVER, REACH, Corrected
from testbed.benchmarks.control_tasks.episodes import stage
from testbed.benchmarks.control_tasks.tasks import TASKS
from testbed.errors import InputError, check_one_of
from testbed.formats.arrays import Array
from testbed.formats.files import owned, read_json, whole, write_json, write_text
from testbed.formats.networks import Network, write_network
from testbed.simulation.workers import single_threaded

LEARNT = ("keep",)
"""Tasks with a rule that can be corrected."""
CASES, PAIRS = 4, 4
NOISE = 0.08
"""Standard deviation of the noise on each weight."""
STEP = 0.1
"""How far a weight goes in a generation whose pairs differ by its noise alone."""
MEMORY = 0.95
"""Decay of running means, a generation."""
SETTINGS = {
    "cases": CASES,
    "pairs": PAIRS,
    "noise": NOISE,
    "step": STEP,
    "memory": MEMORY,
}
SHAPE = (len(REACH), len(FEATURES) + 1)
"""Of the weights: a row an answer, a column a feature; the last is the answer's bias."""
HEAD = "generation,steps,case,rule,tried"


@dataclass
class Course:
    """Where a training stands after a whole generation."""

    generation: int
    steps: int
    mean: Array
    running: Array
    """Running mean of the means, which began with zeros."""
    square: Array
    """() likewise of the squares of what pairs gained."""
    lines: list[str]

    def moved(self, noises: Array, gains: Array) -> None:
        """Go along noises (n, *SHAPE) by what half the differences of their pairs (n,) say."""
        self.generation += 1
        self.square = MEMORY * self.square + (1.0 - MEMORY) * np.mean(gains**2)
        usual = float(np.sqrt(self.square / self._begun)) + 1e-9
        way = np.tensordot(gains / usual, noises / NOISE, axes=1) / len(gains)
        self.mean = self.mean + STEP * way
        self.running = MEMORY * self.running + (1.0 - MEMORY) * self.mean

    @property
    def _begun(self) -> float:
        """What a running mean of ones, which began with zeros, is by now."""
        return max(1.0 - MEMORY**self.generation, 1e-9)

    @property
    def policy(self) -> Array:
        """The running mean, freed of the zeros that it began with."""
        return np.asarray(self.running / self._begun)


def evolve(
    task: str,
    out: Path,
    steps: int,
    seed: int | None = None,
    progress: Callable[[int], None] | None = None,
) -> Path:
    """Learn until `steps` steps of the environment are done, going on from the last whole
    generation in `out`; returns the policy's file.

    seed: of a new training, 0 if None; one that goes on keeps its own. Raises InputError for a task
    whose rule cannot be corrected and for a folder of another training.
    """
    check_one_of(task, LEARNT, "task", "has no rule to correct")
    single_threaded()
    with owned(out):
        seed = _begin(out / "training.json", task, seed)
        course = _read(out)
        while course.steps < steps:
            _generation(task, seed, course)
            _keep(out, task, seed, course)
            if progress is not None:
                progress(min(course.steps, steps))
    return out / "policy.npz"


def _begin(file: Path, task: str, seed: int | None) -> int:
    """Enter a training, or see that it is the one that is there; its seed."""
    kept = read_json(file) if file.is_file() else {}
    chosen = kept.get("seed", 0) if seed is None else seed
    asked = {"task": task, "method": "evolution", "seed": chosen, "settings": SETTINGS}
    for name, value in asked.items():
        if kept and kept.get(name) != value:
            raise InputError(
                f"holds another training, of {name} {kept.get(name)}",
                file=file.parent,
                field="--out",
                allowed="a new folder",
            )
    write_json(file, asked)
    return int(chosen)


def _generation(task: str, seed: int, course: Course) -> None:
    """Try the networks of a generation, and go where they were better."""
    rng = np.random.default_rng([seed, course.generation])
    noises, gains = NOISE * rng.standard_normal((CASES, PAIRS, *SHAPE)), []
    for case, some in zip(rng.integers(SCORING_SEED, size=CASES).tolist(), noises, strict=True):
        tried = [course.mean + sign * noise for noise in some for sign in (1.0, -1.0)]
        (rule, *scores), steps = _scores(task, case, [np.zeros(SHAPE), *tried])
        course.steps += steps
        gains.append(0.5 * (np.array(scores[0::2]) - np.array(scores[1::2])))
        numbers = f"{course.generation},{course.steps},{case}"
        course.lines.append(f"{numbers},{rule:.4f},{float(np.mean(scores)):.4f}")
    course.moved(noises.reshape(-1, *SHAPE), np.concatenate(gains))


def _scores(task: str, case: int, weights: list[Array]) -> tuple[list[float], int]:
    """Score of each network on a case, and how many steps were made for them all."""
    place = stage(TASKS[task])
    observation = place.begin(case)
    agent = Corrected(correction(np.zeros(SHAPE)))
    paid, observation = place.play(agent, observation, until_s=place.env.fault_s)
    parting, steps, scores = place.env.save(), agent.decisions, []
    for each in weights:
        other = agent.with_network(correction(each))
        further, _ = place.play(other, place.env.restore(parting))
        scores.append(paid + further)
        steps += other.decisions
    return scores, steps


def correction(weights: Array) -> Network:
    """The network of weights of SHAPE."""
    return Network(((weights[:, :-1], weights[:, -1]),))


def _keep(out: Path, task: str, seed: int, course: Course) -> None:
    """Write policy, episodes and, last, the state: what is killed before that is made again."""
    (weight, bias), *_ = correction(course.policy).layers
    made_by = f"testbed train {task} --method evolution --seed {seed}"
    arrays = {"weight_0": weight, "bias_0": bias}
    write_network(out / "policy.npz", arrays, made_by=made_by, task=task, over=OVER)
    write_text(out / "episodes.csv", "\n".join([HEAD, *course.lines, ""]))
    numbers = {name: value for name, value in vars(course).items() if name != "lines"}
    with whole(out / "state.npz") as hidden, hidden.open("wb") as file:
        np.savez(file, lines=np.array(course.lines), **numbers)


def _read(out: Path) -> Course:
    """The state of a training, or its beginning. Raises InputError for a file that is none."""
    file = out / "state.npz"
    if not file.is_file():
        return Course(0, 0, np.zeros(SHAPE), np.zeros(SHAPE), np.zeros(()), [])
    try:
        with np.load(file, allow_pickle=False) as kept:
            generation, steps = int(kept["generation"]), int(kept["steps"])
            mean, running, square = (kept[name] for name in ("mean", "running", "square"))
            lines = [str(line) for line in kept["lines"]]
        return Course(generation, steps, mean, running, square, lines)
    except (OSError, ValueError, TypeError, KeyError, zipfile.BadZipFile) as error:
        raise InputError("is no state of a training", file=file, field="--out") from error
