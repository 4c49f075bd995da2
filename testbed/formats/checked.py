"""Base class of every checked object: unknown keys are refused, numbers are finite, objects frozen,
and an error is one line.
"""

from __future__ import annotations

import ast
import inspect
import textwrap
from collections.abc import Mapping
from dataclasses import dataclass
from itertools import pairwise
from pathlib import Path
from typing import Annotated, Any, TypeVar

from pydantic import (
    BaseModel,
    BeforeValidator,
    ConfigDict,
    GetCoreSchemaHandler,
    GetJsonSchemaHandler,
    ValidationError,
    model_validator,
)
from pydantic_core import CoreSchema, PydanticCustomError
from pydantic_core.core_schema import no_info_after_validator_function

from testbed.errors import InputError, did_you_mean
from testbed.formats.sockets import FORM, is_user_class

ModelT = TypeVar("ModelT", bound=BaseModel)


class Checked(BaseModel):
    """Base of all checked objects: frozen, strict, finite numbers, no unknown key.

    The docstring below a field is its meaning in tables, pages and JSON schemas.
    """

    model_config = ConfigDict(extra="forbid", frozen=True, strict=True, allow_inf_nan=False)

    @classmethod
    def meanings(cls) -> dict[str, str]:
        """Name of a field -> its description, or the docstring below it. Read when it is asked for:
        every start would take a tenth of a second for it.
        """
        described = ((name, info.description) for name, info in cls.model_fields.items())
        found = {name: meaning for name, meaning in described if meaning}
        for kind in (kind for kind in reversed(cls.__mro__) if issubclass(kind, Checked)):
            (body,) = ast.parse(textwrap.dedent(inspect.getsource(kind))).body
            for field, text in pairwise(body.body if isinstance(body, ast.ClassDef) else ()):
                match field, text:
                    case (
                        ast.AnnAssign(target=ast.Name(id=name)),
                        ast.Expr(value=ast.Constant(value=str(meaning))),
                    ):
                        found[name] = inspect.cleandoc(meaning)
        return found

    @classmethod
    def __get_pydantic_json_schema__(
        cls, schema: CoreSchema, handler: GetJsonSchemaHandler
    ) -> dict[str, Any]:
        """Fields with their meanings."""
        own = handler(schema)
        properties = handler.resolve_ref_schema(own).get("properties", {})
        for name, meaning in cls.meanings().items():
            properties.get(name, {})["description"] = meaning
        return own

    @model_validator(mode="before")
    @classmethod
    def _known_keys(cls, data: Any) -> Any:
        """Refuse an unknown key with the nearest known one."""
        if isinstance(data, Mapping):
            for key in data:
                if key not in cls.model_fields:
                    hint = did_you_mean(key, cls.model_fields)
                    raise PydanticCustomError(
                        "unknown_key",
                        "unknown key{hint}",
                        {"hint": hint, "key": str(key), "allowed": ", ".join(cls.model_fields)},
                    )
        return data


def _as_tuple(value: Any) -> Any:
    return tuple(value) if isinstance(value, list) else value


def _as_four(value: Any) -> Any:
    if isinstance(value, (int, float)) and not isinstance(value, bool):
        return (value,) * 4
    if not isinstance(value, (list, tuple)):
        raise impossible("cannot be used", "a number, or a list of four")
    return _as_tuple(value)


def _flat(value: Any, prefix: str = "") -> Any:
    if not isinstance(value, Mapping):
        return value
    out: dict[str, Any] = {}
    for key, item in value.items():
        if isinstance(item, Mapping):
            out.update(_flat(item, f"{prefix}{key}."))
        else:
            out[f"{prefix}{key}"] = _as_tuple(item)
    return out


Four = Annotated[tuple[float, float, float, float], BeforeValidator(_as_four)]
"""Four numbers in leg order fl, fr, rl, rr; one number stands for all four."""

Names = Annotated[tuple[str, ...], BeforeValidator(_as_tuple)]
Pair = Annotated[tuple[float, float], BeforeValidator(_as_tuple)]
Triple = Annotated[tuple[float, float, float], BeforeValidator(_as_tuple)]
Sequence = BeforeValidator(_as_tuple)
"""Annotation that lets a YAML list stand for a tuple."""

Numbers = Annotated[dict[str, float | tuple[float, ...]], BeforeValidator(_flat)]
"""Dotted parameter path -> number in SI units (nested groups are flattened)."""


