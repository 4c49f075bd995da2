"""A compiled function that is lowered once and optimised where it is used.

numba makes machine code of every function it compiles, and once more of it within each of its callers, callers'
callers and so on. Here a function that only other kernels call is kept as a *part*: intermediate code, neither
optimised nor made into machine code, nor stored. A kernel that Python calls is a *whole*: its own code and all its
parts, linked, optimised and emitted once, and stored (compiled.py). A kernel `apart` is always a whole: its callers
call its machine code and take nothing of it in, so that it can be compiled on its own, by another process.

Names of machine code follow from what the kernel is made of, not from when it was compiled: a caller finds what
another process has stored.
"""

from __future__ import annotations

import gc
import importlib
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from functools import partial
from types import FunctionType
from typing import Any

from numba.core import compiler, dispatcher, sigutils, typing
from numba.core.codegen import JITCodeLibrary
from numba.core.compiler_lock import global_compiler_lock
from numba.core.compiler_machinery import register_pass
from numba.core.environment import lookup_environment
from numba.core.registry import CPUDispatcher
from numba.core.typed_passes import NativeLowering

_ENVIRONMENT = "_ZN08NumbaEnv"


@dataclass(frozen=True)
class Loader:
    """Brings a kernel's machine code into this process: done before that of a caller is loaded."""

    module: str
    name: str
    signature: tuple[Any, ...]

    def __call__(self) -> None:
        kernel: Any = importlib.import_module(self.module)
        for part in self.name.split("."):
            kernel = getattr(kernel, part)
        kernel.compile(self.signature)


class _Library(JITCodeLibrary):  # type: ignore[misc]
    """Code of a kernel and what it links: of a kernel apart, its symbols alone."""

    def add_linking_library(self, library: Any) -> None:
        loader = getattr(library, "loader", None)
        if loader is None:
            super().add_linking_library(library)
        else:
            self._reload_init.add(loader)

    def closure(self) -> Iterator[Any]:
        """All libraries below this one, each once."""
        seen, waiting = set(), list(self._linking_libraries)
        while waiting:
            library = waiting.pop(0)
            if library not in seen:
                seen.add(library)
                yield library
                if isinstance(library, PartLibrary):
                    waiting += library._linking_libraries


class PartLibrary(_Library):
    """Intermediate code for others to link."""

    def finalize(self) -> None:
        """Nothing more is added."""
        self._raise_if_finalized()
        self._finalized = True

    def get_pointer_to_function(self, name: str) -> int:
        """There is no machine code."""
        return 0


class WholeLibrary(_Library):
    """Machine code of a kernel with all its parts."""

    def finalize(self) -> None:
        """Link, optimise, emit."""
        self._raise_if_finalized()
        for library in self.closure():
            self._reload_init.update(library._reload_init)
            self._final_module.link_in(library._get_module_for_linking(), preserve=True)
        self._optimize_final_module()
        self._final_module.verify()
        self._finalize_final_module()
        for variable in self._final_module.global_variables:
            environment = (
                lookup_environment(variable.name)
                if variable.name.startswith(_ENVIRONMENT)
                else None
            )
            if environment is not None:
                self._codegen.set_env(variable.name, environment)


@register_pass(mutates_CFG=True, analysis_only=False)
class _LowerPart(NativeLowering):  # type: ignore[misc]
    """Lowering to intermediate code."""

    _name = "lower_part"

    def run_pass(self, state: Any) -> bool:
        state.library = PartLibrary(state.targetctx.codegen(), state.func_id.func_qualname)
        super().run_pass(state)
        lowered = state["cr"]
        key = object()  # what callers find the code by
        state["cr"] = lowered._replace(cfunc=key)
        state.library.finalize()
        state.targetctx.insert_user_function(key, lowered.fndesc, [state.library])
        return True


