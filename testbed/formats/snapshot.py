"""The state of a tree of Python objects as plain values and arrays, and back into a tree that is
built alike.

    taken = take(root, constant)          # constant(thing): built anew by whoever rebuilds the tree
    put(taken, another_root, constant)    # goes on exactly where the first one stood

`put` fills the objects that are there and makes those that have come since. Nothing is unpickled: a
state names classes of modules that are loaded already, and gives their attributes. What two objects
share they share again.
"""

from __future__ import annotations

import sys
from collections import deque
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, field
from enum import Enum
from functools import partial
from itertools import chain
from pathlib import Path
from types import BuiltinFunctionType, FunctionType, MethodType, ModuleType
from typing import Any

import numpy as np
from numpy.typing import NDArray
from pydantic import BaseModel

from testbed.errors import InputError

Constant = Callable[[Any], bool]
PLAIN = (type(None), bool, int, float, str)
OWN, USERS = "testbed.", "testbed_user_"
"""How the names of the testbed's modules begin, and those of a user's file (formats/sockets.py)."""
CODE = (FunctionType, BuiltinFunctionType, ModuleType, type, partial, np.ufunc, np.dtype, Path)
MADE_IN_PYTHON = 1 << 9
"""The flag of a class that a class statement made."""


@dataclass
class Snapshot:
    """A state: `nodes`, a JSON list of what can change, and the arrays that they name by number."""

    nodes: list[dict[str, Any]] = field(default_factory=list)
    arrays: list[NDArray[Any]] = field(default_factory=list)


def capture(root: Any, constant: Constant) -> Snapshot:
    """The state of everything that is reached from `root`. Raises InputError for what no state can
    hold.
    """
    taking = _Taking(constant)
    taking.value(root, "")
    return taking.taken


def put_back(taken: Snapshot, root: Any, constant: Constant) -> None:
    """Bring `root`, built as the tree was that `taken` comes from, to that state.

    Raises InputError where it was built otherwise, or where the state is damaged.
    """
    there: dict[str, Any] = {}
    _index(root, "", constant, there, set())
    try:
        _Putting(taken, there).node(0)
    except (KeyError, IndexError, TypeError, ValueError, AttributeError) as error:
        raise InputError(
            f"does not fit what is to take it over: {error}", field="state", allowed="its own run"
        ) from error


def parts_of(thing: Any) -> Iterator[tuple[str, Any]]:
    """The attributes of an object, those in slots included."""
    for kind in type(thing).__mro__:
        slots = getattr(kind, "__slots__", ())
        for name in (slots,) if isinstance(slots, str) else slots:
            if name not in ("__dict__", "__weakref__") and hasattr(thing, name):
                yield name, getattr(thing, name)
    yield from getattr(thing, "__dict__", {}).items()


def _module(kind: type) -> str:
    """The module of a class; that of a user's file by the file's name, wherever it lies."""
    name = kind.__module__
    return name.rpartition("_")[0] if name.startswith(USERS) else name


def _spelt(kind: type) -> str:
    return f"{_module(kind)}:{kind.__qualname__}"


def _named(spelt: str, allowed: set[str]) -> type:
    """The class that `_spelt` named, of the testbed or of the modules `allowed`. Raises ValueError
    for any other.
    """
    module, _, name = spelt.partition(":")
    under_its_name = [sys.modules[module]] if module in sys.modules else []
    for loaded in chain(under_its_name, tuple(sys.modules.values())):
        kind: Any = loaded
        for word in name.split("."):
            kind = getattr(kind, word, None)
        if not isinstance(kind, type) or _spelt(kind) != spelt:
            continue
        if not _in_python(kind) and not (issubclass(kind, tuple) and hasattr(kind, "_fields")):
            continue
        if module.startswith(OWN) or module in allowed:
            return kind
    raise ValueError(f"{spelt} is no class of this run")


_KNOWN: dict[type, bool] = {}


def _in_python(kind: type) -> bool:
    """Whether a class and all that it inherits from are written in Python: its objects are their
    attributes.
    """
    if kind not in _KNOWN:
        _KNOWN[kind] = _looked_up(kind)
    return _KNOWN[kind]


def _looked_up(kind: type) -> bool:
    return all(
        one is object
        or (
            bool(one.__flags__ & MADE_IN_PYTHON)
            and str(getattr(sys.modules.get(one.__module__), "__file__", ".py")).endswith(".py")
        )
        for one in kind.__mro__
    )


