"""`testbed soak`: the trials of every kind, and a table of how they ended."""

from __future__ import annotations

# Environments that take random actions: what they show stays finite and in its bounds.
import os
import subprocess
import sys
import tempfile
import time
from collections import Counter
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Any, ClassVar

import numpy as np

from testbed.benchmarks.harness import Answers, Benchmark
from testbed.benchmarks.soak import bad_conditions, interrupted, spoilt_files
from testbed.benchmarks.soak.sandbox import Judged, forked
from testbed.envs import ENVIRONMENTS, make
from testbed.errors import check_one_of
from testbed.formats.yaml_files import yaml_text
from testbed.report.page import Table

PHYSICS_STEPS = 10_000
"""Of one trial: a hundred trials make a million."""


def random_actions(number: int, rng: np.random.Generator, folder: Path) -> tuple[Judged, int]:
    """Random actions in an environment for so many physics steps; also how many were made under
    them. The environments take turns by the trial's number.
    """
    name, counted = sorted(ENVIRONMENTS)[number % len(ENVIRONMENTS)], folder / "steps"
    done = forked(partial(_act, name, rng, counted))
    return done.judged, int(counted.read_text()) if counted.is_file() else 0


def _act(name: str, rng: np.random.Generator, counted: Path) -> None:
    """As many episodes as it takes. Raises ValueError for what is shown and cannot be."""
    env = make(name, disable_env_checker=True)
    env.action_space.seed(int(rng.integers(2**31)))
    made, over, before_s = 0, True, 0.0
    while made < PHYSICS_STEPS:
        if over:
            shown, info = env.reset(seed=int(rng.integers(2**31)))
            paid, over = 0.0, False
        else:
            shown, reward, lost, ended, info = env.step(env.action_space.sample())
            paid = float(reward)
            made += max(_steps(env, info["t_s"] - before_s), 1)
            over = lost or ended
        before_s = info["t_s"]
        if not (np.isfinite(paid) and env.observation_space.contains(shown)):
            raise ValueError(f"{name} showed {shown} for {paid}")
        counted.write_text(str(made))


def _steps(env: Any, seconds: float) -> int:
    """Physics steps of so much simulated time."""
    simulation = getattr(env.unwrapped, "_sim", None)
    return 0 if simulation is None else round(seconds / simulation.dt)


Work = Callable[[Path, np.random.Generator], Judged]
KINDS: dict[str, tuple[Work, float]] = {
    "scenario": (spoilt_files.spoilt_scenario, 1.0),
    "recording": (spoilt_files.spoilt_recording, 1.0),
    "model": (spoilt_files.spoilt_model, 1.0),
    "sweep": (spoilt_files.spoilt_sweep, 1.0),
    "machine": (spoilt_files.spoilt_machine, 1.0),
    "killed run": (interrupted.killed_run, 0.015),
    "killed sweep": (interrupted.killed_sweep, 0.012),
    "killed benchmark": (interrupted.killed_benchmark, 0.012),
    "killed training": (interrupted.killed_training, 0.008),
    "killed commissioning": (interrupted.killed_commissioning, 0.003),
    "full disk": (bad_conditions.full_disk, 0.05),
    "read-only disk": (bad_conditions.read_only_disk, 0.02),
    "jumping clock": (bad_conditions.jumping_clock, 0.01),
    "two owners": (bad_conditions.two_owners, 0.02),
}
"""Kind -> one trial of it, and how many there are of one that has its whole number."""
ACTIONS, DRILLING = "random actions", "hours of drilling"
ACTIONS_SHARE = 0.1


@dataclass(frozen=True)
class Trial:
    """What is tried, by a seed of its own; of drilling, for how many hours."""

    kind: str
    seed: int
    hours: float = 0.0


