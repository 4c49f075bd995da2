"""Figure 6: the vertical joint in the air, sinusoidal speed, chamber A alone."""

from __future__ import annotations

import numpy as np

from testbed.benchmarks.paper.experiment import (
    Array,
    Experiment,
    Line,
    Panel,
    at_least,
    between,
)
from testbed.benchmarks.paper.figure_04 import (
    CELL_AT_M,
    K_PA_PER_V,
    Regression,
    held_samples,
    press,
    straight_line,
)
from testbed.benchmarks.paper.leg import MASS_KG, Trace, run, sinusoid
from testbed.benchmarks.paper.machine import once_per_machine
from testbed.machine.names import GRAVITY_M_S2
from testbed.report.tables import Table

WEIGHT_N = MASS_KG * GRAVITY_M_S2
PAPER_PEAK_N = 2100.0
SUPPLIES_PA = (6.0e6, 7.5e6, 9.0e6)
EDGES = (0.5, 0.75, 1.0)
"""Valve edges P-B and B-T relative to P-A and A-T."""
CALIBRATIONS = (
    "a = 1, b = 0",
    "b absorbs",
    "b absorbs, weight kept",
    "a and b absorb",
    "a and b absorb, weight kept",
)
"""What becomes of pA A_A: nothing; slope one and the mean offset at the cell; both of the regression (2).
'Weight kept': the regression is made on the cell's reading less the frame's weight, so that a hanging frame shows."""


@once_per_machine
def in_the_air(supply_pa: float = 9.0e6, edge: float = 0.75) -> Trace:
    """The sinusoid after its first cycle: 0.1 m at 0.1 Hz, foot off the ground."""
    return run(sinusoid(), _changes(supply_pa, edge)).after(1.0 + 10.0)


@once_per_machine
def at_the_cell(supply_pa: float = 9.0e6, edge: float = 0.75) -> tuple[float, Regression]:
    """What b absorbs at slope one, N (mean of F_cell - pA A_A over the held loads), and the regression (2)."""
    trace = run(press(), _changes(supply_pa, edge), cell_at_m=CELL_AT_M)
    held = held_samples(trace)
    line = straight_line(trace.read_a_pa[held] / K_PA_PER_V, trace.load_n[held], trace.area_a_m2)
    return float(np.mean(trace.load_n[held] - trace.one_chamber_n[held])), line


def absorbed_n(supply_pa: float = 9.0e6, edge: float = 0.75) -> float:
    """What b absorbs at slope one, N."""
    return at_the_cell(supply_pa, edge)[0]


def _changes(supply_pa: float, edge: float) -> dict[str, float]:
    return {
        "power_unit.supply_pressure_pa": supply_pa,
        "power_unit.accumulator_precharge_pa": supply_pa * 2.0 / 3.0,
        "power_unit.relief_pressure_pa": supply_pa + 8.0e5,
        "valve.edge_pb": edge,
        "valve.edge_bt": edge,
    }


def calibrated_n(
    trace: Trace, calibration: str, supply_pa: float = 9.0e6, edge: float = 0.75
) -> Array:
    """The one-chamber force (n), N, under one of CALIBRATIONS."""
    if calibration == CALIBRATIONS[0]:
        return trace.one_chamber_n
    offset, line = at_the_cell(supply_pa, edge)
    weight = WEIGHT_N if calibration.endswith("kept") else 0.0
    if calibration.startswith("b"):
        return np.asarray(trace.one_chamber_n + offset - weight)
    return np.asarray(line.a * trace.one_chamber_n + line.b * K_PA_PER_V * trace.area_a_m2 - weight)


def peak_n(force_n: Array) -> float:
    """Largest size of a force (n), N, smoothed over 20 ms so that noise makes no peak."""
    return float(np.abs(np.convolve(force_n, np.ones(20) / 20.0, "valid")).max())


