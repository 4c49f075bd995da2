"""Compiled kernels, cached on disk under a digest of what each is made of.

numba looks only at the file of the function it loads: a kernel that calls one of another file would go on running the
old callee after that file changed, and a changed comment would compile everything anew. Here a kernel's digest is that
of its bytecode, its options, and whatever its names stand for: the kernels it calls, the constants it compiles in. It
is taken when the kernel is first needed, so that starting costs nothing; an edit compiles just the kernels that it
changes, and two checkouts of the same sources share one cache.
"""

from __future__ import annotations

import hashlib
import os
import sys
from collections.abc import Iterator
from contextlib import suppress
from functools import cached_property, lru_cache
from pathlib import Path
from pickle import UnpicklingError
from types import BuiltinFunctionType, CodeType, FunctionType, ModuleType
from typing import Any

import llvmlite.binding as llvm
import numba
import numpy as np
from numba.core.caching import CompileResultCacheImpl, FunctionCache, NullCache, _CacheLocator
from numba.core.dispatcher import Dispatcher
from numba.core.runtime import _nrt_python as runtime

from testbed.kernel import Kernel

OPTIONS = {"nopython": True, "no_cfunc_wrapper": True, "error_model": "numpy"}
"""A division by zero gives inf or nan, as NumPy's does: a run looks for these, and no division is looked at twice."""
KEPT_VERSIONS = 8
"""Versions of one kernel that are kept."""
KEPT_BYTES = 400_000_000
"""Size of the whole cache above which the kernels not used for longest are removed."""


def cache_folder() -> Path:
    """Folder of the compiled kernels, one subfolder a kernel; it need not exist yet."""
    return (
        Path(os.environ.get("XDG_CACHE_HOME") or Path.home() / ".cache")
        / "roboclimber-testbed"
        / "kernels"
    )


def _names(code: CodeType) -> Iterator[str]:
    """Names that a function and the functions inside it look up."""
    yield from code.co_names
    for constant in code.co_consts:
        if isinstance(constant, CodeType):
            yield from _names(constant)


def _described_code(code: CodeType, docstring: str | None) -> Iterator[str]:
    """What a code object does, without its place in the file and its docstring."""
    yield f"{code.co_code!r} {code.co_exceptiontable!r} {code.co_names} {code.co_varnames} {code.co_freevars}"
    constants = (
        code.co_consts[1:]
        if docstring is not None and code.co_consts[:1] == (docstring,)
        else code.co_consts
    )
    for constant in constants:
        if isinstance(constant, CodeType):
            yield from _described_code(constant, None)
        else:
            yield from _described(constant, {})


def _described(value: Any, seen: dict[int, str]) -> Iterator[str]:
    """Text that changes with a value a kernel refers to. Raises TypeError for a kind it cannot tell apart."""
    if isinstance(value, Dispatcher):
        yield f"apart {getattr(value, 'apart', None)}"
        for option in sorted(value.targetoptions):
            yield from (option, *_described(value.targetoptions[option], seen))
        yield from _described_function(value.py_func, seen)
    elif value is None or isinstance(
        value, (bool, int, float, complex, str, bytes, slice, np.generic, np.dtype)
    ):
        yield repr(value)
    elif isinstance(value, (set, frozenset)):
        yield repr(sorted(map(repr, value)))
    elif isinstance(value, (tuple, list)):
        yield f"{type(value).__name__} of {len(value)}"
        for item in value:
            yield from _described(item, seen)
    elif isinstance(value, np.ndarray):
        yield f"{value.dtype} {value.shape} {value.tobytes()!r}"
    elif isinstance(value, FunctionType):
        yield from _described_function(value, seen)
    elif isinstance(value, (ModuleType, type, BuiltinFunctionType, np.ufunc)) or hasattr(
        value, "__qualname__"
    ):
        yield f"{getattr(value, '__module__', '')} {getattr(value, '__qualname__', None) or value.__name__}"
    else:
        raise TypeError(
            f"a kernel refers to a {type(value).__name__}, whose changes would not be noticed: {value!r}"
        )


def _described_function(function: FunctionType, seen: dict[int, str]) -> Iterator[str]:
    """A function's code and, through its names, everything of the testbed that it refers to."""
    if function.__module__.partition(".")[0] in ("numba", "numpy", "math"):
        yield f"{function.__module__}.{function.__qualname__}"
        return
    known = id(function)
    if known not in seen:
        seen[known] = "itself"
        digest = hashlib.sha256(
            f"{function.__module__} {function.__qualname__} {function.__defaults__}".encode()
        )
        for text in _referred(function, seen):
            digest.update(text.encode() + b"\0")
        seen[known] = digest.hexdigest()
    yield seen[known]


def _referred(function: FunctionType, seen: dict[int, str]) -> Iterator[str]:
    yield from _described_code(function.__code__, function.__doc__)
    for cell in function.__closure__ or ():
        yield from _described(cell.cell_contents, seen)
    names = sorted(set(_names(function.__code__)))
    for name in names:
        value = function.__globals__.get(name)
        yield name
        yield from _described(value, seen)
        if isinstance(value, ModuleType) and value.__name__.startswith("testbed"):
            for inner in names:
                if hasattr(value, inner):
                    yield from _described(getattr(value, inner), seen)


