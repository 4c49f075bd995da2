"""The paper's claims beside what was measured, as a table and as a self-contained page."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any

from testbed import __version__
from testbed.benchmarks.paper.experiment import Claim, Experiment, Panel
from testbed.report.page import Table, render
from testbed.report.style import (
    BLACK,
    BLUE,
    GREEN,
    GREY,
    ORANGE,
    PURPLE,
    RC,
    VERMILION,
    WIDTH_IN,
    svg,
)

PALETTE = (BLUE, VERMILION, GREEN, GREY, ORANGE, PURPLE, BLACK)
PANEL_IN = 2.0


def page(experiments: Sequence[Experiment]) -> str:
    """The page's text."""
    claims = [claim for experiment in experiments for claim in experiment.claims]
    contents = {
        "experiments": [(experiment, drawn(experiment)) for experiment in experiments],
        "measured": measured,
        "total": len(claims),
        "failed": [claim for claim in claims if not claim.holds],
        "version": __version__,
    }
    return render("benchmarks/paper/page.html.j2", contents)


def table(experiments: Sequence[Experiment]) -> Table:
    """All claims."""
    heads = ["figure", "claim", "expected", "measured", "unit", "holds"]
    rows = [
        [
            claim.figure,
            claim.claim,
            claim.criterion,
            measured(claim),
            claim.unit,
            "yes" if claim.holds else "NO",
        ]
        for experiment in experiments
        for claim in experiment.claims
    ]
    return Table("The paper's claims", heads, rows)


def measured(claim: Claim) -> str:
    """The measured number with four digits, or that there is none."""
    return f"{claim.measured:.4g}" if math.isfinite(claim.measured) else "could not be measured"


def drawn(experiment: Experiment) -> str:
    """The experiment's panels below each other, as one SVG."""
    import matplotlib
    from matplotlib.figure import Figure

    with matplotlib.rc_context(RC):  # type: ignore[arg-type]
        count = len(experiment.panels)
        figure = Figure(figsize=(1.7 * WIDTH_IN, PANEL_IN * count + 0.4))
        for axes, panel in zip(
            figure.subplots(count, 1, squeeze=False)[:, 0], experiment.panels, strict=True
        ):
            _draw(axes, panel)
        figure.tight_layout(h_pad=1.2)
        return svg(figure, f"figure{experiment.figure}")


def _draw(axes: Any, panel: Panel) -> None:
    for line in panel.lines:
        colour = PALETTE[line.colour % len(PALETTE)]
        if line.style in (".", "o"):
            axes.plot(line.x, line.y, line.style, color=colour, ms=2.5, label=line.label or None)
        else:
            axes.plot(line.x, line.y, line.style, color=colour, label=line.label or None)
    axes.set_xlabel(panel.x_label)
    axes.set_ylabel(panel.y_label)
    axes.margins(x=0.01)
    axes.set_title(panel.title, pad=14.0 if len(panel.lines) > 3 else 3.0)
    if sum(bool(line.label) for line in panel.lines) > 0:
        axes.legend(
            loc="lower right", bbox_to_anchor=(1.0, 1.0), ncols=3, borderpad=0.0, borderaxespad=0.1
        )
