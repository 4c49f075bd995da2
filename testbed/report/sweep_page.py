"""`sweep.html`: a sweep's runs over what was varied, and the worst of them."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from testbed.formats.arrays import Array
from testbed.formats.yaml_files import flattened
from testbed.report.page import render, words
from testbed.report.style import RC, svg
from testbed.simulation.sweep import table

if TYPE_CHECKING:
    from matplotlib.axes import Axes

Results = Sequence[Mapping[str, Any]]
WORST, MOST_ROWS, MOST_CELLS = 8, 200, 24


class Shown(NamedTuple):
    """A number of a summary that is drawn: its dotted path, what it is called, and which end of it
    is bad.
    """

    path: str
    title: str
    bad: str


FIGURES = (
    Shown("force_rms_n.own", "own force error [N]", "high"),
    Shown("lowest_stability_margin", "lowest stability margin", "low"),
    Shown("stood", "share of runs that stood", "low"),
)


def page(title: str, results: Results, planned: int) -> str:
    """The page's text. `planned`: number of runs that the sweep asks for."""
    heads, rows = table(results)
    return render(
        "sweep.html.j2",
        {
            "title": title,
            "done": len(results),
            "planned": planned,
            "stood": sum(entry["summary"].get("verdict") == "stood" for entry in results),
            "figure": _figure(results),
            "heads": heads,
            "worst": [rows[place] for place in worst(results)],
            "rows": rows[:MOST_ROWS],
            "left_out": max(len(rows) - MOST_ROWS, 0),
            "glossary": words("estimate", "safety"),
        },
    )


def worst(results: Results) -> list[int]:
    """Numbers of the runs that a person should look at first: those that did not stand, then by
    their force error.
    """
    error = values(results, FIGURES[0])
    stood = values(results, FIGURES[2])
    order = sorted(
        range(len(results)), key=lambda k: (stood[k], -np.nan_to_num(error[k], nan=np.inf))
    )
    return order[:WORST]


def values(results: Results, shown: Shown) -> Array:
    """A figure of every run (n); nan where its summary lacks it."""
    found = []
    for entry in results:
        leaves = dict(flattened(entry["summary"]))
        leaves["stood"] = float(leaves.get("verdict") == "stood")
        value = leaves.get(shown.path)
        found.append(float("nan") if value is None else float(value))
    return np.array(found)


def varied(results: Results) -> list[str]:
    """Dotted paths that take more than one value, those of numbers first."""
    by_path: dict[str, dict[Any, None]] = {}
    for entry in results:
        for path, value in entry["changes"].items():
            by_path.setdefault(path, {})[str(value)] = None
    many = [path for path, found in by_path.items() if len(found) > 1]
    return sorted(
        many, key=lambda path: not isinstance(results[0]["changes"].get(path), (int, float))
    )


def _figure(results: Results) -> str | None:
    """Each figure over the first two varied paths; None where nothing was varied."""
    import matplotlib
    from matplotlib.figure import Figure

    paths = varied(results)[:2]
    if not paths:
        return None
    with matplotlib.rc_context(RC):  # type: ignore[arg-type]
        figure = Figure(figsize=(11.0, 3.2), layout="constrained")
        for ax, shown in zip(figure.subplots(1, len(FIGURES)), FIGURES, strict=True):
            ax.grid(visible=False)
            ax.set_title(shown.title)
            _draw(ax, results, paths, shown)
        return svg(figure, "sweep")


def _draw(ax: Axes, results: Results, paths: Sequence[str], shown: Shown) -> None:
    """A heat map of means where there are few values of each path, else a point a run."""
    found = values(results, shown)
    axes = [_axis([entry["changes"].get(path) for entry in results]) for path in paths]
    kinds = [_kinds(column) for column in axes] + [[""]] * (2 - len(paths))
    look: dict[str, Any] = {"cmap": "viridis_r" if shown.bad == "high" else "viridis"}
    if shown.path == "stood":
        look |= {"vmin": 0.0, "vmax": 1.0}
    if max(len(kind) for kind in kinds) > MOST_CELLS:
        at = [_places(column, kind) for column, kind in zip(axes, kinds, strict=False)]
        drawn: Any = ax.scatter(at[0], at[1] if len(at) > 1 else found, c=found, s=18, **look)
    else:
        drawn = ax.imshow(_means(axes, kinds, found), origin="lower", aspect="auto", **look)
        ax.set_xticks(range(len(kinds[0])), [str(kind) for kind in kinds[0]])
        ax.set_yticks(range(len(kinds[1])), [str(kind) for kind in kinds[1]])
    ax.set_xlabel(paths[0])
    place = ax.get_subplotspec()
    if len(paths) > 1 and place is not None and place.is_first_col():
        ax.set_ylabel(paths[1])
    ax.figure.colorbar(drawn, ax=ax)


def _axis(column: Sequence[Any]) -> list[Any]:
    """The values as an axis takes them: numbers, or else all of them in words, lists too."""
    numbers = all(isinstance(value, (int, float)) for value in column)
    return list(column) if numbers else [str(value) for value in column]


def _places(column: Sequence[Any], kinds: Sequence[Any]) -> list[Any]:
    """Where values stand on an axis of points: numbers where they are, words one after the
    other.
    """
    return [kinds.index(value) if isinstance(value, str) else value for value in column]


def _kinds(column: Sequence[Any]) -> list[Any]:
    """The values that occur, sorted where they can be."""
    kinds = list(dict.fromkeys(column))
    return sorted(kinds) if all(isinstance(kind, (int, float)) for kind in kinds) else kinds


def _means(axes: Sequence[Sequence[Any]], kinds: Sequence[Sequence[Any]], found: Array) -> Array:
    """Mean of the runs in each cell (kinds of the second path, kinds of the first); nan where there
    is none.
    """
    out = np.full((len(kinds[1]), len(kinds[0])), np.nan)
    for index, first in enumerate(kinds[0]):
        for column, second in enumerate(kinds[1]):
            here = [
                place
                for place, value in enumerate(axes[0])
                if value == first and (len(axes) < 2 or axes[1][place] == second)
            ]
            cell = found[here]
            if np.isfinite(cell).any():
                out[column, index] = np.nanmean(cell)
    return out
