"""Functions compiled by numba, cached on disk in a folder for each state of the sources that they
are made of.

numba looks only at the file of the function that it loads: one that calls a function of another
file would go on running the old callee after that file changed. So the folder's name is a digest of
the function's file and of all files of the package that it imports, directly or through others. A
change of a law compiles what uses the law; a change of a page or of a command compiles nothing.
"""

from __future__ import annotations

import hashlib
import os
import re
import shutil
import stat
import sys
import tempfile
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from functools import cache, lru_cache
from pathlib import Path
from types import FunctionType
from typing import Any, TypeVar, overload

import numba

F = TypeVar("F", bound=Callable[..., Any])

PACKAGE = Path(__file__).parent
KEPT_DAYS = 30
"""Folders that were not used for so long are removed."""
LEAST_FREE = 100_000_000
"""Bytes that must be free where the cache is; numba falls over on a disk that fills up."""
_SECONDS_A_DAY = 86400.0
_IMPORT = re.compile(
    r"^(?:from (testbed[\w.]*) import (\([^)]*\)|.+)|import (testbed[\w.]*))", re.MULTILINE
)
"""An import at a module's head: only its names are seen by the module's functions."""


def caches() -> Path:
    """Where the folders of all states of the sources are: below the user's cache, or where nobody
    may write there, in a folder of the user's own among temporary files.
    """
    home = Path(os.environ.get("XDG_CACHE_HOME") or Path.home() / ".cache")
    usual = home / "roboclimber-testbed" / "compiled"
    if _takes_files(usual):
        return usual
    own = Path(tempfile.gettempdir()) / f"roboclimber-testbed-{os.getuid()}"
    return own if _is_private(own) else usual


def _takes_files(folder: Path) -> bool:
    with suppress(OSError):
        folder.mkdir(parents=True, exist_ok=True)
        return os.access(folder, os.W_OK)
    return False


def _is_private(folder: Path) -> bool:
    """Whether nobody else can have put code into it, for what lies in a cache is run."""
    with suppress(OSError):
        folder.mkdir(mode=stat.S_IRWXU, exist_ok=True)
        found = folder.lstat()
        shut = stat.S_IMODE(found.st_mode) & (stat.S_IRWXG | stat.S_IRWXO) == 0
        return stat.S_ISDIR(found.st_mode) and found.st_uid == os.getuid() and shut
    return False


def _file_of(module: str) -> Path | None:
    """File of a module of the package; None for a name that is none (a function, a class)."""
    place = PACKAGE.parent.joinpath(*module.split("."))
    for path in (place.with_suffix(".py"), place / "__init__.py"):
        if path.is_file():
            return path
    return None


@cache
def text_of(path: Path) -> str:
    """A source, as it was when it was first asked for."""
    return path.read_text(encoding="utf-8")


@cache
def imported_by(path: Path) -> frozenset[Path]:
    """Files of the package that a file imports at its head."""
    found = set()
    for origin, names, whole in _IMPORT.findall(text_of(path)):
        modules = [whole or origin, *(f"{origin}.{name}" for name in re.findall(r"\w+", names))]
        found |= {file for file in map(_file_of, modules) if file is not None}
    return frozenset(found)


@cache
def sources_of(path: Path) -> frozenset[Path]:
    """A file and all files of the package that it imports, directly or through others."""
    found, open_ends = {path}, [path]
    while open_ends:
        new = imported_by(open_ends.pop()) - found
        found |= new
        open_ends += new
    return frozenset(found)


@cache
def digest_of_sources(*paths: Path) -> str:
    """Digest (hexadecimal) of Python's and numba's versions and of all that these files are made
    of.
    """
    digest = hashlib.sha256(f"{sys.version_info[:2]} {numba.__version__}".encode())
    for path in sorted(frozenset[Path]().union(*(sources_of(path) for path in paths))):
        digest.update(f"{path}\0".encode() + text_of(path).encode())
    return digest.hexdigest()[:24]


