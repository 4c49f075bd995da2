"""The socket of force estimators: a foot load from every row, live and over a recording.

An estimator is any class with `update(row) -> loads (4,)`, N along the vertical joints' axes,
positive when the ground pushes a foot up; or `-> (loads, low, high)` with the ends of its 90 %
interval. `row` is a DataRow (recording/rows.py): what was measured, and the shipped estimates
beside it; a copy, which may be kept and written to. It may have `start(dt_s)`, called before the
first row with the seconds between two.

The shipped methods go by the names of `row.estimate`.
"""

from __future__ import annotations

from typing import Any, Protocol

import numpy as np
from numpy.typing import NDArray

from testbed.errors import InputError
from testbed.formats.arrays import Array
from testbed.formats.sockets import FORM, is_user_class, load_object, numbers_of
from testbed.machine.names import LEGS
from testbed.recording.rows import METHODS

SHIPPED = "own"
"""The method that control goes by unless a scenario says otherwise: the whole-body estimate."""

MEASURED = ("position", "pressure_a", "pressure_b")
"""Of a row in which one of these is missing no estimator can be asked for a load."""


class Estimator(Protocol):
    """The socket."""

    def update(self, row: Any) -> Any:
        """Loads (4,) of this row, N; or loads, low and high."""
        ...


class Method:
    """A shipped method, which the chain has put into the row already."""

    def __init__(self, name: str) -> None:
        self._name = name

    def update(self, row: Any) -> Any:
        """Its loads (4,), N; with the interval where it has one."""
        loads = row["estimate"][self._name]
        if self._name != SHIPPED:
            return loads
        return loads, row["estimate_own"]["low"], row["estimate_own"]["high"]


def estimator_of(name: str, field: str = "estimator") -> Any:
    """A shipped method by its name, or an object of the class that `FILE.py:Class` names.

    Raises InputError for an unknown name, a file or class that is not there or does not fit
    (Estimator).
    """
    if is_user_class(name):
        return load_object(name, Estimator, field=field)
    if name in METHODS:
        return Method(name)
    raise InputError(
        "no such estimator", field=field, value=name, allowed=", ".join([*METHODS, FORM])
    )


def interval_of(answer: Any, estimator: object) -> tuple[Array, Array, Array]:
    """Loads, low and high (4,) of what an estimator answered; without an interval low and high are
    the loads.

    Raises InputError for an answer of another form.
    """
    parts = answer if isinstance(answer, tuple) and len(answer) == 3 else (answer,) * 3
    loads, low, high = (numbers_of(part, (len(LEGS),), estimator, "loads") for part in parts)
    return loads, low, high


def answer_of(
    estimator: Estimator, row: Any, field: str = "estimator", value: str | None = None
) -> tuple[Array, Array, Array]:
    """Loads, low and high (4,), N, by a user's estimator from one DataRow, which it may keep.

    Raises InputError, in `field`, for loads that are no numbers though every cylinder was measured,
    and for ends of an interval that are turned round.
    """
    measured = all(np.isfinite(row[name]).all() for name in MEASURED)
    loads, low, high = interval_of(estimator.update(row), estimator)
    named = value or type(estimator).__name__
    if measured and not np.isfinite([loads, low, high]).all():
        raise InputError(
            f"a load is no number at t = {row['t']:.3f} s",
            field=field,
            value=named,
            allowed="finite loads, N",
        )
    if (low > high).any():
        raise InputError(
            f"an interval ends below its beginning at t = {row['t']:.3f} s",
            field=field,
            value=named,
            allowed="loads, low, high",
        )
    return loads, low, high


def intervals_over(estimator: Estimator, rows: NDArray[Any]) -> Array:
    """An estimator's loads, low and high, N, over DataRow records (n,), one after the other: (n, 3,
    4).

    Raises InputError as answer_of.
    """
    if isinstance(estimator, Method):
        answers = [interval_of(estimator.update(row), estimator) for row in rows]
    else:
        answers = [answer_of(estimator, row) for row in rows.copy()]
    return np.array(answers, dtype=np.float64).reshape(-1, 3, len(LEGS))


def loads_over(estimator: Estimator, rows: NDArray[Any]) -> Array:
    """An estimator's loads (n, 4), N, over DataRow records (n,), one after the other."""
    loads: Array = intervals_over(estimator, rows)[:, 0]
    return loads