def _is_ours(thing: Any) -> bool:
    """Whether a thing is the sum of its attributes."""
    return _in_python(type(thing))


class _Taking:
    """Walks a tree once and writes down each object when it is first met."""

    def __init__(self, constant: Constant) -> None:
        self.taken = Snapshot()
        self._constant = constant
        self._met: dict[int, Any] = {}
        self._alive: list[Any] = []
        """Keeps what was met, so that no identity is used twice."""

    def value(self, thing: Any, path: str) -> Any:
        """What stands for `thing` in the place where it was found."""
        if isinstance(thing, PLAIN) and not isinstance(thing, Enum | np.generic):
            return thing
        if isinstance(thing, tuple):
            parts = [self.value(part, f"{path}.{index}") for index, part in enumerate(thing)]
            named = {} if type(thing) is tuple else {"named": _spelt(type(thing))}
            return {"tuple": parts, **named}
        if isinstance(thing, Enum):
            return {"enum": _spelt(type(thing)), "name": thing.name}
        if isinstance(thing, np.generic) and thing.dtype.names is None:
            return {"scalar": self._array(thing)}
        if id(thing) in self._met:
            return self._met[id(thing)]
        if isinstance(thing, MethodType) and _is_ours(thing.__self__):
            return {"method": thing.__name__, "of": self.value(thing.__self__, f"{path}.__self__")}
        self._alive.append(thing)
        if self._constant(thing):
            self._met[id(thing)] = {"constant": path}
            return self._met[id(thing)]
        return self._node(thing, path)

    def _node(self, thing: Any, path: str) -> Any:
        number = len(self.taken.nodes)
        node: dict[str, Any] = {"path": path}
        self._met[id(thing)] = {"node": number}
        self.taken.nodes.append(node)
        if isinstance(thing, np.ndarray | np.void):
            node["array"] = self._array(thing)
            node["writeable"] = isinstance(thing, np.void) or bool(thing.flags.writeable)
        elif isinstance(thing, np.random.Generator):
            node["generator"] = plain_generator(thing)
        elif isinstance(thing, BaseModel) and _is_ours(thing):
            node |= {"model": _spelt(type(thing)), "values": thing.model_dump(mode="json")}
        elif isinstance(thing, list | deque | set):
            node["list"] = [self.value(part, f"{path}.{index}") for index, part in enumerate(thing)]
            node["kind"] = type(thing).__name__
        elif isinstance(thing, dict):
            node["dict"] = [
                [self.value(key, ""), self.value(part, f"{path}.{key}")]
                for key, part in thing.items()
            ]
        elif _is_ours(thing):
            node["object"] = _spelt(type(thing))
            node["parts"] = {
                name: self.value(part, f"{path}.{name}") for name, part in parts_of(thing)
            }
        else:
            raise InputError(
                f"a {type(thing).__name__} cannot be saved",
                field=path.strip("."),
                allowed="numbers, words, arrays, lists, dictionaries, random generators and objects of "
                "classes in the same file",
            )
        return self._met[id(thing)]

    def _array(self, thing: Any) -> int:
        array = np.array(thing)
        if array.dtype.hasobject:
            raise InputError("an array of objects cannot be saved", field="state")
        self.taken.arrays.append(array.copy())  # of a record in an array NumPy makes a view first
        return len(self.taken.arrays) - 1


def plain_generator(generator: np.random.Generator) -> dict[str, Any]:
    """The state of a random generator as JSON can hold it. Raises InputError for one that has
    arrays in it.
    """
    state = dict(generator.bit_generator.state)
    if state["bit_generator"] not in ("PCG64", "PCG64DXSM"):
        raise InputError(
            "cannot be saved",
            field="random generator",
            value=state["bit_generator"],
            allowed="numpy.random.default_rng",
        )
    return state


def _index(thing: Any, path: str, constant: Constant, there: dict[str, Any], met: set[int]) -> None:
    """Every object of a tree by the path on which it is first met."""
    if isinstance(thing, PLAIN) or (isinstance(thing, np.generic) and thing.dtype.names is None):
        return
    if isinstance(thing, MethodType) and _is_ours(thing.__self__):
        _index(thing.__self__, f"{path}.__self__", constant, there, met)
        return
    if id(thing) in met:
        return
    there[path] = thing
    if not isinstance(thing, tuple):
        met.add(id(thing))
    parts: Any = ()
    if isinstance(thing, list | deque | tuple | set):
        parts = enumerate(thing)
    elif constant(thing) or isinstance(thing, np.ndarray | np.void | BaseModel):
        return
    elif isinstance(thing, dict):
        parts = thing.items()
    elif _is_ours(thing):
        parts = parts_of(thing)
    for name, part in list(parts):
        _index(part, f"{path}.{name}", constant, there, met)


