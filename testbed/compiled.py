"""Functions compiled by numba, cached on disk in a folder for each state of the package's sources.

numba looks only at the file of the function that it loads: one that calls a function of another file would go on
running the old callee after that file changed. So the folder's name is a digest of all sources that a compiled function
may be made of. A change of one of them compiles everything anew, once.
"""

from __future__ import annotations

import hashlib
import os
import shutil
import sys
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from functools import lru_cache
from pathlib import Path
from types import FunctionType
from typing import Any

import numba

PACKAGE = Path(__file__).parent
WITHOUT = frozenset({"simulation", "report", "workflows", "cli", "data"})
"""Rooms that hold nothing compiled and nothing that is compiled in; a change there compiles nothing."""
KEPT = 8
"""Folders that are kept, those used last."""


def caches() -> Path:
    """Where the folders of all states of the sources are."""
    home = Path(os.environ.get("XDG_CACHE_HOME") or Path.home() / ".cache")
    return home / "roboclimber-testbed" / "compiled"


@lru_cache(maxsize=1)
def digest_of_sources() -> str:
    """Digest (hexadecimal) of Python's and numba's versions and of the sources."""
    digest = hashlib.sha256(f"{sys.version_info[:2]} {numba.__version__}".encode())
    for path in sorted(PACKAGE.rglob("*.py")):
        place = path.relative_to(PACKAGE)
        if place.parts[0] not in WITHOUT:
            digest.update(f"{place.as_posix()}\0".encode() + path.read_bytes())
    return digest.hexdigest()[:24]


@lru_cache(maxsize=1)
def cache_folder() -> Path | None:
    """This state's folder, made if need be, older ones pruned; None where there can be none."""
    folder = caches() / digest_of_sources()
    try:
        folder.mkdir(parents=True, exist_ok=True)
        os.utime(folder)
    except OSError:
        return None  # every start then compiles what it needs
    prune()
    return folder


def prune() -> None:
    """Remove all folders but the KEPT that were used last."""
    with suppress(OSError):  # another process prunes too
        for old in sorted(caches().iterdir(), key=lambda path: path.stat().st_mtime)[:-KEPT]:
            shutil.rmtree(old, ignore_errors=True)


def is_cached(function: Any) -> bool:
    """Whether a compiled function is in the cache, for any types; so too where nothing is compiled."""
    if numba.config.DISABLE_JIT:
        return True
    folder = cache_folder()
    name = function.py_func.__name__
    return folder is not None and any(folder.rglob(f"*.{name}-*.nbc"))


@contextmanager
def _own_cache(folder: Path) -> Iterator[None]:
    """Numba chooses a function's cache while it is decorated; those of other packages stay where they were."""
    usual = numba.config.CACHE_DIR
    numba.config.CACHE_DIR = str(folder)
    try:
        yield
    finally:
        numba.config.CACHE_DIR = usual


def njit(function: Any = None, **options: Any) -> Any:
    """`numba.njit` with this cache, as `@njit` or `@njit(...)`.

    A division by zero gives inf or nan, as NumPy's does: a run looks for these, and no division is looked at twice.
    """
    if function is None:
        return lambda f: njit(f, **options)
    folder = cache_folder()
    options = {"error_model": "numpy"} | options
    if folder is None:
        return numba.njit(**options)(function)
    with _own_cache(folder):
        return numba.njit(cache=True, **options)(function)


def njit_over(loop: Any, step: Any) -> Any:
    """`loop` compiled, in which the global name `step` stands for the compiled function `step`.

    A closure would do, but numba takes each process's closures for new ones and compiles them at every start.
    """
    names = loop.__globals__ | {"step": step}
    bound = FunctionType(loop.__code__, names, loop.__name__)
    bound.__qualname__ = f"{loop.__name__}_{step.__module__}".replace(".", "_")  # its files' names
    return njit(bound)


@njit
def fill(out: Any, values: Any) -> None:
    """out[:] = values, one dimension.

    An array assignment costs its caller a second of compilation: its error message is made by functions of its own.
    """
    for k in range(out.shape[0]):
        out[k] = values[k]