@register_pass(mutates_CFG=True, analysis_only=False)
class _LowerWhole(NativeLowering):  # type: ignore[misc]
    """Lowering to machine code."""

    _name = "lower_whole"

    def run_pass(self, state: Any) -> bool:
        state.library = WholeLibrary(state.targetctx.codegen(), state.func_id.func_qualname)
        state.library.enable_object_caching()
        return bool(super().run_pass(state))


class _Pipeline(compiler.CompilerBase):  # type: ignore[misc]
    """numba's passes with one of the two lowerings, under a name given by the kernel."""

    def __init__(self, lowering: type, identity: Callable[[], str], *arguments: Any) -> None:
        super().__init__(*arguments)
        self._lowering, self._identity = lowering, identity

    def define_pipelines(self) -> list[Any]:
        standard = compiler.DefaultPassBuilder
        passes = compiler.PassManager("nopython")
        for group in (
            standard.define_untyped_pipeline,
            standard.define_typed_pipeline,
            standard.define_nopython_lowering_pipeline,
        ):
            passes.passes.extend(group(self.state).passes)
        passes.passes = [
            (self._lowering if p is NativeLowering else p, text) for p, text in passes.passes
        ]
        passes.finalize()
        return [passes]

    def _compile_bytecode(self) -> Any:
        self.state.func_id.unique_id = self._identity()
        return super()._compile_bytecode()


@contextmanager
def _patient_collector() -> Iterator[None]:
    """Python's collector of cycles less often: a compiler makes millions of objects (a tenth of its time)."""
    usual = gc.get_threshold()
    gc.set_threshold(50_000, 20, 100)
    try:
        yield
    finally:
        gc.set_threshold(*usual)


class _PartCompiler(dispatcher._FunctionCompiler):  # type: ignore[misc, name-defined]
    def _customize_flags(self, flags: Any) -> Any:
        flags.no_compile = True
        flags.no_cpython_wrapper = True
        return flags


class Kernel(CPUDispatcher):  # type: ignore[misc]
    """A function compiled for the types it is called with; `identity` tells its versions apart."""

    def __init__(
        self,
        function: FunctionType,
        options: dict[str, Any],
        identity: Callable[[Any], str],
        apart: bool = False,
    ) -> None:
        named = partial(identity, self)
        super().__init__(
            function, targetoptions=options, pipeline_class=partial(_Pipeline, _LowerWhole, named)
        )
        self.apart = apart
        self._parts: dict[tuple[Any, ...], Any] = {}
        self._part_compiler = _PartCompiler(
            function, self.targetdescr, options, {}, partial(_Pipeline, _LowerPart, named)
        )

    def prepare(self, types: tuple[Any, ...]) -> None:
        """Do what a caller needs done for these types: its compilation then begins here."""
        with _patient_collector():
            self.get_call_template(types, {})

    def get_call_template(self, args: Any, kws: Any) -> Any:
        """What a caller's compiler needs to know of a call with these types."""
        if self.apart:
            return super().get_call_template(args, kws)
        signature, args = self._compiler.fold_argument_types(args, kws)
        with global_compiler_lock:
            if tuple(args) not in self._parts:
                with self._compiling_counter:
                    self._parts[tuple(args)] = self._part_compiler.compile(tuple(args), None)
        name = self.py_func.__name__
        signatures = [part.signature for part in self._parts.values()]
        return (
            typing.make_concrete_template(f"CallTemplate({name})", name, signatures),
            signature,
            args,
            {},
        )

    def compile(self, sig: Any) -> Any:
        """Compile, or load, machine code for these types."""
        with _patient_collector():
            return super().compile(sig)

    def get_overload(self, sig: Any) -> Any:
        """What a caller's compiler finds the code by."""
        if self.apart:
            return super().get_overload(sig)
        return self._parts[tuple(sigutils.normalize_signature(sig)[0])].entry_point

    def add_overload(self, cres: Any) -> None:
        """Take compiled or loaded machine code in."""
        if self.apart:
            function = self.py_func
            cres.library.loader = Loader(
                function.__module__, function.__qualname__, tuple(cres.signature.args)
            )
        super().add_overload(cres)
