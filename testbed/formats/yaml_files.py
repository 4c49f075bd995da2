"""YAML as people mean it: `1e8` is a number, `off` is a word, a key given twice is an error."""

from __future__ import annotations

import re
from collections.abc import Hashable, Mapping
from pathlib import Path
from typing import Any

import yaml

from testbed.errors import InputError
from testbed.formats.files import write_text

_Base: Any = getattr(yaml, "CSafeLoader", yaml.SafeLoader)


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


def parse_yaml(text: str, file: str | Path) -> Any:
    """The value of a YAML text. Raises InputError (with line and column) where it is not YAML."""
    try:
        return yaml.load(text, Loader=_Loader)
    except yaml.MarkedYAMLError as error:
        mark = error.problem_mark
        place = f"line {mark.line + 1}, column {mark.column + 1}: " if mark else ""
        raise InputError(
            f"is not valid YAML: {place}{error.problem or error.context}", file=file
        ) from error
    except (yaml.YAMLError, ValueError) as error:
        raise InputError(f"is not valid YAML: {error}", file=file) from error


def read_yaml(path: str | Path) -> Any:
    """The value of a YAML file. Raises InputError if it cannot be read or is not YAML."""
    try:
        text = Path(path).read_text(encoding="utf-8")
    except UnicodeDecodeError as error:
        raise InputError("is not text in UTF-8", file=path) from error
    except OSError as error:
        raise InputError(f"cannot be read: {error.strerror}", file=path) from error
    return parse_yaml(text, path)


def read_mapping(path: str | Path) -> dict[str, Any]:
    """The mapping in a YAML file. Raises InputError: missing, unreadable, not YAML, not a mapping."""
    path = Path(path)
    if not path.is_file():
        raise InputError("no such file" if not path.exists() else "is not a file", file=path)
    tree = read_yaml(path)
    if not isinstance(tree, Mapping):
        raise InputError("must be a mapping of fields", file=path, value=type(tree).__name__)
    return {str(key): value for key, value in tree.items()}


def write_yaml(path: str | Path, tree: Mapping[str, Any]) -> None:
    """Write a mapping as YAML, whole or not at all. Raises InputError where it cannot be written."""
    text = yaml.safe_dump(
        dict(tree), sort_keys=False, default_flow_style=None, width=110, allow_unicode=True
    )
    write_text(path, text)
