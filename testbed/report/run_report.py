"""`report.html` of a run: one file that shows a person what happened, without a network."""

from __future__ import annotations

import base64
import io
import re
from collections.abc import Callable, Container, Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple, cast

from testbed import __version__
from testbed.machine.model import Machine
from testbed.machine.names import LEGS
from testbed.report.animation import animation, arrows
from testbed.report.console import summary_rows
from testbed.report.page import method_name, render, words
from testbed.report.run_parts import Shown, parts, shown
from testbed.report.style import RC, svg
from testbed.robot.robot import Robot
from testbed.scenario.terrain import Terrain
from testbed.simulation.pictures import pictures
from testbed.simulation.residuals import Suspect
from testbed.simulation.runs import RecordedRun

if TYPE_CHECKING:
    from markupsafe import Markup

MOST_EVENTS = 40
FEWEST_ROWS = 20
"""Shorter runs have a verdict but nothing to draw."""


class Drawn(NamedTuple):
    """A picture of the page: its title, what it shows, and its SVG element."""

    title: str
    text: str
    svg: Markup


def page(
    run: RecordedRun,
    summary: Mapping[str, Any],
    machine: Machine,
    terrain: Terrain | None = None,
    drawn: Callable[[], Sequence[Drawn]] | None = None,
) -> str:
    """The page's text: of a run, what it comes to (see summary.json), the machine that it truly
    had, and its ground; `drawn`: gives its pictures, where they are drawn meanwhile.
    """
    shown = _shown(run, summary, machine, terrain)
    contents = _contents(run, summary, shown)
    parts = drawn() if drawn is not None else list(draw(shown).values())
    return render("run_report.html.j2", contents | {"parts": parts})


def pictures_of(
    run: RecordedRun,
    summary: Mapping[str, Any],
    machine: Machine,
    terrain: Terrain | None,
    wanted: Container[int],
) -> dict[int, Drawn]:
    """The page's pictures by their number, those that are wanted."""
    return draw(_shown(run, summary, machine, terrain), wanted)


def _suspect(summary: Mapping[str, Any]) -> Suspect | None:
    found = (summary.get("residuals") or {}).get("stands_out")
    return Suspect(**found) if found else None


def _shown(
    run: RecordedRun, summary: Mapping[str, Any], machine: Machine, terrain: Terrain | None
) -> Shown | None:
    """What the pictures show; None where there is nothing to draw."""
    if len(run.time_s) < FEWEST_ROWS:
        return None
    series = run.data, run.truth
    return shown(series, summary, Robot.of(machine), terrain, _suspect(summary))


def _contents(run: RecordedRun, summary: Mapping[str, Any], shown: Shown | None) -> dict[str, Any]:
    named = _suspect(summary)
    large = pictures(run.folder, "large") or pictures(run.folder, "small")
    return {
        "title": f"{summary['scenario']}, seed {summary['seed']}",
        "description": summary.get("description") or "",
        "verdict": _verdict(summary),
        "good": summary.get("verdict") == "stood",
        "words": _words(summary, named),
        "keys": [
            (name, _unbroken(value)) for name, value in summary_rows(summary) if name != "verdict"
        ],
        "picture": _picture(large[-1][1]) if large else None,
        "picture_s": large[-1][0] if large else 0.0,
        "slope_deg": float(summary.get("slope_deg") or 0.0),
        "simulated_s": float(run.time_s[-1]) if len(run.time_s) else 0.0,
        "animation": animation(shown.motion, shown.slope_deg, shown.robot, shown.ground)
        if shown is not None and shown.motion is not None
        else None,
        "arrows": arrows(shown.robot) if shown is not None else "",
        "legs": LEGS,
        "errors": _errors(summary),
        "glossary": words("machine", "estimate", "safety"),
        **_film(run.folder),
        **_events(summary.get("events") or []),
        "footer": f"{run.folder.resolve().name} · roboclimber-testbed {__version__} · recording.yaml, data.parquet, "
        "truth.parquet and summary.json beside this file hold every number.",
    }


