"""How figures look: colours that the colour-blind can tell apart, unit on every axis, SVG that
carries its text.
"""

from __future__ import annotations

import hashlib
import io
import re
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from typing import TYPE_CHECKING, Any, NamedTuple, cast

if TYPE_CHECKING:
    from markupsafe import Markup
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure
    from matplotlib.gridspec import GridSpec

WIDTH_IN = 4.5
"""Figures are this wide, so that their text stays readable on a phone and two fit side by side on a
desk.
"""

# Okabe and Ito's palette
BLACK, ORANGE, SKY, GREEN = "#1a1a1a", "#e69f00", "#56b4e9", "#009e73"
BLUE, VERMILION, PURPLE, GREY = "#0072b2", "#d55e00", "#cc79a7", "#8a8f98"
BAND = "#d9dbe0"

METHOD_STYLE: dict[str, tuple[str, str]] = {
    "one_chamber": (PURPLE, ":"),
    "two_chamber": (SKY, "-"),
    "friction": (ORANGE, "-"),
    "kbf": (GREEN, "-"),
    "modified_kbf": (BLUE, "--"),
}
LEG_COLOUR = {"fl": BLUE, "fr": VERMILION, "rl": GREEN, "rr": PURPLE}

RC: dict[str, Any] = {
    "font.size": 9.0,
    "font.family": "sans-serif",
    "font.sans-serif": ["DejaVu Sans", "Helvetica", "Arial", "sans-serif"],
    "axes.spines.top": False,
    "axes.spines.right": False,
    "axes.titlesize": 9.0,
    "axes.titlelocation": "left",
    "axes.titleweight": "bold",
    "axes.titlepad": 3.0,
    "axes.titley": 1.0,  # where it stands is known: matplotlib need not measure all ticks for it
    "axes.linewidth": 0.6,
    "axes.formatter.useoffset": False,  # it would stand over the title
    "axes.grid": True,
    "axes.axisbelow": True,  # bars hide the grid, not the grid the bars
    "grid.color": "#e4e6ea",
    "grid.linewidth": 0.5,
    "xtick.major.width": 0.6,
    "ytick.major.width": 0.6,
    "lines.linewidth": 0.9,
    "lines.solid_joinstyle": "round",
    "legend.frameon": False,
    "legend.fontsize": 8.5,
    "legend.handlelength": 1.8,
    "svg.fonttype": "none",
    "svg.hashsalt": "roboclimber",
    "text.parse_math": False,
    "path.simplify_threshold": 0.3,
}


def method_style(method: str) -> tuple[str, str]:
    """(colour, dash) of an estimate; the project's own ones share one look."""
    return METHOD_STYLE.get(method, (VERMILION, "-."))


class Blank(NamedTuple):
    """A figure of some axes over one shared time axis, with nothing in it yet."""

    figure: Figure
    axes: list[Axes]
    grid: GridSpec


_blanks: dict[int, list[Blank]] = {}
"""Figures that were made before they are needed, by their number of axes."""
TICKS = 9
"""Ticks of an axis that are made with it: an axis with fewer does not draw the others."""


def _blank(rows: int) -> Blank:
    from matplotlib.figure import Figure

    figure = Figure()
    grid = figure.add_gridspec(rows, 1)
    return Blank(figure, list(grid.subplots(sharex=True, squeeze=False)[:, 0]), grid)


def prepare_figures(figures_by_rows: Mapping[int, int]) -> None:
    """Make so many figures of so many axes now, ticks and all, which is most of what drawing one
    costs; new_figure takes them where they fit.
    """
    import matplotlib

    with matplotlib.rc_context(cast(Any, RC)):
        for rows, count in figures_by_rows.items():
            made = [_blank(rows) for _ in range(count)]
            for ax in (ax for blank in made for ax in blank.axes):
                ax.xaxis.get_major_ticks(TICKS)
                ax.yaxis.get_major_ticks(TICKS)
            _blanks.setdefault(rows, []).extend(made)


