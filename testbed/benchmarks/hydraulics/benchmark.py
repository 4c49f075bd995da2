"""The compiled hydraulics against SciPy's Radau: random manoeuvres, masses that move freely, books
of oil and energy.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

import numpy as np

from testbed.benchmarks.harness import Answers, Benchmark
from testbed.benchmarks.hydraulics.balance import balance, creep
from testbed.benchmarks.hydraulics.free_mass import (
    FREE_MOTIONS,
    MOST_N,
    MOST_RMS_N,
    compare_free,
)
from testbed.benchmarks.hydraulics.manoeuvres import HOLD_S, Manoeuvre, manoeuvre
from testbed.benchmarks.hydraulics.reference import solve
from testbed.formats.arrays import Array
from testbed.formats.files import write_text
from testbed.laws.hydraulics import AxisInput, hydraulic_step
from testbed.report.page import Table
from testbed.scenario.parts import Rates

Piece = tuple[str, float | str]
"""What is checked, and its number, name, seconds or switch."""
FULL_FORCE_N = 15e3
STEP_S = 1e-3


@dataclass(frozen=True)
class Difference:
    """Kernel less reference, the axis's mean force over each engine step, N: at the default substep
    and at halves.
    """

    number: int
    kind: str
    rms_n: float
    worst_n: float
    half_rms_n: float
    """Substep halved, and with it the step over which the piston's rate is held."""
    half_worst_n: float
    inner_rms_n: float
    """Substep halved within the same engine step."""
    inner_worst_n: float
    lowest_pressure_pa: float
    lowest_supply_pa: float

    @property
    def holds(self) -> bool:
        """Within 0.3 % (RMS) and 2 % (worst) of 15 kN, and at most half of it at half the substep
        (or below 0.1 N).
        """
        halves = self.half_rms_n <= max(0.5 * self.rms_n, 0.1)
        return self.rms_n < 0.003 * FULL_FORCE_N and self.worst_n < 0.02 * FULL_FORCE_N and halves