def draw(shown: Shown | None, wanted: Container[int] = range(10**6)) -> dict[int, Drawn]:
    """The pictures of a run by their number, those that are wanted."""
    import matplotlib

    if shown is None:
        return {}
    with matplotlib.rc_context(cast(Any, RC)):
        return {
            number: Drawn(part.title, part.text, svg(part.figure(), f"f{number}"))
            for number, part in enumerate(parts(shown))
            if number in wanted
        }


def _verdict(summary: Mapping[str, Any]) -> str:
    seconds = f"{summary['simulated_s']:.1f} s"
    text = (
        f"{summary['verdict']} for {seconds}"
        if summary["verdict"] == "stood"
        else f"{summary['verdict']}, {seconds}"
    )
    return text[0].upper() + text[1:] + (", then interrupted" if summary.get("interrupted") else "")


def _words(summary: Mapping[str, Any], named: Suspect | None) -> list[str]:
    """The sentences that a reader must not miss."""
    lines = [f"Expected against estimated load: leg {named}."] if named is not None else []
    expectations = summary.get("expectations")
    if expectations is not None and not expectations["met"]:
        lines.append("Not as expected: " + "; ".join(expectations["unmet"]) + ".")
    machine = summary.get("machine") or {}
    if machine.get("draw"):
        lines.append(
            f"This world's machine was drawn ({machine['draw']}, seed {machine['seed']}; truth_machine.yaml has its "
            "numbers); the model knows its drawing alone."
        )
    for effect in summary.get("undeclared") or []:
        numbers = ", ".join(
            f"{name} {parameter:g}" for name, parameter in effect["parameters"].items()
        )
        lines.append(
            f"Hidden in this world and unknown to the model: {effect['effect']} at {effect['at']} ({numbers})."
        )
    return lines


def _errors(summary: Mapping[str, Any]) -> list[list[str]]:
    rows = []
    for method, by_leg in (summary.get("force_rms_by_leg_n") or {}).items():
        values = [*(by_leg.get(leg) for leg in LEGS), summary["force_rms_n"].get(method)]
        rows.append(
            [method_name(method), *("–" if value is None else f"{value:.0f}" for value in values)]
        )
    return rows


def _events(events: list[dict[str, Any]]) -> dict[str, Any]:
    shown = [
        {
            "t": float(event["t"]),
            "what": str(event["kind"]).replace("_", " "),
            "more": ", ".join(
                f"{name} {_short(value)}"
                for name, value in event.items()
                if name not in ("t", "kind")
            ),
        }
        for event in events[:MOST_EVENTS]
    ]
    return {"events": shown, "events_left_out": max(len(events) - MOST_EVENTS, 0)}


def _unbroken(text: str) -> str:
    """Numbers keep together with their thousands and their unit."""
    return re.sub(r"(?<=\d) (?=\d|N\b|s\b|mm\b|deg\b)", "\u00a0", text)


def _short(value: Any) -> str:
    return f"{value:.4g}" if isinstance(value, float) else str(value)


def _picture(path: Path) -> str:
    """A data address of the picture, as JPEG: a fifth of the size and no difference on a screen."""
    from PIL import Image

    buffer = io.BytesIO()
    Image.open(path).convert("RGB").save(buffer, "JPEG", quality=88)
    return "data:image/jpeg;base64," + base64.b64encode(buffer.getvalue()).decode()


def _film(folder: Path) -> dict[str, Any]:
    """An animated picture of the small ones, or nothing."""
    from PIL import Image

    small = pictures(folder, "small")
    if len(small) < 3:
        return {"film": None}
    frames = [Image.open(path).convert("RGB") for _, path in small]
    buffer = io.BytesIO()
    frames[0].save(
        buffer,
        "WEBP",
        save_all=True,
        append_images=frames[1:],
        duration=250,
        loop=0,
        quality=70,
        method=0,
    )
    return {
        "film": "data:image/webp;base64," + base64.b64encode(buffer.getvalue()).decode(),
        "film_count": len(small),
    }
