"""Every field of a checked object as a table: path, kind of value, default, what is allowed and
what it means.
"""

from __future__ import annotations

import types
import typing
from collections.abc import Iterator
from typing import Any, NamedTuple

from pydantic.fields import FieldInfo
from pydantic_core import PydanticUndefined

from testbed.formats.checked import Checked, NameOrClass

HEADS = ("field", "default", "allowed", "meaning")


class Row(NamedTuple):
    """One field: dotted path, default (empty: must be given), allowed values, meaning with unit."""

    path: str
    default: str
    allowed: str
    meaning: str


_MANY: dict[Any, Any] = {tuple: ("[]", "list"), dict: (".<name>", "mapping")}
"""How the path of what stands in a list or a mapping goes on, and what the whole is called."""


def rows(model: type[Checked], prefix: str = "") -> Iterator[Row]:
    """All fields in the file's order; the kinds of a union stand as `task (drill).start_s`."""
    meanings = model.meanings()
    for name, info in model.model_fields.items():
        path, meaning = prefix + name, " ".join(meanings.get(name, "").split())
        models = [m for m in _models(info.annotation) if issubclass(m, Checked)]
        if not models:
            yield Row(path, _default(info), _allowed(info), meaning)
            continue
        many = _MANY.get(typing.get_origin(info.annotation), "")
        if meaning:
            yield Row(path, _default(info), many and f"a {many[1]}", meaning)
        for part in models:
            kind = part.model_fields.get("kind")
            choice = (
                typing.get_args(kind.annotation)[0]
                if kind is not None and len(models) > 1
                else None
            )
            yield from rows(part, f"{path}{many and many[0]}{f' ({choice})' if choice else ''}.")


def _models(annotation: Any) -> list[type[Checked]]:
    if isinstance(annotation, type) and issubclass(annotation, Checked):
        return [annotation]
    found: list[type[Checked]] = []
    for part in typing.get_args(annotation):
        found += _models(part)
    return found


def _default(info: FieldInfo) -> str:
    if info.default_factory is not None:
        return "{}"
    if info.default is PydanticUndefined:
        return ""
    if info.default is None:
        return "null"
    value = info.default
    if isinstance(value, Checked):
        return "{}"
    if isinstance(value, bool):
        return str(value).lower()
    if isinstance(value, tuple):
        return (
            f"{value[0]:g}" if len(set(map(str, value))) == 1 and len(value) == 4 else _list(value)
        )
    return f"{value:g}" if isinstance(value, float) else str(value)


def _list(values: tuple[Any, ...]) -> str:
    if any(isinstance(value, Checked) for value in values):
        return f"{len(values)} entry"
    return (
        "["
        + ", ".join(f"{value:g}" if isinstance(value, float) else str(value) for value in values)
        + "]"
    )


_SIGNS = {"ge": ">=", "gt": ">", "le": "<=", "lt": "<"}


def _allowed(info: FieldInfo) -> str:
    for made in info.metadata:
        if isinstance(made, NameOrClass):
            return made.allowed
    bounds = [
        f"{sign} {getattr(bound, name):g}"
        for bound in info.metadata
        for name, sign in _SIGNS.items()
        if hasattr(bound, name)
    ]
    return ", ".join(bounds) if bounds else _kind(info.annotation)


def _kind(annotation: Any) -> str:
    origin, args = typing.get_origin(annotation), typing.get_args(annotation)
    if origin is typing.Literal:
        return " | ".join(map(str, args))
    if origin in (typing.Union, types.UnionType):
        return " or ".join(_kind(arg) for arg in args if arg is not types.NoneType)
    if origin is tuple:
        inner = [arg for arg in args if arg is not Ellipsis]
        return f"list of {_kind(inner[0])}" if Ellipsis in args else f"{len(inner)} numbers"
    if origin is dict:
        return "mapping"
    if origin is typing.Annotated:
        return _kind(args[0])
    if annotation is Any:
        return "anything"
    names = {float: "number", int: "whole number", bool: "true or false", str: "text"}
    return names.get(annotation, str(annotation))
