"""One trial each: a command on a spoilt file, a kill in the middle of the work, random actions in
an environment.

A trial's answer names what went wrong, or is empty. A command may do what it was told (0, or 3
where an expectation was not met), refuse (2) or find that the simulation broke down (1), each but
the first with one line; a traceback, a fault of the testbed, silence or no end within the time
limit is wrong.
"""

from __future__ import annotations

import subprocess
import sys
import tempfile
import time
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from testbed import resources
from testbed.benchmarks.soak.mutations import damaged, mutated
from testbed.errors import InputError
from testbed.formats.yaml_files import read_mapping, yaml_text

LIMIT_S = 180.0
"""A command that takes longer hangs."""
SHORT_S = "0.3"
WORDS = {0: "served", 1: "fault of the simulation", 2: "refused", 3: "served"}


@dataclass(frozen=True)
class Trial:
    """What is tried, by a seed of its own."""

    kind: str
    seed: int


def attempt(trial: Trial) -> dict[str, Any]:
    """`outcome` in a word, `wrong` in a sentence (empty: nothing), and the time that it took, s."""
    rng, started = np.random.default_rng([trial.seed, *trial.kind.encode()]), time.perf_counter()
    with tempfile.TemporaryDirectory(prefix="soak-") as folder:
        outcome, wrong = TRIALS[trial.kind](Path(folder), rng)
    return {"outcome": outcome, "wrong": wrong, "seconds": time.perf_counter() - started}


def judged(*arguments: str) -> tuple[str, str]:
    """Outcome of a command, and what is wrong with it."""
    try:
        done = subprocess.run(
            [sys.executable, "-m", "testbed", *arguments],
            capture_output=True,
            text=True,
            errors="replace",
            timeout=LIMIT_S,
            check=False,
        )
    except subprocess.TimeoutExpired:
        return "hung", f"no end within {LIMIT_S:g} s: {' '.join(arguments)[:200]}"
    lines = [line for line in done.stderr.splitlines() if line.startswith("testbed:")]
    if done.returncode not in WORDS or "Traceback" in done.stderr:
        return "fell over", done.stderr[-300:] or f"exit status {done.returncode}"
    if "a fault of ours" in done.stderr:
        return "fell over", lines[-1][:300]
    if done.returncode in (1, 2) and len(lines) != 1:
        return "unclear", f"{len(lines)} lines with exit status {done.returncode}"
    return WORDS[done.returncode], ""


def spoilt_scenario(folder: Path, rng: np.random.Generator) -> tuple[str, str]:
    """A shipped scenario, changed, is run for a moment."""
    names = sorted(resources.folder("scenarios").glob("*.yaml"))
    names = [path for path in names if "scenario" in str(read_mapping(path).get("format"))]
    tree = read_mapping(names[int(rng.integers(len(names)))])
    _write(folder / "spoilt.yaml", mutated(tree, rng))
    arguments = ["--duration", SHORT_S, "--out", str(folder / "run")]
    outcome, wrong = judged("run", str(folder / "spoilt.yaml"), *arguments)
    return outcome, wrong or (_not_whole(folder / "run") if outcome == "served" else "")


def spoilt_sweep(folder: Path, rng: np.random.Generator) -> tuple[str, str]:
    """A small sweep, changed, is run."""
    tree = {
        "format": "roboclimber-sweep/1",
        "scenario": "stand_flat",
        "duration_s": 0.1,
        "keep": "summary",
        "seeds": [1, 2],
        "grid": {"terrain.slope_deg": [0, 10]},
    }
    _write(folder / "spoilt.yaml", mutated(tree, rng))
    return judged("sweep", str(folder / "spoilt.yaml"), "--out", str(folder / "out"))