def kernel_forces(
    manoeuvre: Manoeuvre, substeps: int, step_s: float = STEP_S
) -> tuple[Array, float, float]:
    """Mean force of the axes over every step, N, (steps, n); lowest chamber and supply pressure, Pa
    absolute.
    """
    axes, supply = manoeuvre.axes.copy(), manoeuvre.supply.copy()
    given = AxisInput.zeros(len(axes))
    steps = round(manoeuvre.duration_s / step_s)
    per_hold = round(HOLD_S / step_s)
    out = np.empty((steps, len(axes)))
    lowest, lowest_supply = np.inf, np.inf
    begin, _ = manoeuvre.motion(0.0)
    for index in range(steps):
        end, _ = manoeuvre.motion((index + 1) * step_s)
        given["extension"], given["rate"] = begin, (end - begin) / step_s
        given["command"] = manoeuvre.commands[index // per_hold]
        hydraulic_step(axes, manoeuvre.params, given, supply, manoeuvre.unit, step_s, substeps)
        out[index] = axes["force"]
        pressures = axes["a"]["pressure"].min(), axes["b"]["pressure"].min()
        lowest = min(lowest, *map(float, pressures))
        lowest_supply = min(lowest_supply, float(supply.pressure))
        begin = end
    return out, lowest, lowest_supply


def compare(
    number: int, substeps: int | None = None, method: str = "Radau", rtol: float = 1e-9
) -> Difference:
    """Manoeuvre `number`: the kernel at `substeps` (default: a scenario's), and finer, against the
    reference.
    """
    steps = Rates().hydraulic_substeps if substeps is None else substeps
    given = manoeuvre(number)
    truth = solve(given, HOLD_S, STEP_S, method=method, rtol=rtol)
    coarse, lowest, lowest_supply = kernel_forces(given, steps)
    inner, _, _ = kernel_forces(given, 2 * steps)
    half, _, _ = kernel_forces(given, steps, STEP_S / 2)
    errors = [
        forces[:, 0] - truth[:, 0] for forces in (coarse, 0.5 * (half[0::2] + half[1::2]), inner)
    ]
    rms = [float(np.sqrt(np.mean(error**2))) for error in errors]
    worst = [float(np.abs(error).max()) for error in errors]
    return Difference(
        number,
        given.kind,
        rms[0],
        worst[0],
        rms[1],
        worst[1],
        rms[2],
        worst[2],
        lowest,
        lowest_supply,
    )


@dataclass(frozen=True)
class Hydraulics(Benchmark[Piece]):
    """`manoeuvres` random manoeuvres, motions of a free mass, and the books of oil and energy over
    `seconds`.
    """

    name = "hydraulics"
    noun = "checks"
    manoeuvres: int = 30
    seconds: float = 600.0
    free_motions: Sequence[str] = tuple(FREE_MOTIONS)

    def cases(self) -> Mapping[str, Piece]:
        """The manoeuvres, the free mass, two balances and two creeping pistons."""
        pieces: dict[str, Piece] = {
            f"manoeuvre {number}": ("manoeuvre", number) for number in range(self.manoeuvres)
        }
        pieces |= {f"free mass: {name}": ("free", name) for name in self.free_motions}
        return pieces | {
            "balance": ("balance", self.seconds),
            "balance_starved": ("balance_starved", self.seconds / 10.0),
            "creep": ("creep", 1),
            "creep_tight": ("creep", 0),
        }

    def work(self, case: Piece) -> Any:
        """One of the checks."""
        kind, value = case
        if kind == "manoeuvre":
            found = compare(int(value))
            return asdict(found) | {"holds": found.holds}
        if kind == "free":
            free = compare_free(str(value))
            return asdict(free) | {"holds": free.holds}
        value = float(value)
        if kind == "creep":
            return creep(leakage=bool(value))
        return balance(value, drive=1.5) if kind == "balance_starved" else balance(value)

    def summarise(self, answers: Answers) -> dict[str, Any]:
        """All manoeuvres in one list, the rest by name."""
        found = [answers.pop(f"manoeuvre {number}") for number in range(self.manoeuvres)]
        free = {name: answers.pop(f"free mass: {name}") for name in self.free_motions}
        return {
            "format": "roboclimber-hydraulics/1",
            "manoeuvres": found,
            "free_mass": free,
            "holds": all(row["holds"] for row in (*found, *free.values())),
            **answers,
        }

    def tables(self, result: dict[str, Any]) -> Sequence[Table]:
        """The manoeuvres, then the books."""
        books = {
            key: value
            for key, value in result.items()
            if isinstance(value, dict) and key != "free_mass"
        }
        return [
            table(result["manoeuvres"]),
            free_table(result["free_mass"]),
            *(
                Table(
                    name,
                    ["figure", "value"],
                    [[key, f"{value:.6g}"] for key, value in book.items()],
                )
                for name, book in books.items()
            ),
        ]

    def write_more(self, result: dict[str, Any], out: Path) -> None:
        """hydraulics.csv: the table of the manoeuvres."""
        _, heads, rows = table(result["manoeuvres"])
        lines = "\n".join(",".join(row) for row in [heads, *rows])
        write_text(out / "hydraulics.csv", lines + "\n")


ERRORS = ("rms_n", "worst_n", "half_rms_n", "half_worst_n", "inner_rms_n", "inner_worst_n")
HEADS = (
    "manoeuvre",
    "kind",
    "RMS [N]",
    "worst [N]",
    "at half: RMS [N]",
    "worst [N]",
    "half within the step: RMS [N]",
    "worst [N]",
    "lowest chamber [bar abs]",
    "lowest supply [bar abs]",
    "holds",
)


def table(found: Sequence[Mapping[str, Any]]) -> Table:
    """The comparison, and a last row with the worst of each."""
    rows = [
        [
            str(row["number"]),
            row["kind"],
            *(f"{row[name]:.2f}" for name in ERRORS),
            f"{row['lowest_pressure_pa'] / 1e5:.3g}",
            f"{row['lowest_supply_pa'] / 1e5:.3g}",
            "yes" if row["holds"] else "NO",
        ]
        for row in found
    ]
    worst = [f"{max(row[name] for row in found):.2f}" for name in ERRORS]
    allowed = f"allowed {0.003 * FULL_FORCE_N:.0f} and {0.02 * FULL_FORCE_N:.0f} N"
    holds = "yes" if all(row["holds"] for row in found) else "NO"
    rows.append(["all", allowed, *worst, "", "", holds])
    return Table("Force of the kernel less the reference's", HEADS, rows)


def free_table(found: Mapping[str, Mapping[str, Any]]) -> Table:
    """Kernel and free mass against the reference, a row a motion."""
    rows = [
        [
            name,
            f"{row['rms_n']:.2f}",
            f"{row['worst_n']:.2f}",
            f"{1e6 * row['worst_m']:.2f}",
            "yes" if row["holds"] else "NO",
        ]
        for name, row in found.items()
    ]
    heads = ["motion", "RMS [N]", "worst [N]", "worst position [um]", "holds"]
    title = (
        f"A mass that moves freely, less the reference's (allowed {MOST_RMS_N:g} and {MOST_N:g} N)"
    )
    return Table(title, heads, rows)
