"""`loop.html`: what believing a diagnosis does to the foot-force error, leg by leg."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

from testbed.machine.names import LEGS
from testbed.report.page import render
from testbed.report.style import BLUE, GREY, RC, svg


def page(rows: Sequence[Mapping[str, Any]]) -> str:
    """The page's text."""
    return render("loop.html.j2", {"rows": rows, "figure": figure(rows)})


def figure(rows: Sequence[Mapping[str, Any]]) -> str:
    """Foot-force error of each leg, first run grey, next run blue; SVG text."""
    import matplotlib.pyplot as plt

    with plt.rc_context(RC):  # type: ignore[arg-type]
        drawing, panels = plt.subplots(
            1, len(rows), figsize=(2.2 * len(rows), 2.3), sharey=True, squeeze=False
        )
        for panel, row in zip(panels[0], rows, strict=True):
            for k, (stage, colour) in enumerate((("before", GREY), ("after", BLUE))):
                heights = [row["by_leg_n"][stage][leg] for leg in LEGS]
                label = "first run" if stage == "before" else "next run"
                panel.bar(
                    [i + 0.38 * k - 0.19 for i in range(len(LEGS))],
                    heights,
                    0.36,
                    color=colour,
                    label=label,
                )
            panel.set_xticks(range(len(LEGS)), LEGS)
            panel.set_title(row["scenario"].replace("stand_", "").replace("undeclared_", ""))
        panels[0][0].set_ylabel("foot-force error, N RMS")
        panels[0][0].legend(loc="upper right")
        drawing.tight_layout()
        text = svg(drawing, "loop")
        plt.close(drawing)
    return text
