"""YAML as people mean it: `1e8` is a number, `off` is a word, a key given twice is an error."""

from __future__ import annotations

import re
from collections.abc import Hashable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import yaml

from testbed.errors import InputError
from testbed.formats.files import read_text, write_text

MOST_BYTES, MOST_DEPTH, MOST_VALUES, MOST_BY_ALIAS = 4_000_000, 64, 300_000, 10_000
"""Of a file: its size, how deep its values lie in each other, how many it has, and how many of
those by aliases.
"""

_Base: Any = getattr(yaml, "CSafeLoader", yaml.SafeLoader)
_Dumper: Any = getattr(yaml, "CSafeDumper", yaml.SafeDumper)


class _Loader(_Base):  # type: ignore[misc]
    """YAML 1.2's core words: true/false, null, whole numbers and floats (also without a point)."""

    yaml_implicit_resolvers: dict[str, list[Any]] = {}  # noqa: RUF012  (PyYAML's own interface)

    def construct_mapping(self, node: yaml.MappingNode, deep: bool = False) -> dict[Hashable, Any]:
        """As PyYAML's, but refuses a key that stands twice (the later one would silently win)."""
        seen: set[Any] = set()
        for key_node, _ in node.value:
            key = self.construct_object(key_node, deep=True)
            if isinstance(key, Hashable):
                if key in seen:
                    raise yaml.MarkedYAMLError(
                        problem=f"key {key!r} is given twice", problem_mark=key_node.start_mark
                    )
                seen.add(key)
        return super().construct_mapping(node, deep=deep)  # type: ignore[no-any-return]


def _resolve(tag: str, pattern: str, first: str) -> None:
    _Loader.add_implicit_resolver(f"tag:yaml.org,2002:{tag}", re.compile(pattern), list(first))


_resolve("bool", r"^(?:true|True|TRUE|false|False|FALSE)$", "tTfF")
_resolve("null", r"^(?:~|null|Null|NULL|)$", "~nN\0")
_Loader.yaml_implicit_resolvers.setdefault("", []).append(
    ("tag:yaml.org,2002:null", re.compile(r"^$"))
)
_resolve("int", r"^[-+]?[0-9]+$", "-+0123456789")
_resolve("float", r"^[-+]?(?:\.[0-9]+|[0-9]+(?:\.[0-9]*)?)(?:[eE][-+]?[0-9]+)?$", "-+0123456789.")
_resolve("float", r"^(?:[-+]?\.(?:inf|Inf|INF)|\.(?:nan|NaN|NAN))$", "-+.")


def _construct_int(loader: Any, node: yaml.ScalarNode) -> int:
    return int(loader.construct_scalar(node))  # decimal, so that 010 is ten


def _construct_float(loader: Any, node: yaml.ScalarNode) -> float:
    text = loader.construct_scalar(node).lower()
    return float(text.replace(".inf", "inf").replace(".nan", "nan"))


_Loader.add_constructor("tag:yaml.org,2002:int", _construct_int)
_Loader.add_constructor("tag:yaml.org,2002:float", _construct_float)


@dataclass
class _Size:
    """How many values a node stands for, and how deep they lie in each other; `anchor`: what
    aliases call it.
    """

    anchor: str | None = None
    values: int = 1
    depth: int = 1

    def add(self, inner: _Size) -> None:
        self.values += inner.values
        self.depth = max(self.depth, inner.depth + 1)


