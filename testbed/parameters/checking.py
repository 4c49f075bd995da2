"""YAML files read into checked objects: every fault becomes one InputError line."""

from __future__ import annotations

import io
from collections.abc import Mapping
from pathlib import Path
from typing import Any, TypeVar

import yaml
from pydantic import BaseModel, ConfigDict, ValidationError

from testbed.errors import InputError
from testbed.parameters import yaml_files


class Checked(BaseModel):
    """Base of the checked, frozen file contents: unknown keys and non-finite numbers are refused."""

    model_config = ConfigDict(frozen=True, extra="forbid", allow_inf_nan=False, strict=False)


T = TypeVar("T", bound=BaseModel)


def read_yaml(path: Path) -> dict[str, Any]:
    """The mapping in a YAML file. Raises InputError: missing, unreadable, not YAML, not a mapping."""
    if not path.is_file():
        raise InputError("no such file" if not path.exists() else "is not a file", file=path)
    tree = yaml_files.read_yaml(path)
    if not isinstance(tree, Mapping):
        raise InputError("must be a mapping of fields", file=path, value=type(tree).__name__)
    return {str(k): v for k, v in tree.items()}


def check(kind: type[T], tree: Mapping[str, Any], file: Path | str, prefix: str = "") -> T:
    """`tree` as a `kind`. Raises InputError for the first fault: file, field, value, what is allowed."""
    try:
        return kind.model_validate(dict(tree))
    except ValidationError as error:
        raise input_error(error, kind, file, prefix) from None


def input_error(
    error: ValidationError, kind: type[BaseModel], file: Path | str, prefix: str = ""
) -> InputError:
    """The first of pydantic's complaints as one line."""
    first = error.errors()[0]
    where = [str(part) for part in first["loc"]]
    field = prefix + ".".join(where)
    what = str(first["msg"]).removeprefix("Value error, ")
    if first["type"] == "extra_forbidden":
        return InputError(
            f"unknown key {where[-1]!r}", file=file, field=field, allowed=_allowed(kind, where[:-1])
        )
    if first["type"] == "missing":
        return InputError(f"{field} is missing", file=file)
    value = first["input"]
    shown = (
        value if isinstance(value, (str, int, float, bool, list)) or value is None else type(value).__name__
    )
    text = what[0].lower() + what[1:]
    return InputError(
        f"is {shown!r}: {text}" if value is None else text, file=file, field=field or None, value=shown
    )


def _allowed(kind: type[BaseModel], path: list[str]) -> str:
    node: Any = kind
    for part in path:
        found = (
            node.model_fields.get(part) if isinstance(node, type) and issubclass(node, BaseModel) else None
        )
        candidates = _models_in(found.annotation) if found is not None else []
        if not candidates:
            break
        node = candidates[0]
    return ", ".join(node.model_fields) if isinstance(node, type) and issubclass(node, BaseModel) else ""


def _models_in(annotation: Any) -> list[type[BaseModel]]:
    if isinstance(annotation, type) and issubclass(annotation, BaseModel):
        return [annotation]
    return [m for part in getattr(annotation, "__args__", ()) for m in _models_in(part)]


def write_yaml(path: Path, tree: Mapping[str, Any]) -> None:
    """Write a mapping as YAML, whole or not at all. Raises InputError where the folder cannot be written."""
    text = io.StringIO()
    yaml.safe_dump(dict(tree), text, sort_keys=False, default_flow_style=None, width=110, allow_unicode=True)
    partial = path.with_name(path.name + ".part")
    try:
        partial.write_text(text.getvalue())
        partial.replace(path)
    except OSError as error:
        raise InputError(f"cannot be written: {error.strerror}", file=path) from error
