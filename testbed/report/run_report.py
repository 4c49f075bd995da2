"""`report.html` of a run: one file that shows a person what happened, without a network."""

from __future__ import annotations

import base64
import io
import re
from collections.abc import Mapping
from pathlib import Path
from typing import Any, cast

import numpy as np
import numpy.typing as npt

from testbed import __version__
from testbed.estimation.losses import LossRule, nominal_load_n
from testbed.machine.model import Machine
from testbed.machine.names import LEGS
from testbed.report.animation import animation
from testbed.report.console import summary_rows
from testbed.report.page import render
from testbed.report.style import RC, method_name, svg
from testbed.simulation.metrics import methods, stability_margin, tilt_deg
from testbed.simulation.pictures import pictures
from testbed.simulation.residuals import Suspect, best_method, load_residuals
from testbed.simulation.runs import RecordedRun

Array = npt.NDArray[np.float64]
MOST_EVENTS = 40
FEWEST_ROWS = 20
"""Shorter runs have a verdict but nothing to draw."""


def page(run: RecordedRun, summary: Mapping[str, Any], machine: Machine) -> str:
    """The page's text: of a run, what it comes to (see summary.json), and the machine that it truly had."""
    return render("run_report.html.j2", _contents(run, summary, machine))


def _contents(run: RecordedRun, summary: Mapping[str, Any], machine: Machine) -> dict[str, Any]:
    slope_deg = float(summary.get("slope_deg") or 0.0)
    method = best_method(methods(run.data))
    by_leg = load_residuals(run.data, method) if method else {}
    enough = len(run.time_s) >= FEWEST_ROWS
    found = (summary.get("residuals") or {}).get("stands_out")
    named = Suspect(**found) if found else None
    rule = summary.get("contact_loss_rule") or {}
    loss_force_n = float(rule.get("force_n") or LossRule(nominal_load_n(machine)).force_n)
    events = summary.get("events") or []
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
        "slope_deg": slope_deg,
        "simulated_s": float(run.time_s[-1]) if len(run.time_s) else 0.0,
        "parts": _parts(run, events, slope_deg, by_leg, named, method, loss_force_n)
        if enough
        else [],
        "animation": animation(run.data, run.truth, slope_deg, machine) if enough else None,
        "legs": LEGS,
        "errors": _errors(summary),
        **_film(run.folder),
        **_events(events),
        "footer": f"{run.folder.resolve().name} · roboclimber-testbed {__version__} · recording.yaml, data.parquet, "
        "truth.parquet and summary.json beside this file hold every number.",
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
        numbers = ", ".join(f"{k} {v:g}" for k, v in effect["parameters"].items())
        lines.append(
            f"Hidden in this world and unknown to the model: {effect['effect']} at {effect['at']} ({numbers})."
        )
    return lines


def _parts(
    run: RecordedRun,
    events: list[dict[str, Any]],
    slope_deg: float,
    by_leg: Mapping[str, Array],
    named: Suspect | None,
    method: str | None,
    loss_force_n: float,
) -> list[dict[str, str]]:
    import matplotlib

    from testbed.report import figures
    from testbed.report.series import busiest

    data, truth = run.data, run.truth
    parts: list[dict[str, str]] = []

    def add(title: str, text: str, figure: Any) -> None:
        parts.append({"title": title, "text": text, "svg": svg(figure, f"f{len(parts)}")})

    with matplotlib.rc_context(cast(Any, RC)):
        add(
            "Foot loads",
            "Along the vertical joint's axis. Lines are means over stretches of 0.2 % of the time.",
            figures.foot_loads(data, truth, events),
        )
        if len(by_leg) == len(LEGS) and method:
            word = f"Leg {named}." if named else "No leg stands out by itself."
            word = f"Expected load less what the leg's own cylinder says; band: what friction leaves open. {word}"
            add("Expected minus estimated", word, figures.residuals(data, method, named, events))
        window = busiest(truth["t"], truth["foot_load_fl"])
        if truth["t"][-1] - truth["t"][0] > 3.0:
            add(
                "Foot loads, close up",
                f"The second in which the load of fl changes most, from {window[0]:.2f} s.",
                figures.foot_loads(data, truth, events, window),
            )
        if methods(data):
            add(
                "Errors of the estimates",
                "Estimate minus truth, the paper's equations one after the other.",
                figures.estimate_errors(data, truth, events),
            )
        add(
            "Pressures",
            "As the transducers read them, through their calibration.",
            figures.pressures(data, events),
        )
        add(
            "Ropes and drill",
            "What holds the robot and what pushes it.",
            figures.ropes_and_drill(data, truth, slope_deg, events),
        )
        add(
            "Contact and events",
            f"Black: the foot truly carries ({loss_force_n:.0f} N and more); orange: the detector's word.",
            figures.contacts(data, truth, events, loss_force_n),
        )
        up = _way_up(truth, slope_deg)
        add(
            "Body",
            "Margin: share of the load off the edge about which the robot would tip first, 0 to 0.5.",
            figures.body(
                truth["t"],
                tilt_deg(truth, slope_deg),
                up,
                stability_margin(truth, loss_force_n),
                events,
            ),
        )
    return parts


def _way_up(truth: Mapping[str, Array], slope_deg: float) -> Array:
    slope = np.deg2rad(slope_deg)
    along: Array = truth["body_pose_in_world_x"] * np.cos(slope) + truth[
        "body_pose_in_world_z"
    ] * np.sin(slope)
    return np.asarray(along - along[0])


def _errors(summary: Mapping[str, Any]) -> list[list[str]]:
    rows = []
    for method, by_leg in (summary.get("force_rms_by_leg_n") or {}).items():
        values = [*(by_leg.get(leg) for leg in LEGS), summary["force_rms_n"].get(method)]
        rows.append([method_name(method), *("–" if v is None else f"{v:.0f}" for v in values)])
    return rows


def _events(events: list[dict[str, Any]]) -> dict[str, Any]:
    shown = [
        {
            "t": float(e["t"]),
            "what": str(e["kind"]).replace("_", " "),
            "more": ", ".join(f"{k} {_short(v)}" for k, v in e.items() if k not in ("t", "kind")),
        }
        for e in events[:MOST_EVENTS]
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
