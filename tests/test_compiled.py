"""The cache of compiled functions: when it is another, that it is found again, and how much is kept."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

import pytest

from testbed import compiled

USE = """
from testbed import compiled
from testbed.estimation.filters import kbf, persistent
import numpy as np
constants = dict(process_variance=1.0, measurement_variance=1.0)
x = kbf.run(np.ones(9), **constants)
again = persistent.run(np.ones(9), **constants, innovation_limit=300.0, hold_samples=10.0)
loops = [f.__closure__ for f in (kbf.run, persistent.run)]
loops = [c.cell_contents for cells in loops for c in cells if hasattr(c.cell_contents, "stats")]
print(float(x[-1]), float(again[-1]), *(sum(loop.stats.cache_hits.values()) for loop in loops))
"""


def _use(home: Path) -> list[str]:
    environment = os.environ | {"XDG_CACHE_HOME": str(home)}
    command = [sys.executable, "-c", USE]
    done = subprocess.run(command, env=environment, capture_output=True, text=True, check=True)
    return done.stdout.split()


def test_a_second_process_loads_what_the_first_compiled_each_loop_its_own(tmp_path: Path) -> None:
    first, second = _use(tmp_path), _use(tmp_path)
    assert first[:2] == second[:2]
    assert first[2:] == ["0", "0"] and second[2:] == ["1", "1"]


def test_a_home_that_cannot_be_written_to_only_costs_time(tmp_path: Path) -> None:
    (tmp_path / "file").write_text("")
    assert _use(tmp_path / "file")[2:] == ["0", "0"]


@pytest.fixture
def sources(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A package of two rooms, in place of the testbed's."""
    for room in ("laws", "report"):
        (tmp_path / "package" / room).mkdir(parents=True)
        (tmp_path / "package" / room / "a.py").write_text("X = 1\n")
    monkeypatch.setattr(compiled, "PACKAGE", tmp_path / "package")
    return tmp_path / "package"


def _digest() -> str:
    return compiled.digest_of_sources.__wrapped__()


def test_the_cache_is_another_when_a_source_of_compiled_code_is(sources: Path) -> None:
    before = _digest()
    assert _digest() == before
    (sources / "report" / "a.py").write_text("X = 2\n")
    assert _digest() == before
    (sources / "laws" / "a.py").write_text("X = 2\n")
    assert _digest() != before


def test_rooms_left_out_of_the_digest_compile_nothing_and_feed_nothing_compiled() -> None:
    for path in compiled.PACKAGE.rglob("*.py"):
        room, text = path.relative_to(compiled.PACKAGE).parts[0], path.read_text()
        if room in compiled.WITHOUT:
            assert "testbed.compiled" not in text, path
        elif "from testbed.compiled import" in text:
            head = text.split("\ndef ", 1)[0]
            fed = [r for r in compiled.WITHOUT if f"from testbed.{r}" in head]
            assert not fed or "benchmarks" in path.parts, (path, fed)


def test_the_folders_used_last_are_kept(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(compiled, "caches", lambda: tmp_path)
    for k in range(compiled.KEPT + 2):
        (tmp_path / f"{k}").mkdir()
        os.utime(tmp_path / f"{k}", (1e9 + k, 1e9 + k))
    compiled.prune()
    assert {path.name for path in tmp_path.iterdir()} == {
        str(k) for k in range(2, compiled.KEPT + 2)
    }


def test_caches_of_others_stay_where_they_were() -> None:
    import numba

    usual = numba.config.CACHE_DIR
    compiled.njit(lambda x: x)
    assert usual == numba.config.CACHE_DIR


def test_a_division_by_zero_is_infinite() -> None:
    @compiled.njit
    def ratio(a: float, b: float) -> float:
        return a / b

    assert ratio(1.0, 0.0) == float("inf")