def digest_of(kernel: Any) -> str:
    """Digest (hexadecimal) of everything that a kernel's machine code depends on, the processor aside."""
    digest = hashlib.sha256(f"{numba.__version__} {np.__version__} {sys.version_info[:2]}".encode())
    for text in _described(kernel, {}):
        digest.update(text.encode())
    return digest.hexdigest()[:24]


def _prune(folder: Path) -> None:
    """Remove a kernel's versions beyond the last KEPT_VERSIONS, and what was not used for longest beyond KEPT_BYTES."""

    def age(path: Path) -> float:
        return path.stat().st_mtime

    for index in sorted(folder.glob("*.nbi"), key=age)[:-KEPT_VERSIONS]:
        for path in folder.glob(index.stem + ".*"):
            path.unlink(missing_ok=True)
    files = sorted(folder.parent.glob("*/*.nb?"), key=age)
    excess = sum(path.stat().st_size for path in files) - KEPT_BYTES
    for path in files:
        if excess <= 0:
            break
        excess -= path.stat().st_size
        path.unlink(missing_ok=True)


def folder_of(function: FunctionType) -> Path:
    """Where the versions of a kernel's machine code are."""
    return cache_folder() / f"{function.__module__}.{function.__qualname__}".replace(
        "<locals>", "in"
    )


class _Locator(_CacheLocator):  # type: ignore[misc]
    """Where numba keeps a kernel: a folder a function, the digest in the file's name."""

    def __init__(self, function: FunctionType, digest: str) -> None:
        self._folder = folder_of(function)
        self._digest = digest

    def get_cache_path(self) -> str:
        return str(self._folder)

    def get_source_stamp(self) -> str:
        return self._digest

    def get_disambiguator(self) -> str:
        return self._digest


@lru_cache(maxsize=1)
def _name_runtime() -> None:
    """Tell the loader where numba's memory management is (as numba.core.runtime.nrt does before it compiles)."""
    for name, address in runtime.c_helpers.items():
        llvm.add_symbol(name if name.startswith("_") else f"NRT_{name}", address)


class _Cache(NullCache):  # type: ignore[misc]
    """numba's cache of one kernel, found when it is first needed: by then all that the kernel refers to is there."""

    def __init__(self, kernel: Any) -> None:
        self._kernel = kernel

    @cached_property
    def _files(self) -> Any:
        function = self._kernel.py_func
        locator = _Locator(function, digest_of(self._kernel))

        class Found(_Locator):
            @classmethod
            def from_function(cls, py_func: Any, py_file: str) -> Any:
                return locator

        class Implementation(CompileResultCacheImpl):  # type: ignore[misc]
            _locator_classes = (Found,)

        class Files(FunctionCache):  # type: ignore[misc]
            _impl_class = Implementation

        return Files(function)

    @property
    def cache_path(self) -> str:
        return str(self._files.cache_path)

    def load_overload(self, sig: Any, target_context: Any) -> Any:
        """A kernel's machine code, or None.

        Of what numba prepares (target_context.refresh), loaded code needs the runtime's symbols alone; the compiler's
        tables (60 modules and SciPy, 40 MB) are loaded by the first compilation.
        """
        _name_runtime()
        try:
            found = self._files._load_overload(sig, target_context)
        except (
            OSError,
            EOFError,
            UnpicklingError,
            ImportError,
            AttributeError,
        ):  # not readable: compiled again
            return None
        if found is not None:
            self._mark_used()
        return found

    def save_overload(self, sig: Any, data: Any) -> None:
        with suppress(
            OSError
        ):  # a home that cannot be written to costs the next start its time, nothing else
            self._files.save_overload(sig, data)
            _prune(Path(self.cache_path))

    def flush(self) -> None:
        self._files.flush()

    def _mark_used(self) -> None:
        for path in Path(self.cache_path).glob(f"*{self._files._impl.locator.get_source_stamp()}*"):
            with suppress(OSError):
                os.utime(path)


def compile_for(kernel: Any, *arguments: Any) -> None:
    """Compile a kernel, or load it from the cache, as far as a caller with these arguments needs; nothing is run."""
    kernel.prepare(tuple(numba.typeof(value) for value in arguments))


def is_cached(kernel: Any) -> bool:
    """Whether the cache holds machine code of this version of a kernel, for any types; so too where none is wanted."""
    if numba.config.DISABLE_JIT:
        return True
    return any(folder_of(kernel.py_func).glob(f"*{digest_of(kernel)}*.nbc"))


def njit(function: Any = None, *, apart: bool = False, **options: Any) -> Any:
    """numba.njit with the testbed's cache; use as `@njit` or `@njit(...)`; `apart` and the rest: kernel.py."""
    if function is None:
        return lambda f: njit(f, apart=apart, **options)
    if numba.config.DISABLE_JIT:  # for a debugger, the Python function stays as it is
        return function
    kernel = Kernel(function, {**OPTIONS, **options}, digest_of, apart)
    kernel._cache = _Cache(kernel)
    return kernel


@njit
def fill(out: Any, values: Any) -> None:
    """out[:] = values, one dimension.

    An array assignment costs its kernel a second of compilation: its error message is made by kernels of its own.
    """
    for k in range(out.shape[0]):
        out[k] = values[k]