def experiment() -> Experiment:
    """Peaks for every supply pressure, edge ratio and calibration; the declared machine is one row of them."""
    rows, peaks = [], {}
    for supply in SUPPLIES_PA:
        for edge in EDGES:
            trace = in_the_air(supply, edge)
            for name in CALIBRATIONS:
                peaks[supply, edge, name] = peak_n(calibrated_n(trace, name, supply, edge))
            rows.append(
                [
                    f"{supply / 1e5:.0f}",
                    f"{edge:g}",
                    f"{trace.pressure_b_pa.mean() / 1e5:.1f}",
                    f"{absorbed_n(supply, edge):.0f}",
                    *(f"{peaks[supply, edge, n]:.0f}" for n in CALIBRATIONS),
                ]
            )
    nearest = min(peaks, key=lambda k: abs(peaks[k] - PAPER_PEAK_N))
    trace = in_the_air()
    force = calibrated_n(trace, CALIBRATIONS[3])
    declared = peak_n(force)
    t = trace.time_s - trace.time_s[0]
    return Experiment(
        "6",
        "Chamber A alone, foot in the air",
        "The vertical joint moves in the air with sinusoidal speed. The force from chamber A alone has peaks of about "
        "2100 N where the frame weighs 900 N.",
        "0.1 m at 0.1 Hz (speed and frequency assumed: the paper's are not published), cold oil, position loop with "
        "0.1 mm counts. a and b come from the load cell run of figure 4.",
        [
            at_least(
                "6",
                "the one-chamber force exceeds the moving weight (declared machine, peak over weight)",
                1.5,
                declared / WEIGHT_N,
                "1",
            ),
            between(
                "6",
                "peaks of about 2100 N on the declared machine (90 bar, edges 0.75, regression (2))",
                0.8 * PAPER_PEAK_N,
                1.2 * PAPER_PEAK_N,
                declared,
                "N",
            ),
            between(
                "6",
                "the same where only b is fitted and a = 1",
                0.8 * PAPER_PEAK_N,
                1.2 * PAPER_PEAK_N,
                peaks[9.0e6, 0.75, CALIBRATIONS[1]],
                "N",
            ),
            between(
                "6",
                "the same with a = 1, b = 0",
                0.8 * PAPER_PEAK_N,
                1.2 * PAPER_PEAK_N,
                peaks[9.0e6, 0.75, CALIBRATIONS[0]],
                "N",
            ),
        ],
        [
            Panel(
                "one-chamber force",
                "time [s]",
                "F [N]",
                [
                    Line(t[::10], force[::10], "chamber A (1), regression (2)"),
                    Line(t[::10], np.full(len(t[::10]), PAPER_PEAK_N), "2100 N", 2, "--"),
                    Line(
                        t[::10],
                        np.full(len(t[::10]), -WEIGHT_N),
                        "weight of the frame (pulls)",
                        3,
                        "--",
                    ),
                ],
            ),
            Panel(
                "pressures",
                "time [s]",
                "p [bar]",
                [
                    Line(t[::10], trace.read_a_pa[::10] / 1e5, "A"),
                    Line(t[::10], trace.read_b_pa[::10] / 1e5, "B", 1),
                ],
            ),
        ],
        [
            Table(
                "Peak of the one-chamber force, N",
                ["supply [bar]", "edges B / A", "mean pB [bar]", "b absorbs [N]", *CALIBRATIONS],
                rows,
            )
        ],
        [
            f"Nearest to 2100 N: {nearest[0] / 1e5:.0f} bar, edges {nearest[1]:g}, {nearest[2]}: {peaks[nearest]:.0f} N. "
            "Supply pressure and valve are not published, so this says which assumptions give the figure, not which "
            "were true. 'b absorbs' keeps a = 1; 'a and b' is the regression (2) as it stands. 'Weight kept': the "
            "regression is made on the cell's reading less the frame's weight, so that the force shows the hanging frame.",
            "No number of the machine was changed for this: the declared one is the row 90 bar, 0.75. But the convention "
            "of the calibration decides, and it is not known here which one the paper's force had; the regression (2) "
            "with both a and b is taken as the paper writes it, and the other two stand beside it. This "
            "choice was made after the first one (b alone absorbs) had missed 2100 N: the figure is reproducible under "
            "one convention, not predicted.",
        ],
    )
