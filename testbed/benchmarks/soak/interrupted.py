"""Work that is killed (SIGKILL) at a random moment, and begun again by the same command.

What a run had recorded is the beginning of what one records that was not killed; sweeps,
benchmarks, trainings and commissionings end with the same bits.
"""

from __future__ import annotations

import os
import shutil
import signal
import tempfile
import time
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import cache, partial
from pathlib import Path
from typing import ClassVar

import numpy as np

from testbed.benchmarks.harness import Answers, Benchmark, run
from testbed.benchmarks.soak.sandbox import Ended, Judged, Work, begun, by_command, ended
from testbed.benchmarks.soak.spoilt_files import not_whole
from testbed.formats.yaml_files import yaml_text
from testbed.report.page import Table

Found = Mapping[str, bytes]
"""Name of a file, or of a part of one -> its content."""
SWEEP = (
    "format: roboclimber-sweep/1\nscenario: stand_flat\nduration_s: 0.2\nkeep: all\n"
    "seeds: [1, 2, 3]\n"
)
LEVEL = (
    "format: roboclimber-scenario/1\nname: level\nduration_s: 92\nseed: 1\n"
    "terrain: {slope_deg: 0}\nrobot: {vertical_m: 0.25}\nropes: {enabled: false}\n"
    "task: {kind: commission}\n"
)
ON_ROPES = (
    "format: roboclimber-scenario/1\nname: ropes\nduration_s: 22\n"
    "terrain: {slope_deg: 45}\nrobot: {vertical_m: 0.25}\nropes: {share: 0.9}\n"
    "task: {kind: commission}\n"
)
RUN_S = "1"
TRAINED_STEPS, ROUND_STEPS, ROLLOUT = "384", 128, 64
"""A training of three rounds of two rollouts each: long enough to be killed in any of them."""


@dataclass(frozen=True)
class Stands(Benchmark[int]):
    """A small benchmark that is there to be killed: the lowest load of short stands."""

    name: ClassVar[str] = "stands"
    noun: ClassVar[str] = "stands"

    def cases(self) -> Mapping[str, int]:
        """Six seeds."""
        return {f"stand {seed}": seed for seed in range(6)}

    def work(self, case: int) -> float:
        """Lowest load of a foot in a fifth of a second, N."""
        from testbed.recording.rows import TruthRow
        from testbed.scenario.scenario import load_scenario
        from testbed.world.simulation import Simulation

        world = Simulation(load_scenario("stand_slope_45", seed=case, duration=0.2))
        try:
            _, truth = world.run_block(200)
        finally:
            world.close()
        return float(TruthRow.from_table(truth)["foot_load"].min())

    def summarise(self, answers: Answers) -> Answers:
        """All of them."""
        return dict(answers)

    def tables(self, result: Answers) -> list[Table]:
        """One line a stand."""
        return [Table("Stands", ["stand", "N"], [[k, str(v)] for k, v in result.items()])]


def killed_run(folder: Path, rng: np.random.Generator) -> Judged:
    """See the module."""
    work = _run
    whole, wall_s = _whole("run")
    out = folder / "run"
    _kill(work(out), rng, wall_s)
    recorded = all(_holds_rows(out / f"{series}.parquet") for series in ("data", "truth"))
    wrong = not_whole(out) if recorded else ""
    if recorded and not wrong:
        wrong = (
            "" if _beginning(recorded_rows(out), whole) else "its records are not a run's beginning"
        )
    if wrong:
        return "killed", wrong
    return _judged(ended(begun(work(out))), recorded_rows(out) == whole)


def _holds_rows(series: Path) -> bool:
    """Whether a part of a series was whole when its run was killed."""
    return series.is_file() or any(series.glob("part-*"))


def killed_sweep(folder: Path, rng: np.random.Generator) -> Judged:
    """See the module."""
    return _goes_on("sweep", folder, rng)


def killed_benchmark(folder: Path, rng: np.random.Generator) -> Judged:
    """See the module."""
    return _goes_on("benchmark", folder, rng)


def killed_training(folder: Path, rng: np.random.Generator) -> Judged:
    """See the module; left out where the extra `rl` is not installed."""
    from importlib.util import find_spec

    if find_spec("stable_baselines3") is None:
        return "left out", ""
    return _goes_on("training", folder, rng)


def killed_commissioning(folder: Path, rng: np.random.Generator) -> Judged:
    """See the module."""
    return _goes_on("commissioning", folder, rng)


# ---- what is killed ------------------------------------------------------------------------------


def _run(out: Path) -> Work:
    return by_command("run", "stand_slope_45", "--duration", RUN_S, "--out", str(out))


