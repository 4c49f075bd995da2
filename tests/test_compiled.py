"""The cache of compiled functions: when it is another, that it is found again, and how much is
kept.
"""

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
    temporary = home.with_name("temporary")
    temporary.mkdir(exist_ok=True)
    environment = os.environ | {"XDG_CACHE_HOME": str(home), "TMPDIR": str(temporary)}
    command = [sys.executable, "-c", USE]
    done = subprocess.run(command, env=environment, capture_output=True, text=True, check=True)
    return done.stdout.split()


@pytest.mark.slow
def test_a_second_process_loads_what_the_first_compiled_each_loop_its_own(tmp_path: Path) -> None:
    first, second = _use(tmp_path), _use(tmp_path)
    assert first[:2] == second[:2]
    assert first[2:] == ["0", "0"] and second[2:] == ["1", "1"]


@pytest.mark.slow
def test_where_the_home_cannot_be_written_to_temporary_files_serve(tmp_path: Path) -> None:
    (tmp_path / "file").write_text("")
    assert _use(tmp_path / "file")[2:] == ["0", "0"]
    assert _use(tmp_path / "file")[2:] == ["1", "1"]


@pytest.mark.parametrize("spoilt", ["open to others", "a link", "a file"])
def test_a_temporary_folder_that_others_may_have_filled_is_not_used(
    spoilt: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    (tmp_path / "file").write_text("")
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "file"))
    monkeypatch.setattr("tempfile.tempdir", str(tmp_path))
    own = tmp_path / f"roboclimber-testbed-{os.getuid()}"
    assert compiled.caches() == own
    own.rmdir()
    if spoilt == "a file":
        own.write_text("")
    elif spoilt == "a link":
        (tmp_path / "theirs").mkdir()
        own.symlink_to(tmp_path / "theirs")
    else:
        own.mkdir()
        own.chmod(0o777)
    assert compiled.caches() != own
    assert compiled.cache_folder.__wrapped__(Path(__file__)) is None


def test_a_home_on_a_full_disk_only_costs_time(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    class Usage:
        free = compiled.LEAST_FREE - 1

    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path))
    here = (Path(__file__), Path(compiled.__file__))  # asked for by nobody else
    with monkeypatch.context() as patch:
        patch.setattr("shutil.disk_usage", lambda _: Usage)
        assert compiled.cache_folder(*here) is None
    compiled.cache_folder.cache_clear()
    assert compiled.cache_folder(*here) is not None
    compiled.cache_folder.cache_clear()


@pytest.fixture
def package(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A package in place of the testbed's: a step that uses a law through a seal's, and a page."""
    folder = tmp_path / "testbed"
    files = {
        "laws/seal.py": "X = 1\n",
        "laws/law.py": "from testbed.laws import (\n    seal,\n)\n",
        "world/step.py": "from testbed.laws.law import force\n",
        "page.py": "import testbed.world.step\n",
    }
    for name, text in files.items():
        (folder / name).parent.mkdir(parents=True, exist_ok=True)
        (folder / name).write_text(text)
    monkeypatch.setattr(compiled, "PACKAGE", folder)
    names = (compiled.text_of, compiled.imported_by, compiled.sources_of)
    for remembered in (*names, compiled.digest_of_sources):
        monkeypatch.setattr(compiled, remembered.__name__, remembered.__wrapped__)
    return folder


def test_a_change_of_a_source_is_another_cache_for_all_that_is_made_of_it(package: Path) -> None:
    def digests() -> list[str]:
        names = ("laws/seal.py", "world/step.py", "page.py")
        return [compiled.digest_of_sources(package / name) for name in names]

    before = digests()
    assert digests() == before
    (package / "laws" / "seal.py").write_text("X = 2\n")
    assert all(new != old for new, old in zip(digests(), before, strict=True))


def test_a_change_of_what_it_does_not_import_compiles_nothing(package: Path) -> None:
    step = package / "world" / "step.py"
    before = compiled.digest_of_sources(step)
    (package / "page.py").write_text("import testbed.world.step\nX = 2\n")
    assert compiled.digest_of_sources(step) == before
    assert compiled.digest_of_sources(step, package / "page.py") != before


def test_what_a_compiled_function_is_made_of_is_all_that_its_module_imports() -> None:
    """The text's imports against those that Python made, for the loop's heaviest module."""
    from testbed.world import compiled_step

    found = compiled.sources_of(Path(compiled_step.__file__))
    for name, value in vars(compiled_step).items():
        owner = sys.modules.get(getattr(value, "__module__", None) or "")
        if owner is not None and owner.__name__.startswith("testbed."):
            assert Path(owner.__file__ or "") in found, name


def test_folders_that_nobody_uses_any_more_are_removed(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(compiled, "caches", lambda: tmp_path)
    (tmp_path / "old").mkdir()
    (tmp_path / "new").mkdir()
    os.utime(tmp_path / "old", (1e9, 1e9))
    compiled.prune.__wrapped__()
    assert [path.name for path in tmp_path.iterdir()] == ["new"]


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
