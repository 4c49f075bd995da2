"""`testbed soak`: the trials of every kind, and a table of how they ended."""

from __future__ import annotations

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
from testbed.benchmarks.soak import adversity, killed, spoilt
from testbed.benchmarks.soak.endurance import GROWTH_MB, drilled
from testbed.benchmarks.soak.sandbox import Judged, forked
from testbed.envs import ENVIRONMENTS, make
from testbed.errors import InputError
from testbed.report.page import Table

# Environments that take random actions: what they show stays finite and in its bounds.

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
    "scenario": (spoilt.spoilt_scenario, 1.0),
    "recording": (spoilt.spoilt_recording, 1.0),
    "model": (spoilt.spoilt_model, 1.0),
    "sweep": (spoilt.spoilt_sweep, 1.0),
    "machine": (spoilt.spoilt_machine, 1.0),
    "killed run": (killed.killed_run, 0.015),
    "killed sweep": (killed.killed_sweep, 0.012),
    "killed benchmark": (killed.killed_benchmark, 0.012),
    "killed training": (killed.killed_training, 0.008),
    "killed commissioning": (killed.killed_commissioning, 0.003),
    "full disk": (adversity.full_disk, 0.05),
    "read-only disk": (adversity.read_only_disk, 0.02),
    "jumping clock": (adversity.jumping_clock, 0.01),
    "two owners": (adversity.two_owners, 0.02),
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
            if kind not in kinds:
                raise InputError(
                    "no such kind", field="--only", value=kind, allowed=", ".join(kinds)
                )

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
