"""All scalar filters by name: the published two, their rivals, and the testbed's own."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from testbed.estimation.filters import (
    chi_square,
    huber,
    kbf,
    modified_kbf,
    persistent,
    saturated,
    student_t,
)

Run = Callable[[NDArray[np.float64], NDArray[np.float64]], NDArray[np.float64]]


@dataclass(frozen=True)
class Filter:
    """A filter as it is compared: `constants` are the values of its own parameters that it may choose from."""

    name: str
    run: Run
    constants: tuple[tuple[float, ...], ...]
    meaning: str

    def __call__(
        self, z_n: NDArray[np.float64], q_n2: float, r_n2: float, constant: tuple[float, ...] = ()
    ) -> NDArray[np.float64]:
        """Filter z[n] in N with this Q and R and one of its constants (the first one where none is given)."""
        return self.run(z_n, np.array([q_n2, r_n2, *(constant or self.constants[0])]))


RIVALS: tuple[Filter, ...] = (
    Filter("kf", kbf.run, ((),), "plain Kalman filter, the paper's KBF"),
    Filter("modified_kbf", modified_kbf.run, ((300.0,), (180.0,), (240.0,), (600.0,)), "e_max N"),
    Filter("chi_square", chi_square.run, ((6.63,), (3.84,), (10.83,), (25.0,)), "limit of e^2 / S"),
    Filter("huber", huber.run, ((1.345,), (0.7,), (2.0,), (3.0,)), "c"),
    Filter("saturated", saturated.run, ((300.0,), (90.0,), (180.0,), (600.0,)), "limit N"),
    Filter("student_t", student_t.run, ((4.0,), (2.0,), (8.0,), (30.0,)), "nu"),
)
OWN = Filter("own", persistent.run, ((300.0, 10.0),), "e_max N, hold samples")