@dataclass(frozen=True)
class NameOrClass:
    """Annotation of a text: one of `names`, or a class of the user's own (FILE.py:Class)."""

    names: tuple[str, ...] = ()

    @property
    def allowed(self) -> str:
        """What the text may be, in words."""
        return " | ".join((*self.names, FORM))

    def __get_pydantic_core_schema__(
        self, source: Any, handler: GetCoreSchemaHandler
    ) -> CoreSchema:
        """Check after the text has been checked to be one."""
        return no_info_after_validator_function(self._check, handler(source))

    def __get_pydantic_json_schema__(
        self, schema: CoreSchema, handler: GetJsonSchemaHandler
    ) -> dict[str, Any]:
        """A text of one of the two forms."""
        own = {"pattern": r"\.py:[^:]+$"}
        return handler(schema) | {"anyOf": [{"enum": list(self.names)}, own]}

    def _check(self, value: str) -> str:
        if value in self.names or is_user_class(value):
            return value
        raise impossible(f"no such name{did_you_mean(value, self.names)}", self.allowed)


def checked(model: type[ModelT], data: Any, file: str | Path) -> ModelT:
    """`data` as a checked object. Raises InputError: file, dotted field, value, what is allowed."""
    if not isinstance(data, Mapping):
        allowed = ", ".join(model.model_fields)
        problem = "is empty" if data is None else "must be a mapping of keys to values"
        raise InputError(problem, file=file, value=data, allowed=allowed)
    try:
        return model.model_validate(data)
    except ValidationError as error:
        raise _translated(error, data, file) from error


def _translated(error: ValidationError, data: Any, file: str | Path) -> InputError:
    first = error.errors(include_url=False)[0]
    context = first.get("ctx") or {}
    field, value = _place(first["loc"], data, first["type"])
    kind, message = first["type"], first["msg"]
    if kind == "unknown_key":
        key = context["key"]
        return InputError(
            message, file=file, field=".".join([*field, key]), allowed=context["allowed"]
        )
    if kind == "missing":
        return InputError("is missing", file=file, field=".".join(field))
    if kind == "union_tag_not_found":
        return InputError(
            "is missing",
            file=file,
            field=".".join([*field, "kind"]),
            allowed="one of the known kinds",
        )
    if kind == "union_tag_invalid":
        tags = str(context["expected_tags"]).replace("'", "")
        tag = str(context["tag"])
        hint = did_you_mean(tag, tags.split(", "))
        return InputError(
            f"unknown kind{hint}",
            file=file,
            field=".".join([*field, "kind"]),
            value=tag,
            allowed=tags,
        )
    if kind in ("impossible", "value_error"):
        message = message.removeprefix("Value error, ")
        return InputError(
            message,
            file=file,
            field=".".join(field) or None,
            value=_shown(value) if field else None,  # the whole file is no value to show
            allowed=context.get("allowed"),
        )
    allowed = _ALLOWED.get(kind, message[0].lower() + message[1:].removeprefix("Input should be "))
    try:
        allowed = allowed.format(**{name: _number(number) for name, number in context.items()})
    except (KeyError, IndexError):
        allowed = message
    problem = "is out of range" if kind in _RANGES else "cannot be used"
    return InputError(
        problem, file=file, field=".".join(field), value=_shown(value), allowed=allowed
    )


_RANGES = ("greater_than", "greater_than_equal", "less_than", "less_than_equal", "finite_number")
_ALLOWED = {
    "greater_than": "more than {gt}",
    "greater_than_equal": "at least {ge}",
    "less_than": "less than {lt}",
    "less_than_equal": "at most {le}",
    "finite_number": "a finite number",
    "float_type": "a number",
    "int_type": "a whole number",
    "bool_type": "true or false",
    "string_type": "a text",
    "literal_error": "{expected}",
    "too_short": "{min_length} entries",
    "too_long": "{max_length} entries",
    "tuple_type": "a list",
    "dict_type": "a mapping",
    "model_type": "a mapping of keys to values",
    "model_attributes_type": "a mapping of keys to values",
    "int_from_float": "a whole number",
}


def _number(value: Any) -> Any:
    return f"{value:g}" if isinstance(value, float) else value


def _shown(value: Any) -> Any:
    return "nothing" if value is None else value


def _place(loc: tuple[int | str, ...], data: Any, kind: str) -> tuple[list[str], Any]:
    """The dotted field as the file spells it (pydantic also lists union tags) and its value."""
    names: list[str] = []
    node = data
    for index, part in enumerate(loc):
        found = (isinstance(node, Mapping) and part in node) or (
            isinstance(node, list) and isinstance(part, int) and part < len(node)
        )
        if found:
            node = node[part]
            names.append(str(part))
        elif kind == "missing" and index == len(loc) - 1:
            names.append(str(part))
            node = None
    return names, node


def impossible(message: str, allowed: str) -> PydanticCustomError:
    """An error for a validator: values that are numbers in range but make no sense together."""
    return PydanticCustomError("impossible", message, {"allowed": allowed})
