"""Speed figures that need a process of their own."""

from __future__ import annotations

import json
import subprocess
import sys
import time
from pathlib import Path

_FRESH = """
import json, sys, time
start = float(sys.argv[1])
from testbed.scenario.scenario import load_scenario
from testbed.world.simulation import Simulation
world = Simulation(load_scenario("drill_slope_45", duration=10.0))
world.run_block(1)
first = time.time() - start
for _ in range(2):
    world.run_block(1000)
from testbed.benchmarks.speed.parts import peak_memory_mb
print(json.dumps([first, peak_memory_mb()]))
"""


def peak_memory_mb() -> float:
    """Most memory that this process has held, MB.

    Not ru_maxrss where it can be helped: Linux hands a parent's peak on to the process that it
    starts.
    """
    try:
        status = Path("/proc/self/status").read_text()
        return float(status.partition("VmHWM:")[2].split()[0]) / 1024.0
    except (OSError, IndexError):
        import resource

        peak = float(resource.getrusage(resource.RUSAGE_SELF).ru_maxrss)
        return peak / (2.0**20 if sys.platform == "darwin" else 1024.0)


def fresh_process() -> dict[str, float]:
    """Seconds from the start of a process to its first step (kernels cached) and its peak memory
    after 2 s, MB.
    """
    out = subprocess.run(
        [sys.executable, "-c", _FRESH, repr(time.time())],
        capture_output=True,
        text=True,
        check=True,
    ).stdout
    first, memory = json.loads(out.strip().splitlines()[-1])
    return {"first_step_s": first, "memory_mb": memory}