@cache
def cache_folder(*paths: Path) -> Path | None:
    """Folder for functions made of these files, made if need be; None where there can be none."""
    if not all(path.is_file() for path in paths):
        return None  # typed at a prompt
    folder = caches() / digest_of_sources(*paths)
    try:
        folder.mkdir(parents=True, exist_ok=True)
        os.utime(folder)
        if shutil.disk_usage(folder).free < LEAST_FREE:
            return None
    except OSError:
        return None  # every start then compiles what it needs
    prune()
    return folder


@lru_cache(maxsize=1)
def prune() -> None:
    """Remove, once a process, the folders that were not used for KEPT_DAYS."""
    oldest = time.time() - KEPT_DAYS * _SECONDS_A_DAY
    with suppress(OSError):  # another process prunes too
        for folder in caches().iterdir():
            if folder.stat().st_mtime < oldest:
                shutil.rmtree(folder, ignore_errors=True)


def _path_of(function: Any) -> Path:
    return Path(function.__code__.co_filename)


def is_cached(function: Any) -> bool:
    """Whether a compiled function is in the cache, for any types; so too where nothing is
    compiled.
    """
    if numba.config.DISABLE_JIT:
        return True
    folder = cache_folder(_path_of(function.py_func))
    name = function.py_func.__name__
    return folder is not None and any(folder.rglob(f"*.{name}-*.nbc"))


def can_cache(function: Any) -> bool:
    """Whether what is compiled of a function can be kept for the next start."""
    return cache_folder(_path_of(function.py_func)) is not None


@contextmanager
def _own_cache(folder: Path) -> Iterator[None]:
    """Numba chooses a function's cache while it is decorated; those of other packages stay where
    they were.
    """
    usual = numba.config.CACHE_DIR
    numba.config.CACHE_DIR = str(folder)
    try:
        yield
    finally:
        numba.config.CACHE_DIR = usual


@overload
def njit(function: F, *, made_of: tuple[Path, ...] = (), **options: Any) -> F: ...


@overload
def njit(*, made_of: tuple[Path, ...] = (), **options: Any) -> Callable[[F], F]: ...


def njit(function: Any = None, *, made_of: tuple[Path, ...] = (), **options: Any) -> Any:
    """`numba.njit` with this cache, as `@njit` or `@njit(...)`; `made_of`: files it depends on
    besides its own.

    A division by zero gives inf or nan, as NumPy's does: a run looks for these, and no division is
    looked at twice.
    """
    if function is None:
        return lambda f: njit(f, made_of=made_of, **options)
    folder = cache_folder(_path_of(function), *made_of)
    options = {"error_model": "numpy"} | options
    if folder is None:
        return numba.njit(**options)(function)
    with _own_cache(folder):
        return numba.njit(cache=True, **options)(function)


def njit_over(loop: Any, step: Any) -> Any:
    """`loop` compiled, in which the global name `step` stands for the compiled function `step`.

    A closure would do, but numba takes each process's closures for new ones and compiles them at
    every start.
    """
    names = loop.__globals__ | {"step": step}
    bound = FunctionType(loop.__code__, names, loop.__name__)
    name = f"{loop.__name__}_{step.__module__}_{step.__name__}"
    bound.__qualname__ = name.replace(".", "_")  # its files' names
    return njit(bound, made_of=(_path_of(getattr(step, "py_func", step)),))


@njit
def fill(out: Any, values: Any) -> None:
    """out[:] = values, one dimension.

    An array assignment costs its caller a second of compilation: its error message is made by
    functions of its own.
    """
    for index in range(out.shape[0]):
        out[index] = values[index]


# How the laws of the hydraulics are compiled.

FAST = frozenset({"contract", "arcp", "nsz"})
"""Fused multiply-add, reciprocals, no care for the sign of zero: nothing that lets NaN or infinity
get lost.
"""


@overload
def njit_law(function: F, **options: Any) -> F: ...


@overload
def njit_law(**options: Any) -> Callable[[F], F]: ...


def njit_law(function: Any = None, **options: Any) -> Any:
    """`njit` for a law: arithmetic as FAST allows."""
    return njit(function, fastmath=set(FAST), **options)