@dataclass(frozen=True)
class Soak(Benchmark[Trial]):
    """`trials` of each kind, those that take long fewer, and `hours` of simulated drilling in one
    run, none if 0; `seed` makes others. `only`: kinds to try, all if none.
    """

    name: ClassVar[str] = "soak"
    noun: ClassVar[str] = "trials"
    trials: int = 1000
    seed: int = 0
    hours: float = 12.0
    only: tuple[str, ...] = ()

    def __post_init__(self) -> None:
        """Refuse a kind that there is not."""
        kinds = (*KINDS, ACTIONS, DRILLING)
        for kind in self.only:
            check_one_of(kind, kinds, "--only", "no such kind")

    def cases(self) -> Mapping[str, Trial]:
        """Every trial by its kind and number; the kinds take turns, so that a part of them says
        something of all.
        """
        shares = {kind: share for kind, (_, share) in KINDS.items()} | {ACTIONS: ACTIONS_SHARE}
        found = {
            f"{kind} {self.seed + k}": Trial(kind, self.seed + k)
            for k in range(self.trials)
            for kind, share in shares.items()
            if kind in (self.only or shares) and k < max(round(self.trials * share), 1)
        }
        if self.hours > 0.0 and DRILLING in (self.only or (DRILLING,)):
            found[f"{DRILLING} {self.hours:g}"] = Trial(DRILLING, self.seed, self.hours)
        return found

    def work(self, case: Trial) -> dict[str, Any]:
        """`outcome` in a word, `wrong` in a sentence (empty: nothing), the time that it took, s,
        and what is counted of it.
        """
        rng, started = np.random.default_rng([case.seed, *case.kind.encode()]), time.perf_counter()
        more: dict[str, Any] = {}
        with tempfile.TemporaryDirectory(prefix="soak-") as folder:
            try:
                outcome, wrong = _tried(case, Path(folder), rng, more)
            except Exception as error:
                outcome, wrong = "fell over", f"{type(error).__name__}: {error}"
        seconds = time.perf_counter() - started
        return {"outcome": outcome, "wrong": wrong, "seconds": seconds, **more}

    def summarise(self, answers: Answers) -> dict[str, Any]:
        """Counts of the outcomes by kind, and every trial in which something was wrong."""
        kinds = []
        for kind in (*KINDS, ACTIONS, DRILLING):
            found = [a for name, a in answers.items() if name.rpartition(" ")[0] == kind]
            if found:
                kinds.append(
                    {
                        "kind": kind,
                        "trials": len(found),
                        "outcomes": dict(sorted(Counter(a["outcome"] for a in found).items())),
                        "wrong": sum(bool(a["wrong"]) for a in found),
                        "slowest_s": max(a["seconds"] for a in found),
                    }
                )
        wrong = {name: a["wrong"] for name, a in answers.items() if a["wrong"]}
        steps = sum(a.get("physics_steps", 0) for a in answers.values())
        drilling = [a["drilling"] for a in answers.values() if "drilling" in a]
        return {"kinds": kinds, "wrong": wrong, "physics_steps": steps, "drilling": drilling}

    def tables(self, result: dict[str, Any]) -> Sequence[Table]:
        """One line a kind; one a trial that went wrong."""
        rows = [
            [
                str(row["kind"]),
                str(row["trials"]),
                ", ".join(f"{n} {word}" for word, n in row["outcomes"].items()),
                str(row["wrong"]),
                f"{row['slowest_s']:.1f}",
            ]
            for row in result["kinds"]
        ]
        tables = [Table("Soak", ["kind", "trials", "outcomes", "wrong", "slowest [s]"], rows)]
        if result["drilling"]:
            heads = ["hours", "memory [MB]", "growth [MB]", "at the end [MB]", "wall [s]"]
            names = ("hours", "memory_mb", "growth_mb", "memory_at_end_mb", "wall_s")
            lines = [[f"{run[name]:.1f}" for name in names] for run in result["drilling"]]
            tables.append(Table("Drilling in one run", heads, lines))
        if result["wrong"]:
            lines = [[name, " ".join(text.split())] for name, text in result["wrong"].items()]
            tables.append(Table("What went wrong", ["trial", "what"], lines))
        return tables


def _tried(case: Trial, folder: Path, rng: np.random.Generator, more: dict[str, Any]) -> Judged:
    """One trial; what is counted of it goes into `more`."""
    if case.kind == ACTIONS:
        judged, more["physics_steps"] = random_actions(case.seed, rng, folder)
        return judged
    if case.kind == DRILLING:
        found = {"hours": case.hours, **drilled(case.hours, folder)}
        more["drilling"] = found
        if found["exit_status"] != 0:
            return "fell over", f"exit status {found['exit_status']}"
        leaks = found["growth_mb"] > GROWTH_MB
        return "served", f"grew by {found['growth_mb']:.1f} MB" if leaks else ""
    return KINDS[case.kind][0](folder, rng)


