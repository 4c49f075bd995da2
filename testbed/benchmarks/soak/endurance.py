"""Hours of simulated drilling in one run: how its memory grows.

The run is a process of its own, by the command that everybody uses; what it holds is read from the
operating system once a second.
"""

from __future__ import annotations

import os
import subprocess
import sys
import time
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from testbed.formats.yaml_files import yaml_text

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