def spoilt_recording(folder: Path, rng: np.random.Generator) -> tuple[str, str]:
    """A run's header, table or summary, changed, is estimated from or looked at."""
    run = folder / "run"
    judged("run", "stand_slope_45", "--duration", SHORT_S, "--out", str(run))
    (run / "report.html").unlink(missing_ok=True)
    name = ("recording.yaml", "data.parquet", "truth.parquet", "summary.json")[rng.integers(4)]
    if name == "recording.yaml" and rng.random() < 0.8:
        _write(run / name, mutated(read_mapping(run / name), rng))
    else:
        (run / name).write_bytes(damaged((run / name).read_bytes(), rng))
    if rng.random() < 0.5:
        return judged("view", str(run), "--no-open")
    return judged("estimate", str(run), "--out", str(folder / "forces.csv"))


def killed_run(folder: Path, rng: np.random.Generator) -> tuple[str, str]:
    """A run is killed at a random moment: what is there can be read, and the folder can be used
    again.
    """
    out = folder / "run"
    _killed(rng, "run", "stand_slope_45", "--duration", "60", "--out", str(out))
    wrong = _not_whole(out) if any((out / "truth.parquet").glob("part-*")) else ""
    outcome, again = judged("run", "stand_flat", "--duration", SHORT_S, "--out", str(out))
    return "killed" if outcome == "served" else outcome, wrong or again


def killed_sweep(folder: Path, rng: np.random.Generator) -> tuple[str, str]:
    """A sweep is killed at a random moment, and goes on to the numbers of one that was not."""
    file = folder / "sweep.yaml"
    file.write_text(
        "format: roboclimber-sweep/1\nscenario: stand_flat\nduration_s: 0.3\nkeep: all\n"
        "seeds: [1, 2, 3, 4]\n"
    )
    _killed(rng, "sweep", str(file), "--out", str(folder / "killed"))
    for name in ("killed", "whole"):
        outcome, wrong = judged("sweep", str(file), "--out", str(folder / name))
        if wrong:
            return outcome, wrong
    first, second = (_truths(folder / name) for name in ("killed", "whole"))
    return "killed", "" if first == second else "other numbers than a sweep that was not killed"


def random_actions(folder: Path, rng: np.random.Generator) -> tuple[str, str]:
    """An environment takes random actions until its episode ends: what it shows stays finite and in
    its bounds.
    """
    from testbed.envs import ENVIRONMENTS, make

    name = sorted(ENVIRONMENTS)[int(rng.integers(len(ENVIRONMENTS)))]
    env = make(name, disable_env_checker=True)
    env.action_space.seed(int(rng.integers(2**31)))
    shown, _ = env.reset(seed=int(rng.integers(2**31)))
    wrong = ""
    for _ in range(300):
        shown, reward, terminated, truncated, _ = env.step(env.action_space.sample())
        if not (np.isfinite(float(reward)) and env.observation_space.contains(shown)):
            wrong = f"{name} showed {shown} for {reward}"
        if terminated or truncated or wrong:
            break
    env.close()
    return "served", wrong


def _killed(rng: np.random.Generator, *arguments: str) -> None:
    """Start a command and kill it after up to eight seconds, the moment by chance."""
    child = subprocess.Popen(
        [sys.executable, "-m", "testbed", *arguments],
        stdout=subprocess.DEVNULL,
        stderr=subprocess.DEVNULL,
    )
    try:
        child.wait(float(rng.uniform(0.2, 8.0)))
    except subprocess.TimeoutExpired:
        child.kill()
        child.wait()


def _truths(folder: Path) -> dict[str, bytes]:
    """The truth of every run below a folder, byte by byte."""
    return {path.parent.name: path.read_bytes() for path in folder.rglob("truth.parquet")}


def _not_whole(folder: Path) -> str:
    """What is wrong with the records of a run: unreadable, not finite; empty: nothing."""
    from testbed.simulation.runs import read_run

    try:
        run = read_run(folder)
    except InputError as error:
        return f"its records are lost: {error}"
    for name, values in (*run.data.items(), *run.truth.items()):
        if not np.isfinite(values).all():
            return f"{name} is not finite"
    return ""


def _write(path: Path, tree: Any) -> None:
    path.write_text(yaml_text(tree))


TRIALS = {
    "scenario": spoilt_scenario,
    "recording": spoilt_recording,
    "sweep": spoilt_sweep,
    "actions": random_actions,
    "killed run": killed_run,
    "killed sweep": killed_sweep,
}
