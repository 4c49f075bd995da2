"""`report.html` of a diagnosis of the whole robot: what it lacks and where, and what its balances
miss.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from testbed.diagnosis.robot.diagnose import RobotDiagnosis
from testbed.diagnosis.robot.findings import as_json, in_the_model, not_recalled, spoken
from testbed.diagnosis.robot.groups import FORCES, GROUND, LINE, ROPES
from testbed.diagnosis.robot.kept_back_part import LEARNT_SHARE
from testbed.effects import by_name
from testbed.formats.arrays import Array
from testbed.machine.names import AXES
from testbed.report.page import render, significant, words
from testbed.report.style import BLUE, GREY, add_legend, styled_figure, svg

COMPONENTS = ("up the slope", "to the left", "off the slope")
SHOWN = 8
"""So many rivals stand in the table."""


def page(diagnosis: RobotDiagnosis) -> str:
    """The page's text."""
    return render("robot_diagnosis.html.j2", contents(diagnosis))


def contents(diagnosis: RobotDiagnosis) -> dict[str, Any]:
    """Everything the page's template shows."""
    found = as_json(diagnosis)
    singles = [(names[0], factor) for names, factor in diagnosis.signs.sets if len(names) == 1]
    return {
        "name": diagnosis.name,
        "verdict": diagnosis.verdict.kind,
        "headline": headline(diagnosis),
        "not_believed": found.get("not_believed", ""),
        "in_the_model": in_the_model(diagnosis),
        "beyond": diagnosis.beyond,
        "not_recalled": not_recalled(diagnosis),
        "effects": [effect | {"text": by_name(effect["name"]).text} for effect in found["effects"]],
        "hypotheses": [
            (
                " + ".join(spoken(name) for name in hypothesis["names"]) or "none",
                hypothesis["probability"],
            )
            for hypothesis in found["hypotheses"][:6]
        ],
        "errors": _rows(diagnosis),
        "learnt": round(100 * LEARNT_SHARE),
        "rivals": [(spoken(name), factor) for name, factor in singles[:SHOWN]],
        "left_out": found["left_out"],
        "resembles": spoken(diagnosis.resembles) if diagnosis.resembles else "",
        "force": force_figure(diagnosis),
        "places": place_figure(diagnosis),
        "glossary": words("naming", "machine"),
    }


def headline(diagnosis: RobotDiagnosis) -> str:
    """One sentence."""
    if diagnosis.verdict.kind == "effect":
        words = [
            f"{spoken(finding.name)} ({by_name(finding.kind).text})" for finding in diagnosis.found
        ]
        return "The model lacks " + " and ".join(words) + "."
    if diagnosis.verdict.kind == "unnamed":
        return "The machine does not fit its model, and none of the known effects explains it."
    return "Nothing stands out: the model lacks nothing that this run can show."


def _rows(diagnosis: RobotDiagnosis) -> list[tuple[str, str, dict[str, str]]]:
    """(balance, unit, stage -> RMS) of the balances that a reader wants to see: forces, and those
    that changed.
    """
    units = {
        FORCES: ("N, N m", 1.0),
        "feet": ("mm", 1e3),
        "supply": ("bar", 1e-5),
        ROPES: ("share", 1.0),
        GROUND: ("mrad", 1e3),
    }
    out = []
    for group, row in diagnosis.errors.items():
        of_oil = ("N", 1.0) if group.startswith(LINE) else ("cm³/s", 1e6)
        unit, factor = units.get(group, of_oil)
        changed = abs(row["after"] - row["refit"]) > 0.02 * row["refit"]
        if group in units or changed:
            texts = {stage: significant(factor * value, 3) for stage, value in row.items()}
            out.append((group.replace("_", " "), unit, texts))
    return out


def force_figure(diagnosis: RobotDiagnosis) -> str:
    """What the body's balance of forces misses against time: as believed grey, with the effects
    blue.
    """
    body = diagnosis.balances.body
    missing = body.missing.copy()
    frames = body.seen.slope_frame
    stages = [("as believed", GREY, missing)]
    if diagnosis.found:
        stages.append(("with what was found", BLUE, missing - _explained(diagnosis)))
    with styled_figure(1, 3, (10.4, 2.3), sharey=True) as (figure, panels):
        for axis, (panel, words) in enumerate(zip(panels, COMPONENTS, strict=True)):
            for label, colour, values in stages:
                along = np.einsum("nj,nj->n", frames[:, axis], values[:, :3])
                panel.plot(body.seen.time_s, along, color=colour, lw=1.0, label=label)
            panel.axhline(0.0, color="#1a1a1a", lw=0.6)
            panel.set(title=words, xlabel="time [s]")
        panels[0].set_ylabel("missing force [N]")
        figure.tight_layout(rect=(0.0, 0.0, 1.0, 0.92))
        handles, labels = panels[0].get_legend_handles_labels()
        add_legend(figure, handles, labels, len(stages))
        return svg(figure, "robot-force")


def _explained(diagnosis: RobotDiagnosis) -> Array:
    """(n, 18) what the found effects make the balances miss."""
    body = diagnosis.balances.body
    out, first = np.zeros_like(body.missing), 0
    for name in diagnosis.verdict.chosen.names:
        for change in diagnosis.balances.candidates[name].signature.values():
            number = diagnosis.verdict.chosen.mean[first]
            first += 1
            for axis, force in change.force.items():
                out += number * body.by_force[:, :, axis] * force[:, None]
            for given, columns in ((change.wrench, slice(0, 6)), (change.balance, slice(0, 18))):
                if given is not None:
                    out[:, columns] += number * given
    return out


def place_figure(diagnosis: RobotDiagnosis) -> str:
    """Evidence of the best single effect at each place, in units of belief (natural logarithm)."""
    others = ("body", "rope", "rope_left", "rope_right", "drill", "supply")
    feet = tuple(f"foot_{leg}" for leg in ("fl", "fr", "rl", "rr"))
    places = (*AXES, *others, *feet)
    best = [max(_at(diagnosis.signs.sets, place), default=0.0) for place in places]
    chosen = {name.partition("@")[2] for name in diagnosis.verdict.chosen.names}
    with styled_figure(1, 1, (10.4, 2.4)) as (figure, panel):
        colours = [BLUE if place in chosen else GREY for place in places]
        panel.bar(range(len(places)), best, color=colours)
        panel.set_xticks(
            range(len(places)), [place.replace("_", " ") for place in places], rotation=60
        )
        panel.set_ylabel("evidence (ln B)")
        figure.tight_layout()
        return svg(figure, "robot-places")


def _at(sets: Sequence[tuple[tuple[str, ...], float]], place: str) -> list[float]:
    return [
        factor for names, factor in sets if len(names) == 1 and names[0].partition("@")[2] == place
    ]
