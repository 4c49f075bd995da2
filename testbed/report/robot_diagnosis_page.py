"""`report.html` of a diagnosis of the whole robot: which leg, which effect, and the residuals of all four."""

from __future__ import annotations

from typing import Any

import numpy as np
import numpy.typing as npt

from testbed.diagnosis.leg.fit import residuals
from testbed.diagnosis.leg.series import BIN
from testbed.diagnosis.robot.diagnose import LEARNT_SHARE, RobotDiagnosis
from testbed.diagnosis.robot.findings import as_json, spoken
from testbed.diagnosis.robot.problem import FLOW_S
from testbed.effects import by_name
from testbed.report.page import render
from testbed.report.style import BLUE, GREY, RC, VERMILION, svg
from testbed.report.words import DIAGNOSIS_WORDS, MACHINE_WORDS

Array = npt.NDArray[np.float64]


def page(d: RobotDiagnosis) -> str:
    """The page's text."""
    return render("robot_diagnosis.html.j2", contents(d))


def contents(d: RobotDiagnosis) -> dict[str, Any]:
    """Everything the page's template shows."""
    found = as_json(d)
    ranked = sorted((c for c in d.state.tried.values() if c.names), key=lambda c: -d.state.gain(c))
    return {
        "name": d.name,
        "verdict": d.verdict.kind,
        "headline": headline(d),
        "effects": [e | {"text": by_name(e["name"]).text} for e in found["effects"]],
        "hypotheses": [
            (" + ".join(spoken(n) for n in h["names"]) or "none", h["probability"])
            for h in found["hypotheses"][:6]
        ],
        "errors": [*d.errors.items(), ("all", d.total())],
        "slides": d.slides,
        "learnt": round(100 * LEARNT_SHARE),
        "rivals": [
            (" + ".join(spoken(n) for n in c.names), d.state.gain(c))
            for c in ranked
            if len(c.names) == 1
        ][:8],
        "force": force_figure(d),
        "flow": flow_figure(d),
        "flow_s": FLOW_S,
        "left_out": found["left_out"],
        "glossary": (*DIAGNOSIS_WORDS, *MACHINE_WORDS),
    }


def headline(d: RobotDiagnosis) -> str:
    """One sentence."""
    if d.verdict.kind == "effect":
        words = [f"{spoken(n)} ({by_name(n).text})" for n in d.verdict.chosen.names]
        return "The model lacks " + " and ".join(words) + "."
    if d.verdict.kind == "unnamed":
        return "One leg does not fit, and none of the known effects explains it."
    return "No leg stands out: the model lacks nothing that this run can show."


def force_figure(d: RobotDiagnosis) -> str:
    """Force residual of each leg against time: declared model grey, shared friction refitted black, after blue."""
    return _figure(d, "force", 1.0, "residual, N", "force")


def flow_figure(d: RobotDiagnosis) -> str:
    """Flow residual of chamber A of each leg against time."""
    return _figure(d, "flow", 1e6, "flow A, cm³/s", "flow")


def _figure(d: RobotDiagnosis, channel: str, factor: float, label: str, salt: str) -> str:
    import matplotlib.pyplot as plt

    stages = (("before", GREY), ("refit", VERMILION), ("after", BLUE))
    values = {
        stage: residuals(d.problem, d.points[stage], (channel,))[channel] for stage, _ in stages
    }
    with plt.rc_context(RC):  # type: ignore[arg-type]
        figure, panels = plt.subplots(1, 4, figsize=(10.4, 2.2), sharey=True)
        first, limit = (
            0,
            factor * 1.2 * max(float(np.percentile(np.abs(v), 99)) for v in values.values()),
        )
        for panel, s in zip(panels, d.problem.series, strict=True):
            at = slice(first, first + s.bins)
            first += s.bins * (2 if channel == "flow" else 1)
            time = s.signals.time_s[1::BIN][: s.bins]
            for stage, colour in stages:
                panel.plot(
                    time[::4], factor * values[stage][at][::4], color=colour, lw=0.7, label=stage
                )
            panel.axvline(d.problem.window_s[1], color="#1a1a1a", lw=0.6, ls=":")
            panel.set_title(s.name.replace("_", " "))
            panel.set_xlabel("time, s")
            panel.set_ylim(-limit, limit)
        panels[0].set_ylabel(label)
        handles, labels = panels[-1].get_legend_handles_labels()
        figure.tight_layout(rect=(0.0, 0.0, 0.92, 1.0))
        figure.legend(handles, labels, loc="center right")
        text = svg(figure, f"robot-{salt}")
        plt.close(figure)
    return text
