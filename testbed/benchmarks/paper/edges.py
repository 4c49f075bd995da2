"""Figure 5's decay against the leakage of the valve's shut edges: where it appears, and what figure 6 says there."""

from __future__ import annotations

from testbed.benchmarks.paper.decay import raising_step
from testbed.benchmarks.paper.figure_06 import CALIBRATIONS, calibrated_n, in_the_air, peak_n
from testbed.benchmarks.paper.machine import changed
from testbed.report.tables import Table

TANK_M3_S_PA = (3.0e-14, 1.0e-13, 3.0e-13)
RATIOS = (0.0, 0.05, 0.2, 0.4, 1.0)
"""Leakage of an edge from the supply over that to the tank."""
HOLD_S = 12.0
"""Time between two raising steps of the robot in figure 5."""


def edges(tank_m3_s_pa: float, ratio: float) -> dict[str, float]:
    """Changes of roboclimber.yaml."""
    return {
        "valve.edge_at_leakage_m3_s_pa": tank_m3_s_pa,
        "valve.edge_bt_leakage_m3_s_pa": tank_m3_s_pa,
        "valve.edge_pa_leakage_m3_s_pa": ratio * tank_m3_s_pa,
        "valve.edge_pb_leakage_m3_s_pa": ratio * tank_m3_s_pa,
    }


def sensitivity() -> Table:
    """For every leakage to the tank and ratio: what is left of one leg's back pressure, and figure 6's peak."""
    rows = []
    for tank in TANK_M3_S_PA:
        row = [f"{tank:.0e}"]
        for ratio in RATIOS:
            decay = raising_step(edges(tank, ratio), seconds=HOLD_S)
            with changed(edges(tank, ratio)):
                peak = peak_n(calibrated_n(in_the_air(), CALIBRATIONS[3]))
            row.append(f"{100.0 * decay.gone:+.0f} %, {peak / 1e3:.1f} kN")
        rows.append(row)
    heads = ["to the tank [m3/(s Pa)]", *(f"supply / tank {r:g}" for r in RATIOS)]
    return Table(
        f"What goes of one leg's excess over the weight within {HOLD_S:g} s after a raising step; figure 6's peak "
        "with the same edges (paper: 2.1 kN)",
        heads,
        rows,
    )