def _sweep(out: Path) -> Work:
    out.parent.mkdir(exist_ok=True)
    file = out.with_name("sweep.yaml")
    file.write_text(SWEEP)
    return by_command("sweep", str(file), "--out", str(out))


def _benchmark(out: Path) -> Work:
    return partial(run, Stands(), out)


def _training(out: Path) -> Work:
    return partial(_train, out)


def _train(out: Path) -> None:
    """A training in small rounds, so that some of them are whole before it is killed."""
    from testbed.envs import training

    training.ROUND_STEPS = ROUND_STEPS
    training.MANY_STEPS.update({"n_steps": ROLLOUT, "batch_size": ROLLOUT})
    training.train("stand", out, int(TRAINED_STEPS))


def _commissioning(out: Path) -> Work:
    out.mkdir(exist_ok=True)
    file = out.with_name("level.yaml")
    file.write_text(LEVEL)
    out.with_name("ropes.yaml").write_text(ON_ROPES)
    model = str(out / "model.yaml")
    return by_command("commission", str(file), "--out", model, before=partial(_quickly, out.parent))


def _quickly(folder: Path) -> None:
    """Both stages of a commissioning with its motions at one speed and one pull: a minute of them
    instead of ten.
    """
    from testbed.control.gaits import commission as gait
    from testbed.workflows import commission

    one_speed = dict.fromkeys(
        ("FOOT_SPEEDS_M_S", "BODY_SPEEDS_M_S", "REACH_SPEEDS_M_S", "SWING_SPEEDS_M_S"), (0.06,)
    )
    vars(gait).update(one_speed, SHIFT_S=2.0, SPEED_M_S=0.06, PULLS_M=((0.012, 0.0),))
    commission.ROPES_STAGE = str(folder / "ropes.yaml")


def recorded_rows(out: Path) -> Found:
    """Every column that was recorded."""
    from testbed.simulation.runs import read_run

    found = read_run(out)
    series = {"data": found.data, "truth": found.truth}
    return {f"{s} {name}": v.tobytes() for s, of in series.items() for name, v in of.items()}


def _truths(out: Path) -> Found:
    """The truth of every run of a sweep, and its results but for the time that they took."""
    import csv

    with (out / "results.csv").open() as file:
        rows = [{k: v for k, v in row.items() if k != "wall_s"} for row in csv.DictReader(file)]
    files = {path.parent.name: path.read_bytes() for path in out.rglob("truth.parquet")}
    return {**files, "results": yaml_text(rows).encode()}


KILLED: dict[str, tuple[Callable[[Path], Work], Callable[[Path], Found]]] = {
    "run": (_run, recorded_rows),
    "sweep": (_sweep, _truths),
    "benchmark": (_benchmark, lambda out: {"json": (out / "stands.json").read_bytes()}),
    "training": (_training, lambda out: {"npz": (out / "policy.npz").read_bytes()}),
    "commissioning": (_commissioning, lambda out: {"model": (out / "model.yaml").read_bytes()}),
}
"""Name -> the work on a folder, and what is compared of it."""


def _goes_on(name: str, folder: Path, rng: np.random.Generator) -> Judged:
    """Kill it, up to three times, let it go on, and compare."""
    work, found = KILLED[name]
    whole, wall_s = _whole(name)
    out = folder / "out"
    for _ in range(int(rng.integers(1, 4))):
        _kill(work(out), rng, wall_s)
    done = ended(begun(work(out)))
    return _judged(done, done.status == 0 and found(out) == whole)


@cache
def _whole(name: str) -> tuple[Found, float]:
    """What it comes to where nobody kills it, and how long that takes, s; made once a process."""
    work, found = KILLED[name]
    place = Path(tempfile.mkdtemp(prefix="soak-"))
    try:
        started = time.perf_counter()
        done = ended(begun(work(place / "out")))
        wall_s = time.perf_counter() - started
        if done.status != 0:
            raise RuntimeError(f"{name} does not even end by itself: {done.said[-300:]}")
        return found(place / "out"), wall_s
    finally:
        shutil.rmtree(place)


def _kill(work: Work, rng: np.random.Generator, wall_s: float) -> None:
    """Begin it and kill it at a moment of its whole time, the moment by chance."""
    child = begun(work)
    time.sleep(float(rng.uniform(0.0, wall_s)))
    os.kill(child.process, signal.SIGKILL)
    ended(child)


def _beginning(part: Found, whole: Found) -> bool:
    return all(whole[name].startswith(content) for name, content in part.items())


def _judged(done: Ended, same: bool) -> Judged:
    outcome, wrong = done.judged
    if wrong or outcome != "served":
        return outcome, wrong or f"it does not go on: {done.said[-300:]}"
    return "killed, same bits", "" if same else "other bits than where nobody killed it"
