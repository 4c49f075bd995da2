"""Compiled kernels, cached on disk under a name that changes with the sources.

numba looks only at the file of the function it loads: a kernel that calls one of another file would go on running the
old callee after that file changed. Here the cache folder carries a digest of all sources that hold kernels or the
constants that they compile in.
"""

from __future__ import annotations

import hashlib
import os
import shutil
from collections.abc import Callable
from functools import lru_cache
from pathlib import Path
from typing import Any

import numba

_PACKAGE = Path(__file__).resolve().parent
CONSTANTS = ("laws/columns.py", "world/board.py", "parameters/names.py")
"""Files without a kernel whose numbers are compiled into kernels."""
KEPT = 24
"""Caches of this many versions of the sources are kept."""


@lru_cache(maxsize=1)
def cache_folder() -> str:
    """Folder of this version's compiled kernels, or "" (numba's own choice) where it cannot be made."""
    digest = hashlib.sha256(numba.__version__.encode())
    for path in sorted(_PACKAGE.rglob("*.py")):
        name, text = path.relative_to(_PACKAGE).as_posix(), path.read_bytes()
        if b"njit" in text or name in CONSTANTS:
            digest.update(name.encode() + b"\0" + text)
    base = Path(os.environ.get("XDG_CACHE_HOME") or Path.home() / ".cache") / "roboclimber-testbed"
    folder = base / digest.hexdigest()[:16]
    try:
        folder.mkdir(parents=True, exist_ok=True)
        os.utime(folder)
        versions = sorted((p for p in base.iterdir() if p.is_dir()), key=lambda p: p.stat().st_mtime)
        for old in versions[:-KEPT]:
            shutil.rmtree(old, ignore_errors=True)
    except OSError:
        return ""
    return str(folder)


def njit(function: Callable[..., Any] | None = None, **options: Any) -> Any:
    """numba.njit with the testbed's cache; use as `@njit` or `@njit(...)`."""
    if function is None:
        return lambda f: njit(f, **options)
    options.setdefault("cache", True)
    before = numba.config.CACHE_DIR
    numba.config.CACHE_DIR = cache_folder() or before
    try:
        return numba.njit(**options)(function)
    finally:
        numba.config.CACHE_DIR = before