class _Putting:
    """Fills a tree from a state; an object that is not there is made."""

    def __init__(self, taken: Snapshot, there: Mapping[str, Any]) -> None:
        self._taken, self._there = taken, there
        self._modules = {_module(type(thing)) for thing in there.values()}
        self._made: dict[int, Any] = {}
        self._used: set[int] = set()

    def value(self, encoded: Any) -> Any:
        """The thing that a value of `_Taking.value` stands for."""
        if not isinstance(encoded, Mapping):
            return encoded
        if "node" in encoded:
            return self.node(int(encoded["node"]))
        if "tuple" in encoded:
            parts = [self.value(part) for part in encoded["tuple"]]
            if "named" not in encoded:
                return tuple(parts)
            named: Any = _named(encoded["named"], self._modules)
            return named(*parts)
        if "constant" in encoded:
            return self._there[encoded["constant"]]
        if "scalar" in encoded:
            return self._taken.arrays[int(encoded["scalar"])][()]
        if "enum" in encoded:
            kind: Any = _named(encoded["enum"], self._modules)
            return kind[encoded["name"]]
        return getattr(self.value(encoded["of"]), encoded["method"])

    def node(self, number: int) -> Any:
        """The object of one node, filled."""
        if number in self._made:
            return self._made[number]
        encoded = self._taken.nodes[number]
        found = self._there.get(encoded["path"])
        if id(found) in self._used:  # two that were one when they were built
            found = None
        made = self._begun(encoded, found)
        self._made[number] = made
        self._used.add(id(made))
        self._fill(encoded, made)
        return made

    def _begun(self, encoded: Mapping[str, Any], found: Any) -> Any:
        """The object that is to be filled: the one found in its place, where it can be, or an empty
        one.
        """
        if "array" in encoded:
            return self._array(encoded, found)
        if "model" in encoded:
            kind: Any = _named(encoded["model"], self._modules)
            made = kind.model_validate(encoded["values"])
            return found if type(found) is kind and found == made else made
        if "generator" in encoded:
            return found if isinstance(found, np.random.Generator) else np.random.default_rng()
        if "list" in encoded:
            wanted: Any = {"list": list, "deque": deque, "set": set}[encoded["kind"]]
            return found if type(found) is wanted else wanted()
        if "dict" in encoded:
            return found if type(found) is dict else {}
        kind = _named(encoded["object"], self._modules)
        return found if type(found) is kind else object.__new__(kind)

    def _array(self, encoded: Mapping[str, Any], found: Any) -> Any:
        saved = self._taken.arrays[int(encoded["array"])]
        if isinstance(found, np.void) and found.dtype == saved.dtype:
            for name in saved.dtype.names or ():
                found[name] = saved[name]
            return found
        fits = isinstance(found, np.ndarray) and (found.shape, found.dtype) == (
            saved.shape,
            saved.dtype,
        )
        if fits and found.flags.writeable and encoded["writeable"]:
            found[...] = saved
            return found
        made = saved.copy()
        made.flags.writeable = bool(encoded["writeable"])
        return made

    def _fill(self, encoded: Mapping[str, Any], made: Any) -> None:
        if "generator" in encoded:
            made.bit_generator.state = encoded["generator"]
        elif "list" in encoded:
            parts = [self.value(part) for part in encoded["list"]]
            made.clear()
            made.update(parts) if encoded["kind"] == "set" else made.extend(parts)
        elif "dict" in encoded:
            pairs = [(self.value(key), self.value(part)) for key, part in encoded["dict"]]
            made.clear()
            made.update(pairs)
        elif "object" in encoded:
            for name in [name for name, _ in parts_of(made) if name not in encoded["parts"]]:
                object.__delattr__(made, name)
            for name, part in encoded["parts"].items():
                object.__setattr__(made, name, self.value(part))


def constants(*kinds: type, rooms: tuple[str, ...] = ()) -> Constant:
    """A `constant` for take and put: things of these classes, of classes in these modules, and all
    code.
    """
    rooms = (*rooms, "numba.", "pinocchio")

    def constant(thing: Any) -> bool:
        return isinstance(thing, (*kinds, *CODE)) or type(thing).__module__.startswith(rooms)

    return constant
