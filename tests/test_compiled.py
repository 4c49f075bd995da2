"""The cache of compiled kernels: what makes a kernel another, what does not, and how much is kept."""

from __future__ import annotations

import importlib.util
import os
import subprocess
import sys
import time
from pathlib import Path
from types import ModuleType

import pytest

from testbed import compiled

SOURCE = '''
from testbed.compiled import njit

FACTOR = 2.0

@njit
def inner(x):
    return FACTOR * x

@njit
def outer(x):
    """Says something."""
    return inner(x) + 1.0

@njit
def other(x):
    return x - 1.0
'''


def _module(folder: Path, source: str, name: str = "kernels_of_a_test") -> ModuleType:
    path = folder / f"{name}.py"
    path.write_text(source)
    spec = importlib.util.spec_from_file_location(name, path)
    assert spec is not None and spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    exec(
        compile(source, str(path), "exec"), module.__dict__
    )  # not through Python's cache of bytecode
    return module


def _digests(folder: Path, source: str) -> tuple[str, str]:
    module = _module(folder, source)
    return compiled.digest_of(module.outer), compiled.digest_of(module.other)


@pytest.mark.parametrize(
    ("before", "after"),
    [
        ("FACTOR = 2.0", "FACTOR = 3.0"),
        ("FACTOR * x", "FACTOR * x * x"),
        ("+ 1.0", "+ 1.5"),
        ("@njit\ndef inner", "@njit(fastmath=True)\ndef inner"),
        ("@njit\ndef inner", "@njit(apart=True)\ndef inner"),
    ],
)
def test_a_kernel_changes_with_its_callees_constants_and_options_and_no_other_does(
    tmp_path: Path, before: str, after: str
) -> None:
    outer, other = _digests(tmp_path, SOURCE)
    changed_outer, changed_other = _digests(tmp_path, SOURCE.replace(before, after))
    assert changed_outer != outer
    assert changed_other == other


def test_comments_docstrings_and_places_do_not_change_a_kernel(tmp_path: Path) -> None:
    moved = "# a remark\n\n" + SOURCE.replace("Says something.", "Says something else.")
    (tmp_path / "elsewhere").mkdir()
    assert _digests(tmp_path / "elsewhere", moved) == _digests(tmp_path, SOURCE)


def test_a_kernel_in_another_module_is_another(tmp_path: Path) -> None:
    here, there = (_module(tmp_path, SOURCE, name) for name in ("kernels_here", "kernels_there"))
    assert compiled.digest_of(here.outer) != compiled.digest_of(there.outer)
    there.inner = here.inner  # a callee that has moved
    moved = compiled.digest_of(there.outer)
    there.inner = _module(tmp_path, SOURCE, "kernels_there").inner
    assert compiled.digest_of(there.outer) != moved


def test_what_cannot_be_told_apart_is_refused(tmp_path: Path) -> None:
    module = _module(tmp_path, SOURCE.replace("FACTOR = 2.0", "FACTOR = object()"))
    with pytest.raises(TypeError, match="object"):
        compiled.digest_of(module.outer)


def test_every_process_finds_the_same_digest() -> None:
    from testbed.world.between import between_steps

    code = (
        "from testbed.compiled import digest_of; from testbed.world.between import between_steps; "
        "print(digest_of(between_steps))"
    )
    out = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    started = time.perf_counter()
    assert compiled.digest_of(between_steps) == out.stdout.strip()
    assert time.perf_counter() - started < 0.5


def test_a_kernel_is_loaded_not_compiled_again_and_old_versions_go(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "cache"))
    monkeypatch.setattr(compiled, "KEPT_VERSIONS", 2)
    folder = tmp_path / "cache" / "roboclimber-testbed" / "kernels" / "kernels_of_a_test.other"
    for k, step in enumerate(("1.0", "2.0", "3.0")):
        other = _module(tmp_path, SOURCE.replace("x - 1.0", f"x - {step}")).other
        assert other(5.0) == 5.0 - float(step)
        assert sum(other.stats.cache_misses.values()) == 1
        for path in folder.glob(f"*{compiled.digest_of(other)}*"):
            os.utime(path, (1e9 + k, 1e9 + k))
    assert len(list(folder.glob("*.nbi"))) == len(list(folder.glob("*.nbc"))) == 2
    again = _module(tmp_path, SOURCE.replace("x - 1.0", "x - 3.0")).other
    assert again(5.0) == 2.0
    assert sum(again.stats.cache_hits.values()) == 1
    monkeypatch.setattr(compiled, "KEPT_BYTES", 0)
    assert _module(tmp_path, SOURCE).other(1.0) == 0.0
    assert not list(folder.glob("*.nbc"))


APART = """
from testbed.compiled import njit

@njit
def part(x):
    if x < 0.0:
        raise ValueError("below zero")
    if x == 0.0:
        raise ZeroDivisionError("division by zero")
    return 1.0 / x

@njit(apart=True)
def far(x):
    return part(x) + 1.0

@njit
def whole(x):
    return far(x) + part(x)
"""
USE = """
import sys
sys.path.insert(0, sys.argv[1])
import kernels_apart as k
found = [k.whole(2.0)]
for wrong in (0.0, -1.0):
    try:
        k.whole(wrong)
    except (ZeroDivisionError, ValueError) as error:
        found.append(str(error))
found.append(k.part(2.0))
print(found, *(sum(f.stats.cache_misses.values()) for f in (k.whole, k.far, k.part)))
"""


def _use(folder: Path) -> str:
    environment = os.environ | {"XDG_CACHE_HOME": str(folder / "cache")}
    command = [sys.executable, "-c", USE, str(folder)]
    return subprocess.run(
        command, env=environment, capture_output=True, text=True, check=True
    ).stdout.strip()


def test_a_caller_finds_the_code_of_a_kernel_apart_in_every_process_also_if_it_was_compiled_anew(
    tmp_path: Path,
) -> None:
    (tmp_path / "kernels_apart.py").write_text(APART)
    found = "[2.0, 'division by zero', 'below zero', 0.5]"
    assert _use(tmp_path) == f"{found} 1 1 1"
    assert _use(tmp_path) == f"{found} 0 0 0"
    for path in (
        tmp_path / "cache" / "roboclimber-testbed" / "kernels" / "kernels_apart.far"
    ).iterdir():
        path.unlink()
    assert _use(tmp_path) == f"{found} 0 1 0"


def test_a_kernel_that_only_kernels_call_is_not_stored(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "cache"))
    module = _module(tmp_path, SOURCE)
    assert module.outer(1.0) == 3.0
    stored = [p.name for p in (tmp_path / "cache" / "roboclimber-testbed" / "kernels").iterdir()]
    assert stored == ["kernels_of_a_test.outer"]
    assert not module.inner.signatures


def test_a_home_that_cannot_be_written_to_only_costs_time(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    (tmp_path / "file").write_text("")
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "file"))
    assert _module(tmp_path, SOURCE).other(5.0) == 4.0