def new_figure(
    rows: int, height_in: float, ratios: list[float] | None = None, legend_rows: int = 0
) -> tuple[Figure, list[Axes]]:
    """A figure of `rows` axes over one shared time axis, with room for a legend on top.

    The margins are set by hand: matplotlib's own layout draws every figure twice.
    """
    ready = _blanks.get(rows)
    figure, axes, grid = ready.pop() if ready else _blank(rows)
    figure.set_size_inches(WIDTH_IN, height_in)
    grid.set_height_ratios(ratios)
    top_in = 0.24 + 0.19 * legend_rows + (0.06 if legend_rows else 0.0)
    axis_in = (height_in - top_in - 0.46 - 0.36 * (rows - 1)) / rows
    figure.subplots_adjust(
        left=0.84 / WIDTH_IN,
        right=1 - 0.16 / WIDTH_IN,
        top=1 - top_in / height_in,
        bottom=0.46 / height_in,
        hspace=0.36 / axis_in,
    )
    return figure, axes


@contextmanager
def styled_figure(
    rows: int, columns: int, size_in: tuple[float, float], **shared: Any
) -> Iterator[Any]:
    """(figure, its axes; one alone as itself) in the look of the pages while it is drawn."""
    import matplotlib
    from matplotlib.figure import Figure

    with matplotlib.rc_context(cast(Any, RC)):
        figure = Figure(figsize=size_in)
        yield figure, figure.subplots(rows, columns, **shared)


def add_legend(figure: Figure, handles: list[Any], labels: list[str], columns: int) -> None:
    """A legend above all axes, from the left edge."""
    figure.legend(
        handles,
        labels,
        loc="upper left",
        bbox_to_anchor=(0.0, 1.0),
        ncols=columns,
        columnspacing=1.1,
        borderaxespad=0.0,
        borderpad=0.1,
        labelspacing=0.25,
    )


def finish_time_axis(axes: list[Axes], start_s: float, end_s: float) -> None:
    """The lowest axis carries the time."""
    axes[-1].set_xlabel("time [s]")
    axes[-1].set_xlim(start_s, end_s)


def svg(figure: Figure, name: str) -> Markup:
    """The figure as an SVG element for a page: scales with its place; `name` keeps its ids from
    other figures'.

    Matplotlib escapes the texts of a figure, so the template engine takes the element as it is.
    """
    import matplotlib
    from markupsafe import Markup

    number_powers(figure)
    buffer = io.StringIO()
    with matplotlib.rc_context(cast(Any, RC)):
        figure.savefig(buffer, format="svg", metadata={"Date": None, "Creator": None})
    text = buffer.getvalue()
    text = text[text.index("<svg") :]
    return Markup(_own_ids(text, name))


def number_powers(figure: Figure) -> None:
    """Logarithmic axes carry numbers: the powers that matplotlib writes are formulas, which these
    figures keep as text.
    """
    from matplotlib.ticker import LogFormatter, NullFormatter

    for axis in (one for axes in figure.axes for one in (axes.xaxis, axes.yaxis)):
        if isinstance(axis.get_major_formatter(), LogFormatter):
            axis.set_major_formatter(lambda value, _: f"{value:g}")
            axis.set_minor_formatter(NullFormatter())


def _own_ids(text: str, name: str) -> str:
    """Ids are shared by a whole page: prefix them, so that one figure does not use another's clip
    paths.

    A name may be anything, such as that of a recording's folder, and a prefix must be a word: it is
    the name's digest.
    """
    prefix = "f" + hashlib.sha256(name.encode(errors="replace")).hexdigest()[:12]

    def renamed(tag: re.Match[str]) -> str:
        return re.sub(r'( id="|url\(#|href="#)', rf"\1{prefix}-", tag[0])

    return re.sub("<[^>]*>", renamed, text)
