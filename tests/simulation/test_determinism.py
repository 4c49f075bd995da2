"""The same scenario and seed give the same bits with any number of cores and threads, and after a
save and a restore; docs/limits.md says so.
"""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

import pytest

import testbed
from testbed.scenario.scenario import load_scenario

DIGEST = """
import hashlib, os, sys
import numpy as np
if sys.argv[1] == "one core":
    os.sched_setaffinity(0, {min(os.sched_getaffinity(0))})
from testbed.recording.robot import read_robot
from testbed.scenario.scenario import load_scenario
from testbed.simulation.live_run import simulate
from testbed.workflows.estimate import estimate_file
digest = hashlib.sha256()
for name in ("drill_slope_45", "crawl_slope_45"):
    out = f"{sys.argv[2]}/{name}"
    with simulate(load_scenario(name, duration=0.3), out=out) as run:
        run.step(300)
    for series in ("data", "truth"):
        digest.update(open(f"{out}/{series}.parquet", "rb").read())
from pathlib import Path
estimate_file(Path(out), None, Path(out).with_suffix(".csv"), False, None)
digest.update(Path(out).with_suffix(".csv").read_bytes())
print(digest.hexdigest())
"""
THREADS = ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS", "NUMBA_NUM_THREADS")


def _digest(folder: Path, cores: str, threads: str) -> str:
    folder.mkdir()
    told = os.environ | dict.fromkeys(THREADS, threads) | {"ARROW_NUM_THREADS": threads}
    done = subprocess.run(
        [sys.executable, "-c", DIGEST, cores, str(folder)],
        env=told,
        capture_output=True,
        text=True,
        check=True,
    )
    return done.stdout


@pytest.mark.slow
def test_the_number_of_cores_and_threads_changes_no_bit(tmp_path: Path) -> None:
    """Two runs and an estimate over a recording: on one core with one thread, on all with four."""
    one = _digest(tmp_path / "one", "one core", "1")
    assert len(one) == 65
    assert _digest(tmp_path / "four", "all cores", "4") == one


@pytest.mark.slow
def test_a_save_and_a_restore_change_no_bit_of_what_is_recorded(tmp_path: Path) -> None:
    """Every field of the rows that come after it; twelve scenarios are in test_saved."""
    scenario = load_scenario("drill_slope_45", duration=0.3)
    with testbed.simulate(scenario) as run:
        run.step(150)
        state = run.save().write(tmp_path / "state.npz")
        run.step(150)
        whole = run.rows.as_recorded(), run.truth.as_recorded()
    with testbed.simulate(scenario) as again:
        again.restore(state)
        again.step(150)
        part = again.rows.as_recorded(), again.truth.as_recorded()
    for kept, found in zip(whole, part, strict=True):
        for name, values in found.items():
            assert len(values) == 150 and values.tobytes() == kept[name][150:].tobytes(), name


def test_the_page_of_limits_says_what_is_the_same_where() -> None:
    page = (Path(__file__).parents[2] / "docs" / "limits.md").read_text()
    for words in ("## Same bits", "any number of cores and threads", "1 %"):
        assert words in page