def _check_size(text: str) -> None:
    """Refuse what would take long to build: a few aliases of aliases can stand for millions of
    values.

    Reads the parser's events one after the other, without building anything. Raises
    yaml.MarkedYAMLError.
    """
    unfinished, anchored = [_Size()], dict[str, _Size]()
    by_alias = 0
    for event in yaml.parse(text, Loader=_Loader):
        if isinstance(event, yaml.CollectionStartEvent):
            unfinished.append(_Size(event.anchor))
            node = _Size()
        elif isinstance(event, yaml.CollectionEndEvent):
            node = unfinished.pop()
            unfinished[-1].add(node)
        elif isinstance(event, yaml.AliasEvent):
            if event.anchor in (outer.anchor for outer in unfinished):
                raise _too("holds itself", event)
            node = anchored.get(str(event.anchor), _Size())
            unfinished[-1].add(node)
            by_alias += node.values
        elif isinstance(event, yaml.ScalarEvent):
            node = _Size(event.anchor)
            unfinished[-1].add(node)
        else:
            continue
        if node.anchor is not None:
            anchored[node.anchor] = node
        if len(unfinished) - 1 + node.depth > MOST_DEPTH:
            raise _too(f"lies deeper than {MOST_DEPTH} levels", event)
        if by_alias > MOST_BY_ALIAS:
            raise _too(f"stands for more than {MOST_BY_ALIAS} values by aliases", event)
        if sum(outer.values for outer in unfinished) > MOST_VALUES:
            raise _too(f"holds more than {MOST_VALUES} values", event)


def _too(problem: str, event: Any) -> yaml.MarkedYAMLError:
    return yaml.MarkedYAMLError(problem=problem, problem_mark=event.start_mark)


def parse_yaml(text: str, file: str | Path) -> Any:
    """The value of a YAML text.

    Raises InputError (with line and column) where it is not YAML, or more than a person writes.
    """
    try:
        _check_size(text)
        return yaml.load(text, Loader=_Loader)
    except yaml.MarkedYAMLError as error:
        mark = error.problem_mark
        place = f"line {mark.line + 1}, column {mark.column + 1}: " if mark else ""
        raise InputError(
            f"is not valid YAML: {place}{error.problem or error.context}", file=file
        ) from error
    except (yaml.YAMLError, ValueError) as error:
        raise InputError(f"is not valid YAML: {error}", file=file) from error


def read_yaml(path: str | Path, allowed: str | None = None) -> Any:
    """The value of a YAML file. Raises InputError if it cannot be read or is not YAML; `allowed`
    says then what it should be.
    """
    return parse_yaml(read_text(path, MOST_BYTES, allowed), path)


def read_mapping(path: str | Path, allowed: str | None = None) -> dict[str, Any]:
    """The mapping in a YAML file. Raises InputError: missing, unreadable, not YAML, not a mapping;
    `allowed` says then what it should be.
    """
    tree = read_yaml(path, allowed)
    if tree is None:
        raise InputError("is empty", file=path, allowed=allowed or "a mapping of fields")
    if not isinstance(tree, Mapping):
        raise InputError("must be a mapping of fields", file=path, value=tree, allowed=allowed)
    return {str(key): value for key, value in tree.items()}


def write_yaml(path: str | Path, tree: Mapping[str, Any]) -> None:
    """Write a mapping as YAML, whole or not at all. Raises InputError where it cannot be
    written.
    """
    write_text(path, yaml_text(tree, innermost_in_one_line=True))


def yaml_text(tree: Any, innermost_in_one_line: bool = False) -> str:
    """Plain values as YAML, keys in their order; on request a list or mapping of plain values in
    one line.
    """
    return str(
        yaml.dump(
            dict(tree) if isinstance(tree, Mapping) else tree,
            Dumper=_Dumper,
            sort_keys=False,
            allow_unicode=True,
            width=110,
            default_flow_style=None if innermost_in_one_line else False,
        )
    )


# Nested mappings as flat ones: dotted paths of their leaves.


def flattened(
    tree: Mapping[str, Any], prefix: str = "", lists: bool = False
) -> list[tuple[str, Any]]:
    """(dotted path, value) of every leaf of nested mappings.

    Lists are left out, or with `lists` go on with the number of each entry.
    """
    out: list[tuple[str, Any]] = []
    for key, value in tree.items():
        path = f"{prefix}{key}"
        if isinstance(value, Mapping):
            out += flattened(value, f"{path}.", lists)
        elif not isinstance(value, (list, tuple)):
            out.append((path, value))
        elif lists:
            out += flattened(
                {str(index): entry for index, entry in enumerate(value)}, f"{path}.", lists
            )
    return out
