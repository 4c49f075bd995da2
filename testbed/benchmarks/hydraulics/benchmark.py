"""The compiled hydraulics against SciPy's Radau: random manoeuvres, masses that move freely, books
of oil and energy.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from testbed.benchmarks.harness import Answers, Benchmark
from testbed.benchmarks.hydraulics.balance import balance, creep
from testbed.benchmarks.hydraulics.free_mass import (
    FREE_MOTIONS,
    MOST_N,
    MOST_RMS_N,
    compare_free,
)
from testbed.benchmarks.hydraulics.reference import machine_of_both, solve
from testbed.formats.arrays import Array
from testbed.formats.files import write_text
from testbed.laws.axis_records import AxisInput
from testbed.laws.hydraulics import hydraulic_step
from testbed.laws.initial import start_axes, start_supply
from testbed.report.page import Table
from testbed.scenario.parts import Rates
from testbed.world.hydraulic_parameters import axis_parameters, unit_parameters
from testbed.world.switches import switch_off

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


# Random manoeuvres of an axis: smooth prescribed motion with valve commands that could have caused
# it.

KINDS = ("reversals", "sticking", "dead band", "end stop", "starved supply", "near vapour pressure")
HOLD_S = 0.05
"""Commands are held this long."""
OTHERS = 2
"""Axes beside the one under test that draw from the same supply where it is starved."""


@dataclass(frozen=True)
class Manoeuvre:
    """What kernel and reference are both given; way points (m) of all axes at times (s), joined
    smoothly.
    """

    kind: str
    axes: NDArray[Any]
    params: NDArray[Any]
    supply: Any
    unit: Any
    times: Array
    points: Array
    commands: Array

    @property
    def duration_s(self) -> float:
        """Simulated time, s."""
        return len(self.commands) * HOLD_S

    def motion(self, t: float) -> tuple[Array, Array]:
        """Extensions (n), m, and rates (n), m/s: twice continuously differentiable."""
        k = min(int(np.searchsorted(self.times, t, side="right")) - 1, len(self.times) - 2)
        span = self.times[k + 1] - self.times[k]
        s = min(max((t - self.times[k]) / span, 0.0), 1.0)
        rise = self.points[k + 1] - self.points[k]
        shape, slope = s**3 * (10 - 15 * s + 6 * s * s), 30 * s * s * (1 - s) ** 2
        return self.points[k] + rise * shape, rise * slope / span


def manoeuvre(number: int, duration_s: float = 1.5) -> Manoeuvre:
    """Manoeuvre `number` (0, 1, ...): kinds take turns, everything else is drawn from its
    number.
    """
    rng = np.random.default_rng([20090714, number])
    kind = KINDS[number % len(KINDS)]
    machine = machine_of_both()
    n = 1 + OTHERS if kind == "starved supply" else 1
    params = axis_parameters(machine)[[2, 5, 8][:n]].copy()
    unit = unit_parameters(machine)
    switch_off(["oil_warming"], params, unit)  # the reference holds the oil's temperature
    if kind == "starved supply":
        unit.pump_flow *= rng.uniform(0.05, 0.25)
        unit.accumulator_volume *= rng.uniform(0.02, 0.2)
    segments = round(duration_s / HOLD_S)
    times, points = _way(kind, rng, n, params[0].stroke, duration_s)
    supply = start_supply(unit, rng.uniform(10.0, 60.0), 0.06)
    supply.traction_flow = rng.uniform(0.0, 1e-4)
    mean_pa = rng.uniform(2e6, 5e6) if kind != "near vapour pressure" else rng.uniform(2e5, 6e5)
    axes = start_axes(
        params, points[0], rng.uniform(0.0, 12e3 * min(1.0, mean_pa / 2e6), n), mean_pa / 3.0
    )
    draft = Manoeuvre(kind, axes, params, supply, unit, times, points, np.zeros((segments, n)))
    return Manoeuvre(kind, axes, params, supply, unit, times, points, _commands(draft, rng))


def _way(
    kind: str, rng: np.random.Generator, n: int, stroke: float, duration_s: float
) -> tuple[Array, Array]:
    """Times (k) and way points (k, n)."""
    count = int(rng.integers(5, 9))
    times = np.linspace(0.0, duration_s, count)
    times[1:-1] += rng.uniform(-0.3, 0.3, count - 2) * duration_s / count
    step = {
        "reversals": 0.03,
        "sticking": 0.01,
        "dead band": 0.004,
        "end stop": 0.02,
        "starved supply": 0.05,
    }
    points = rng.uniform(0.15, stroke - 0.15, n) + np.cumsum(
        rng.uniform(-1.0, 1.0, (count, n)) * step.get(kind, 0.0), axis=0
    )
    # Pulled off the oil with the valve in its dead band, and back.
    if kind == "near vapour pressure":
        points[1::2] = points[0] + rng.uniform(0.001, 0.006, points[1::2].shape)
    if kind == "sticking":  # rest between the moves
        points[1::2] = points[0:-1:2]
    if kind == "end stop":  # into one of the stops by some tens of micrometres, and away again
        stop, sign = (0.0, 1.0) if rng.random() < 0.5 else (stroke, -1.0)
        points = stop + sign * rng.uniform(0.01, 0.05, (count, n))
        points[count // 2] = stop - sign * rng.uniform(2e-5, 1.5e-4)
    return times, np.clip(points, -2e-4, stroke + 2e-4)


def _commands(manoeuvre: Manoeuvre, rng: np.random.Generator) -> Array:
    """What would drive the motion, held; off by a random factor, at rest somewhere in the dead
    band.
    """
    segments, n = manoeuvre.commands.shape
    out = np.zeros((segments, n))
    for index in range(segments):
        _, v = manoeuvre.motion((index + 0.7) * HOLD_S)
        for i, param in enumerate(manoeuvre.params):
            area, gain = (
                (param.a.area, param.a.from_supply)
                if v[i] > 0.0
                else (param.a.area, param.a.to_tank)
            )
            wanted = v[i] * area / (gain * np.sqrt(3.0e6)) * rng.uniform(0.9, 1.8)
            band = param.valve.dead_band
            if abs(v[i]) < 2e-4 or manoeuvre.kind == "near vapour pressure":
                out[index, i] = band * rng.uniform(-0.9, 0.9)
            elif manoeuvre.kind == "dead band":
                out[index, i] = band * rng.uniform(0.6, 1.8) * np.sign(v[i])
            else:
                out[index, i] = np.clip(wanted * (1.0 - band) + band * np.sign(v[i]), -1.0, 1.0)
    return out
