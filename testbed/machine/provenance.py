"""Numbers with unit, source and mark, read from YAML.

A leaf of the file is `{value: 0.07, unit: m, mark: B, source: "..."}`. Marks: A said by the robot's
authors, B arithmetic on A, C press, D another machine or a handbook, E assumed.
"""

from __future__ import annotations

import difflib
import sys
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path
from typing import Any, Literal, get_args

from testbed.errors import InputError, check_one_of
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


def check_number(value: Any, file: str, path: str) -> None:
    """Raise InputError unless `value` is a finite number or a list of them."""
    for number in value if isinstance(value, (list, tuple)) else (value,):
        if (
            isinstance(number, bool)
            or not isinstance(number, (int, float))
            or not abs(number) <= sys.float_info.max  # an integer may be larger
        ):
            raise InputError(
                "is not a finite number",
                file=file,
                field=path,
                value=value,
                allowed="finite numbers",
            )


def read_quantities(path: Path) -> dict[str, Quantity]:
    """The numbers of a parameter file: dotted path -> quantity, in the file's order.

    Raises InputError naming file, field, value and what is allowed.
    """
    tree = read_yaml(path)
    if not isinstance(tree, Mapping):
        raise InputError("must be a mapping of groups", file=path)
    return quantities_of(tree, path)


def quantities_of(tree: Mapping[str, Any], path: Path) -> dict[str, Quantity]:
    """The numbers in a tree of groups that was read from `path`. Raises InputError as
    read_quantities.
    """
    return dict(_leaves(tree, str(path), ""))


def _leaves(node: Mapping[str, Any], file: str, prefix: str) -> Iterator[tuple[str, Quantity]]:
    for key, item in node.items():
        here = f"{prefix}{key}"
        if not isinstance(item, Mapping):
            raise InputError(
                "must carry value, unit, mark and source",
                file=file,
                field=here,
                value=item,
                allowed="{value: .., unit: .., mark: A-E, source: ..}",
            )
        if "value" in item:
            yield here, _quantity(item, file, here)
        else:
            yield from _leaves(item, file, f"{here}.")


def _quantity(item: Mapping[str, Any], file: str, path: str) -> Quantity:
    extra = set(item) - {"value", "unit", "mark", "source"}
    if extra:
        raise InputError(
            f"unknown key {sorted(extra)[0]!r}",
            file=file,
            field=path,
            allowed="value, unit, mark, source",
        )
    check_one_of(item.get("mark"), tuple(MARKS), f"{path}.mark", "no such mark", file)
    for word in ("unit", "source"):
        if not (item.get(word) and isinstance(item[word], str)):
            raise InputError(
                f"has no {word}",
                file=file,
                field=path,
                value=item.get(word) or None,
                allowed="words",
            )
    value = item["value"]
    check_number(value, file, path)
    value = tuple(value) if isinstance(value, list) else value
    return Quantity(value, str(item["unit"]), str(item["mark"]), str(item["source"]))


def nearest(name: str, names: list[str]) -> str:
    """Words that name the parameters most like `name`."""
    near = difflib.get_close_matches(name, names, n=3, cutoff=0.5)
    return f"a parameter such as {', '.join(near or names[:3])}; `testbed parameters` lists all"


# Sets of numbers under which the machine can be had: the default one, and others that differ from
# it by name.
#
# `inferred` is roboclimber.yaml itself: the circuit under which the paper's figures hold together
# (its numbers say which figure they come from). sets.yaml lists by what the others differ:
# `original` the circuit declared before, `overlapped` valves without feedback of their spools.

SetName = Literal["inferred", "original", "overlapped"]
SET_NAMES: tuple[SetName, ...] = get_args(SetName)
DEFAULT: SetName = "inferred"


@lru_cache(maxsize=4)
def machine_set(name: SetName) -> dict[str, Quantity]:
    """By what the set differs from roboclimber.yaml: dotted path -> quantity; empty for the default
    one.
    """
    quantities = read_quantities(Path(__file__).with_name("sets.yaml"))
    prefix = f"{name}."
    return {
        key.removeprefix(prefix): quantity
        for key, quantity in quantities.items()
        if key.startswith(prefix)
    }
