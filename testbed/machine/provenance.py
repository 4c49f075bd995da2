"""Numbers with unit, source and mark: read from YAML into a frozen tree.

A leaf of the file is `{value: 0.07, unit: m, mark: B, source: "..."}`. Marks: A said by the robot's authors,
B arithmetic on A, C press, D another machine or a handbook, E assumed.
"""

from __future__ import annotations

import difflib
import math
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path
from typing import Any

import numpy as np

from testbed.errors import InputError
from testbed.formats.yaml_files import read_yaml

MARKS = {
    "A": "said by the robot's authors",
    "B": "arithmetic on what the authors said",
    "C": "press",
    "D": "another machine or a handbook",
    "E": "assumed",
}


@dataclass(frozen=True)
class Quantity:
    """One number (or list of numbers) of the machine with where it comes from."""

    value: Any
    unit: str
    mark: str
    source: str


class Parameters(Mapping[str, Any]):
    """A read-only tree of quantities: `p["vertical_cylinder"]["bore_m"]` or `p.get_value("vertical_cylinder.bore_m")`.

    Indexing a leaf gives its plain value in SI units; `quantity(path)` gives the value with unit, mark and source.
    """

    def __init__(self, tree: Mapping[str, Any], path: str = "", file: str = "") -> None:
        self._tree, self._path, self._file = dict(tree), path, file

    def __getitem__(self, key: str) -> Any:
        if key not in self._tree:
            raise KeyError(f"{self._file}: no parameter {self._path}{key}")
        item = self._tree[key]
        if isinstance(item, Quantity):
            return item.value
        return Parameters(item, f"{self._path}{key}.", self._file)

    def __iter__(self) -> Iterator[str]:
        return iter(self._tree)

    def __len__(self) -> int:
        return len(self._tree)

    def quantity(self, path: str) -> Quantity:
        """The quantity at a dotted path. Raises InputError if there is none."""
        node: Any = self._tree
        for key in path.split("."):
            if not isinstance(node, Mapping) or key not in node:
                raise InputError(
                    "no such parameter",
                    file=self._file,
                    field=path,
                    allowed=", ".join(map(str, node)),
                )
            node = node[key]
        if not isinstance(node, Quantity):
            raise InputError("is a group, not a number", file=self._file, field=path)
        return node

    def group(self, name: str) -> Parameters:
        """A group as a tree of its own, paths counted from it. Raises InputError if there is none."""
        node = self._tree.get(name)
        if not isinstance(node, Mapping):
            raise InputError(
                "no such group", file=self._file, field=name, allowed=", ".join(self._tree)
            )
        return Parameters(node, "", self._file)

    def get_value(self, path: str) -> Any:
        """Plain value at a dotted path."""
        return self.quantity(path).value

    def leaves(self) -> Iterator[tuple[str, Quantity]]:
        """All (dotted path, quantity) pairs, in the file's order."""
        yield from _leaves(self._tree, "")

    def replaced(self, changes: Mapping[str, Any]) -> Parameters:
        """A copy in which some numbers differ; a changed number is marked E with its reason.

        Raises InputError for an unknown path or a value that is not finite.
        """
        tree = _copy(self._tree)
        for path, value in changes.items():
            old = self.quantity(path)
            _check_number(value, self._file, path)
            node = tree
            *groups, last = path.split(".")
            for key in groups:
                node = node[key]
            node[last] = Quantity(value, old.unit, "E", f"changed from {old.value}")
        return Parameters(tree, self._path, self._file)


def _copy(tree: Mapping[str, Any]) -> dict[str, Any]:
    return {k: _copy(v) if isinstance(v, Mapping) else v for k, v in tree.items()}


def _leaves(tree: Mapping[str, Any], prefix: str) -> Iterator[tuple[str, Quantity]]:
    for key, item in tree.items():
        if isinstance(item, Quantity):
            yield prefix + key, item
        else:
            yield from _leaves(item, f"{prefix}{key}.")


def _check_number(value: Any, file: str, path: str) -> None:
    values = np.atleast_1d(np.asarray(value, dtype=object)).ravel()
    for v in values:
        if isinstance(v, bool) or not isinstance(v, (int, float)) or not math.isfinite(v):
            raise InputError(
                "is not a finite number",
                file=file,
                field=path,
                value=value,
                allowed="finite numbers",
            )


def _read(node: Mapping[str, Any], file: str, path: str) -> dict[str, Any]:
    out: dict[str, Any] = {}
    for key, item in node.items():
        here = f"{path}{key}"
        if not isinstance(item, Mapping):
            raise InputError(
                "must carry value, unit, mark and source",
                file=file,
                field=here,
                value=item,
                allowed="{value: .., unit: .., mark: A-E, source: ..}",
            )
        if "value" not in item:
            out[str(key)] = _read(item, file, here + ".")
            continue
        extra = set(item) - {"value", "unit", "mark", "source"}
        if extra:
            raise InputError(
                f"unknown key {sorted(extra)[0]!r}",
                file=file,
                field=here,
                allowed="value, unit, mark, source",
            )
        if item.get("mark") not in MARKS:
            raise InputError(
                "has no valid mark",
                file=file,
                field=here,
                value=item.get("mark"),
                allowed=", ".join(MARKS),
            )
        for word in ("unit", "source"):
            if not item.get(word):
                raise InputError(f"has no {word}", file=file, field=here)
        _check_number(item["value"], file, here)
        value = item["value"]
        value = tuple(value) if isinstance(value, list) else value
        out[str(key)] = Quantity(value, str(item["unit"]), str(item["mark"]), str(item["source"]))
    return out


def read_parameters(path: Path) -> Parameters:
    """Read a parameter file. Raises InputError naming file, field, value and what is allowed."""
    tree = read_yaml(path)
    if not isinstance(tree, Mapping):
        raise InputError("must be a mapping of groups", file=path)
    return Parameters(_read(tree, str(path.name), ""), "", str(path.name))


@lru_cache(maxsize=1)
def roboclimber() -> Parameters:
    """The shipped machine: `testbed/parameters/roboclimber.yaml`."""
    return read_parameters(Path(__file__).with_name("roboclimber.yaml"))


def check_parameters(changes: Mapping[str, Any], file: Path, section: str) -> None:
    """Refuse a change of a parameter that the machine does not have, or of another shape."""
    for name, value in changes.items():
        machine = roboclimber()
        leaves = dict(machine.leaves())
        if name not in leaves:
            raise InputError(
                "no such parameter",
                file=file,
                field=f"{section}.{name}",
                allowed=_nearest(name, list(leaves)),
            )
        old = leaves[name].value
        if np.shape(old) != np.shape(value):
            raise InputError(
                "has another shape",
                file=file,
                field=f"{section}.{name}",
                value=value,
                allowed=f"like {old!r}",
            )


def _nearest(name: str, names: list[str]) -> str:
    near = difflib.get_close_matches(name, names, n=3, cutoff=0.5)
    return f"a parameter such as {', '.join(near or names[:3])}; `testbed parameters` lists all"