# Hours of simulated drilling in one run: how its memory grows.
#
# The run is a process of its own, by the command that everybody uses; what it holds is read from
# the operating system once a second.

GROWTH_MB = 20.0
"""More growth than this is a leak: at ten hours a day it would fill a laptop in a season (E)."""
WARM_UP, LEAST_S = 0.05, 30
"""Share of the run, and least seconds, in which what is built once (caches, buffers) is built."""
LAP: tuple[dict[str, Any], ...] = (
    {"kind": "push", "duration_s": 5, "feed_n": 3000},
    {"kind": "hammer", "duration_s": 20, "feed_n": 5000, "blow_hz": 30, "blow_n": 1500},
    {"kind": "rest", "duration_s": 5},
    {"kind": "hammer", "duration_s": 20, "feed_n": 5500, "blow_hz": 30, "blow_n": 1500},
    {"kind": "pull_out", "duration_s": 10, "pull_n": 9000},
)
"""One minute of drilling, again and again; no rods, for the store holds no twelve hours' worth."""


def drilled(hours: float, folder: Path) -> dict[str, Any]:
    """Drill for so many simulated hours on 45 degrees, one row a second, all sensors and estimators
    at their usual rates.

    Returns `exit_status`, `wall_s`, `growth_mb` (highest memory after the warm-up above the highest
    in it, while it drills), `memory_mb` (highest while it drills) and `memory_at_end_mb` (with the
    report).
    """
    scenario = folder / "hours.yaml"
    task = {"kind": "drill", "start_s": 3, "repeat": True, "phases": list(LAP)}
    tree = {
        "format": "roboclimber-scenario/1",
        "name": "hours",
        "seed": 1,
        "duration_s": hours * 3600.0,
        "rates": {"record_hz": 1},
        "terrain": {"slope_deg": 45},
        "task": task,
        "expect": {"verdict": "stood"},
    }
    scenario.write_text(yaml_text(tree))
    out, started = folder / "hours", time.perf_counter()
    child = subprocess.Popen(
        [sys.executable, "-m", "testbed", "run", str(scenario), "--out", str(out)],
        stdout=subprocess.DEVNULL,
    )
    held: list[float] = []
    parts: list[int] = []
    while child.poll() is None:
        time.sleep(1.0)
        held.append(_memory_mb(child.pid))
        parts.append(_files(out / "data.parquet"))
    drilling, after = split(held, parts)
    return {
        "exit_status": child.returncode,
        "wall_s": time.perf_counter() - started,
        "growth_mb": growth_mb(drilling),
        "memory_mb": max(drilling),
        "memory_at_end_mb": max(after, default=0.0),
    }


def split(held_mb: Sequence[float], parts: Sequence[int]) -> tuple[list[float], list[float]]:
    """Memory while rows were recorded, and afterwards, when parts are joined and the report drawn:
    the last new part is between them. Before the first part the run is loaded, and on a first start
    compiled, which is neither.
    """
    grown = [k for k in range(1, len(parts)) if parts[k] > parts[k - 1]]
    first, last = (grown[0], grown[-1] + 1) if grown else (0, len(held_mb))
    return list(held_mb[first:last]), list(held_mb[last:])


def _files(folder: Path) -> int:
    """How many there are, 0 where it is no folder."""
    try:
        with os.scandir(folder) as entries:
            return sum(1 for _ in entries)
    except (FileNotFoundError, NotADirectoryError):
        return 0


def growth_mb(samples: Sequence[float]) -> float:
    """Highest sample, one a second, after the warm-up above the highest in it; 0 where there is
    none after it.
    """
    first = max(int(len(samples) * WARM_UP), LEAST_S)
    built = max(samples[:first])
    return max(samples[first:], default=built) - built


def _memory_mb(process: int) -> float:
    """What a process holds in memory now; 0 where it has ended."""
    try:
        lines = Path(f"/proc/{process}/status").read_text().splitlines()
    except OSError:
        return 0.0
    return next((int(line.split()[1]) / 1024 for line in lines if line.startswith("VmRSS")), 0.0)
