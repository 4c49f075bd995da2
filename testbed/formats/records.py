"""Named records: what a compiled loop steps, each quantity declared once with its unit and meaning.

    class Chamber(Record):
        pressure = quantity("Pa", "absolute pressure")
        oil = quantity("m3", "oil at atmospheric pressure")

    class Cylinder(Record):
        chambers = part(Chamber, "two chambers", per=("a", "b"))
        friction = quantity("N", "seal and guide friction, against + rate")

    cylinders = Cylinder.zeros(12)              # a NumPy structured array
    cylinders["chambers"]["pressure"][:, 0]     # all at once, in Python
    cylinders[3].chambers[0].pressure           # one of them, in Python or in a compiled function

A record's NumPy dtype, its column names in a recording and its table for people all follow from the
declaration, so that a new field may stand anywhere in it. In the signature of a compiled function
`cylinder: Cylinder` is one record and `cylinders: Records[Cylinder]` an array (n,) of them: a type
checker then knows every field and its kind.

Compiled functions take arrays of records from Python (an array costs the caller 0.2 us, a single
record 0.9 us) and hand single records on, which costs nothing. But a single record does not keep
its array alive there: what a compiled function allocates for itself it hands on as an array, and
the callee takes `[0]`.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, field
from itertools import product
from operator import itemgetter
from typing import Any, ClassVar, Literal, Protocol, TypeVar, overload

import numpy as np
from numpy.typing import NDArray

from testbed.formats.arrays import Array

SET = 0.5
"""A flag is recorded as a number: above this it is set."""
FLOAT_BYTES = np.dtype(np.float64).itemsize


@dataclass(frozen=True)
class Field:
    """One quantity of a record: unit, meaning, and the names along each of its axes (none: a single
    number).
    """

    unit: str
    meaning: str
    labels: tuple[tuple[str, ...], ...] = ()
    kind: str = "f8"
    record: type[Record] | None = field(default=None)
    column: str | None = None
    """How its columns begin where they do not begin with its own name."""
    units: Mapping[str, str] = field(default_factory=dict)
    """Unit of the columns that end so, where it is another."""

    @property
    def shape(self) -> tuple[int, ...]:
        """Length of each axis; () for a single number."""
        return tuple(len(names) for names in self.labels)


@dataclass(frozen=True)
class Column:
    """One number of a record as a column of a table."""

    name: str
    unit: str
    meaning: str


R = TypeVar("R", bound="Record")
R_co = TypeVar("R_co", bound="Record", covariant=True)


class Records(Protocol[R_co]):
    """An array (n,) of records of one kind, in a signature."""

    @property
    def shape(self) -> tuple[int, ...]:
        """(n,)."""
        ...

    def __len__(self) -> int: ...

    def __getitem__(self, index: int | tuple[int, ...], /) -> R_co: ...


@overload
def quantity(
    unit: str, meaning: str, *, kind: Literal["f8"] = ..., units: Mapping[str, str] = ...
) -> float: ...


@overload
def quantity(
    unit: str, meaning: str, *, kind: Literal["i8"], units: Mapping[str, str] = ...
) -> int: ...


@overload
def quantity(
    unit: str,
    meaning: str,
    *,
    per: tuple[Any, ...] | int,
    kind: str = ...,
    units: Mapping[str, str] = ...,
) -> Array: ...


def quantity(
    unit: str,
    meaning: str,
    *,
    per: tuple[Any, ...] | int = (),
    kind: str = "f8",
    units: Mapping[str, str] | None = None,
) -> Any:
    """Declare a number, or an array of them with names along its axes.

    per: names along one axis (`per=LEGS`, `per=("x", "y")`), a tuple of such tuples for several
    axes (`per=(LEGS, ("x", "y", "z"))`), or a plain length in the place of names.
    kind: NumPy's kind of number, "f8" or "i8".
    units: how a label ends -> its unit, where that is not `unit` (`units={"_rotation": "rad"}`).
    """
    return Field(unit, meaning, _labels(per), kind, units=dict(units or {}))


@overload
def part(record: type[R], meaning: str, *, column: str = ...) -> R: ...


@overload
def part(
    record: type[R], meaning: str, *, per: tuple[Any, ...] | int, column: str = ...
) -> Records[R]: ...


def part(
    record: type[Record],
    meaning: str,
    *,
    per: tuple[Any, ...] | int = (),
    column: str | None = None,
) -> Any:
    """Declare a record within a record, or an array of them.

    column: how the names of its columns begin; its own name if not given.
    """
    return Field("", meaning, _labels(per), record=record, column=column)


def _labels(per: tuple[Any, ...] | int) -> tuple[tuple[str, ...], ...]:
    if isinstance(per, int):
        return (tuple(str(index) for index in range(per)),)
    if all(isinstance(names, str) for names in per):
        return (tuple(per),) if per else ()
    return tuple(_labels(names)[0] for names in per)


class SingleRecord(np.void):  # type: ignore[misc]
    """One record in Python: its fields are attributes, whatever else NumPy calls so (`mean`,
    `sum`).

    Each Record has a class of its own that derives from this one. It is no np.record, which takes
    ten times as long to find a field.
    """


def _single(record: type[Record]) -> type[SingleRecord]:
    """The class of one record in Python, found by its name when a copy of it is unpacked in another
    process.
    """
    fields = {name: property(itemgetter(name), _setter(name)) for name in record.fields}
    found = {"__module__": record.__module__, "__qualname__": f"{record.__qualname__}.Single"}
    return type("Single", (SingleRecord,), found | fields)


def _setter(name: str) -> Callable[[Any, Any], None]:
    def put(single: Any, value: Any) -> None:
        single[name] = value

    return put


class Record:
    """Base of all records; see the module. Subclasses hold declarations only; those of their bases
    come first.
    """

    fields: ClassVar[dict[str, Field]] = {}
    dtype: ClassVar[np.dtype[Any]]
    Single: ClassVar[type[SingleRecord]]
    """Class of one such record in Python."""
    _floats_alone: ClassVar[bool]

    def __init_subclass__(cls) -> None:
        """Build the NumPy dtype from the declarations, in their order."""
        inherited = {
            name: item
            for base in cls.__bases__
            for name, item in vars(base).get("fields", {}).items()
        }
        own = {name: item for name, item in vars(cls).items() if isinstance(item, Field)}
        cls.fields = inherited | own
        kinds = [
            (name, item.record.dtype if item.record else item.kind, item.shape)
            for name, item in cls.fields.items()
        ]
        cls.Single = _single(cls)
        cls.dtype = np.dtype((cls.Single, kinds))
        cls._floats_alone = all(kind.base.kind == "f" for kind in _leaf_types(cls))

    @classmethod
    def _check_floats(cls) -> None:
        """Raises TypeError where a field is not a float."""
        if not cls._floats_alone:
            raise TypeError(f"{cls.__name__} holds more than floats")

    @classmethod
    def zeros(cls, *shape: int) -> NDArray[Any]:
        """An array of such records, all numbers zero; shape (1,) if none is given."""
        return np.zeros(shape or (1,), cls.dtype)

    @classmethod
    def one(cls, **values: Any) -> NDArray[Any]:
        """An array of one such record with these values; every field must be given.

        Raises TypeError for a field that is missing or that there is not.
        """
        if set(values) != set(cls.fields):
            wrong = sorted(set(values) ^ set(cls.fields))
            raise TypeError(f"{cls.__name__}: {', '.join(wrong)} missing or unknown")
        out = cls.zeros()
        for name, value in values.items():
            out[name][0] = value
        return out

    @classmethod
    def of(cls, **values: Any) -> Any:
        """One such record with these values; what is not given is zero."""
        record = cls.zeros()[0]
        for name, value in values.items():
            record[name] = value
        return record

    @classmethod
    def columns(cls) -> list[Column]:
        """Every number in order of memory, named `quantity_label_label`; parts lead with their own
        name.
        """
        return list(_columns(cls, ""))

    @classmethod
    def column_names(cls) -> list[str]:
        """Names of `columns`."""
        return [column.name for column in cls.columns()]

    @classmethod
    def as_table(cls, records: NDArray[Any]) -> Array:
        """Records (n,) of floats alone as a table (n, columns) that shares their memory.

        Raises TypeError where a field is not a float: then there is no such table.
        """
        cls._check_floats()
        return records.view(np.float64).reshape(len(records), cls.dtype.itemsize // FLOAT_BYTES)

    @classmethod
    def part_as_table(cls, records: NDArray[Any], name: str) -> Array:
        """One part of records (n,) as a table (n, columns of the part) that shares their memory."""
        inner = cls.fields[name].record
        if inner is None:
            raise TypeError(f"{name} is no record within {cls.__name__}")
        start = cls.dtype.fields[name][1] // FLOAT_BYTES  # type: ignore[index]
        return cls.as_table(records)[:, start : start + inner.dtype.itemsize // FLOAT_BYTES]

    @classmethod
    def from_table(cls, table: Array) -> NDArray[Any]:
        """The rows of a table (n, columns) as records (n,) of floats; they share its memory where
        they can.
        """
        cls._check_floats()
        return np.ascontiguousarray(table).view(cls.dtype).reshape(len(table))


def from_columns(
    record: type[Record], columns: Mapping[str, Array], rows: int, **defaults: Any
) -> NDArray[Any]:
    """Records (rows,) from a table's columns by name; a field whose columns are missing is its
    default, or 0.
    """
    out = record.zeros(rows)
    for name, value in defaults.items():
        out[name] = value
    table = record.as_table(out)
    for index, name in enumerate(record.column_names()):
        if name in columns:
            table[:, index] = columns[name]
    return out


def _leaf_types(record: type[Record]) -> Iterator[np.dtype[Any]]:
    for item in record.fields.values():
        if item.record is None:
            yield np.dtype(item.kind)
        else:
            yield from _leaf_types(item.record)


def _columns(record: type[Record], prefix: str) -> Iterator[Column]:
    for name, item in record.fields.items():
        for labels in product(*item.labels):
            full = "_".join((prefix + (item.column or name), *labels))
            if item.record is None:
                unit = next(
                    (unit_ for end, unit_ in item.units.items() if full.endswith(end)), item.unit
                )
                yield Column(full, unit, item.meaning)
            else:
                yield from _columns(item.record, full + "_")


def get(records: Any, path: str) -> Any:
    """The field of records (an array or one of them) by its dotted path, such as
    "chambers.pressure".
    """
    for name in path.split("."):
        records = records[name]
    return records


def put(records: Any, path: str, value: Any) -> None:
    """Set the field of records (an array or one of them) by its dotted path."""
    way, _, last = path.rpartition(".")
    (get(records, way) if way else records)[last] = value
