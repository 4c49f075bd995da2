"""All scalar filters by name: the published two, their rivals, and the testbed's own."""

from __future__ import annotations

from dataclasses import dataclass

from testbed.estimation.filters import (
    chi_square,
    huber,
    kbf,
    modified_kbf,
    persistent,
    saturated,
    student_t,
)
from testbed.estimation.filters.base import Run
from testbed.formats.arrays import Array


@dataclass(frozen=True)
class Filter:
    """A filter as it is compared: `constant` is the one of its own that it may choose, from
    `values`.
    """

    name: str
    run: Run
    constant: str = ""
    values: tuple[float, ...] = ()
    fixed: tuple[tuple[str, float], ...] = ()
    """Further constants, by name."""

    @property
    def choices(self) -> tuple[dict[str, float], ...]:
        """The constants that it may choose from, by name; the usual ones first."""
        rest = dict(self.fixed)
        return tuple({self.constant: value} | rest for value in self.values) or (rest,)

    def __call__(
        self,
        z_n: Array,
        q_n2: float,
        r_n2: float,
        constants: dict[str, float] | None = None,
    ) -> Array:
        """Filter z[n] in N with this Q and R and one of its choices (the first one where none is
        given).
        """
        chosen = self.choices[0] if constants is None else constants
        return self.run(z_n, process_variance=q_n2, measurement_variance=r_n2, **chosen)


RIVALS: tuple[Filter, ...] = (
    Filter("kf", kbf.run),
    Filter("modified_kbf", modified_kbf.run, "innovation_limit", (300.0, 180.0, 240.0, 600.0)),
    Filter("chi_square", chi_square.run, "limit", (6.63, 3.84, 10.83, 25.0)),
    Filter("huber", huber.run, "corner", (1.345, 0.7, 2.0, 3.0)),
    Filter("saturated", saturated.run, "limit", (300.0, 90.0, 180.0, 600.0)),
    Filter("student_t", student_t.run, "freedom", (4.0, 2.0, 8.0, 30.0)),
)
OWN = Filter("own", persistent.run, "innovation_limit", (300.0,), (("hold_samples", 10.0),))
