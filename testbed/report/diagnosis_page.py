"""`report.html` of a diagnosis: what the model lacks, why that and not its rival, and what it is
worth.
"""

from __future__ import annotations

from typing import Any

import numpy as np
import numpy.typing as npt

from testbed.diagnosis.leg.experiments import experiments
from testbed.diagnosis.leg.findings import Diagnosis, as_json
from testbed.diagnosis.leg.search import Candidate, Search
from testbed.diagnosis.leg.series import series_of
from testbed.diagnosis.leg.verdict import Verdict
from testbed.diagnosis.leg.verification import (
    STAGES,
    closed_share,
    flow_residual,
    force_residual,
    moving,
)
from testbed.effects import by_name
from testbed.estimation.leg.motion import signals_of
from testbed.formats.arrays import Array
from testbed.recording.axis import Recording
from testbed.report.page import render, words
from testbed.report.style import BLUE, GREY, VERMILION, WIDTH_IN, styled_figure, svg

# Figures of a diagnosis: residuals before and after, and the evidence for each hypothesis; SVG
# text.

POINTS = 2500


def _thin(count: int) -> npt.NDArray[np.int64]:
    return np.linspace(0, count - 1, min(count, POINTS)).astype(np.int64)


def _legend(figure: Any, panel: Any, marker: float = 1.0) -> None:
    """Beside the panels, where no data is."""
    figure.tight_layout(rect=(0.0, 0.0, 0.93, 1.0))
    figure.legend(*panel.get_legend_handles_labels(), markerscale=marker, loc="center right")


def residual_figure(diagnosis: Diagnosis, recording: Recording) -> str:
    """Force residual of one recording against time, position, velocity and pressure A: refit grey,
    after blue.
    """
    mask = moving(recording, diagnosis.models["refit"])
    signals = signals_of(recording, diagnosis.models["refit"].known)
    at = np.flatnonzero(mask)
    at = at[_thin(len(at))] if len(at) else at
    time_s = recording.time_s

    def on(values: Array) -> Array:
        return np.interp(time_s, signals.time_s, values)[at]

    axes_of: list[tuple[str, Array]] = [
        ("time [s]", time_s[at]),
        ("position [m]", on(signals.position_m)),
        ("velocity [m/s]", on(signals.velocity_m_s)),
    ]
    if signals.pressure_a_pa is not None:
        axes_of.append(("pressure A [bar]", on(signals.pressure_a_pa) / 1e5))
    before, after = (
        force_residual(recording, diagnosis.models["refit"])[at],
        force_residual(recording, diagnosis.models["after"])[at],
    )
    limit = 1.15 * float(np.percentile(np.abs(before), 99)) if len(before) else 1.0
    with styled_figure(1, len(axes_of), (2.6 * len(axes_of), 2.2), sharey=True) as (figure, panels):
        for panel, (label, x) in zip(panels, axes_of, strict=True):
            panel.plot(x, before, ".", ms=1.6, color=GREY, label="refit", rasterized=True)
            panel.plot(x, after, ".", ms=1.6, color=BLUE, label="after", rasterized=True)
            panel.set_xlabel(label)
            panel.locator_params(axis="x", nbins=4)
            panel.set_ylim(-limit, limit)
        panels[0].set_ylabel("force residual [N]")
        _legend(figure, panels[0], 4.0)
        return svg(figure, f"force-{recording.name}")


def flow_figure(diagnosis: Diagnosis, recording: Recording) -> str | None:
    """Flow residuals of A and B against time, refit grey, after blue; None where the rig has no
    flow balance.
    """
    if not diagnosis.problem.with_flow:
        return None
    series = series_of([recording], diagnosis.models["refit"].known)[0]
    at = _thin(len(series.signals.time_s))
    before, after = (
        flow_residual(series, diagnosis.models["refit"]),
        flow_residual(series, diagnosis.models["after"]),
    )
    with styled_figure(1, 2, (9.0, 2.0), sharey=True) as (figure, panels):
        for panel, name, earlier, later in zip(panels, "AB", before, after, strict=True):
            limit = 1.3e6 * float(np.percentile(np.abs(earlier), 99.5))
            panel.plot(
                series.signals.time_s[at], 1e6 * earlier[at], color=GREY, lw=0.6, label="refit"
            )
            panel.plot(
                series.signals.time_s[at], 1e6 * later[at], color=BLUE, lw=0.6, label="after"
            )
            panel.set_ylim(-limit, limit)
            panel.set(title=f"chamber {name}", xlabel="time [s]")
        panels[0].set_ylabel("flow residual [cm³/s]")
        _legend(figure, panels[0])
        return svg(figure, f"flow-{recording.name}")


def evidence_figure(diagnosis: Diagnosis, rows: list[tuple[str, float]]) -> str:
    """Held-out log-likelihood that each single hypothesis gains over the refit, on a symmetric-log
    axis.
    """
    chosen = set(diagnosis.verdict.chosen.names)
    with styled_figure(1, 1, (WIDTH_IN, 0.24 * len(rows) + 0.7)) as (figure, panel):
        for index, (name, gain) in enumerate(reversed(rows)):
            panel.barh(
                index,
                gain,
                color=VERMILION if set(name.split(" + ")) <= chosen else GREY,
                height=0.7,
            )
        panel.set_yticks(range(len(rows)), [name for name, _ in reversed(rows)])
        panel.set_xscale("symlog", linthresh=10.0)
        lowest, highest = panel.get_xlim()
        powers = [sign * 10.0**power for power in range(1, 9, 2) for sign in (-1, 1)]
        panel.set_xticks([0.0, *(at for at in powers if lowest <= at <= highest)])
        panel.set_xlabel("held-out log-likelihood gained")
        figure.tight_layout()
        return svg(figure, "evidence")


HEADLINES = {
    "none": "The model lacks nothing that these recordings can show.",
    "unnamed": "Something is missing that none of the known effects explains.",
}


def page(diagnosis: Diagnosis) -> str:
    """The page's text."""
    return render("diagnosis.html.j2", contents(diagnosis))


def contents(diagnosis: Diagnosis) -> dict[str, Any]:
    """Everything the page's template shows."""
    found = as_json(diagnosis)
    repeated = found.get("repeated", {})
    return {
        "rig": diagnosis.rig.name,
        "kind": diagnosis.rig.kind,
        "verdict": diagnosis.verdict.kind,
        "headline": _headline(diagnosis),
        "effects": [
            effect
            | {"text": by_name(effect["name"]).text, "repeated": repeated.get(effect["name"])}
            for effect in found["effects"]
        ],
        "declared": [str(number) for number in diagnosis.used],
        "goes_with": diagnosis.verdict.goes_with,
        "runs": _runs(found.get("error_of_runs_left_out_n", {})),
        "refused": found.get("refused", []),
        "passed": found.get("passed", []) if diagnosis.verdict.kind == "unnamed" else [],
        "hypotheses": found["hypotheses"][:8],
        "errors": _error_rows(diagnosis),
        "closed": {
            quantity: closed_share(diagnosis.errors, quantity)
            for quantity in ("force_n", "flow_m3_s")
        },
        "evidence": evidence_figure(diagnosis, _gains(diagnosis))
        if len(diagnosis.state.tried) > 1
        else "",
        "rivals": rivals(diagnosis.state, diagnosis.verdict),
        "stated": diagnosis.verdict.hypotheses[0][1],
        "figures": [
            (
                recording.name,
                residual_figure(diagnosis, recording),
                flow_figure(diagnosis, recording),
            )
            for recording in diagnosis.rig.verify
        ],
        "left_out": found["left_out"],
        "glossary": words("naming", "diagnosis", "machine"),
        "experiments": experiments(_group(diagnosis)),
        "excess": max(diagnosis.found.excess_best.values(), default=1.0),
    }


def _runs(errors: dict[str, dict[str, float]]) -> list[tuple[str, dict[str, float]]]:
    """Recording left out -> stage -> error, N."""
    names = next(iter(errors.values()), {})
    return [(run, {stage: row[run] for stage, row in errors.items()}) for run in names]


def _headline(diagnosis: Diagnosis) -> str:
    if diagnosis.verdict.kind != "effect":
        return HEADLINES[diagnosis.verdict.kind]
    words = [f"{name} ({by_name(name).text})" for name in diagnosis.verdict.chosen.names]
    return "The model lacks " + " and ".join(words) + "."


def _error_rows(diagnosis: Diagnosis) -> list[dict[str, Any]]:
    rows = []
    for quantity, unit, factor in (("force_n", "N", 1.0), ("flow_m3_s", "cm³/s", 1e6)):
        total = diagnosis.errors.total(quantity)
        if not total:
            continue
        tables = [
            *(
                (key, value[quantity])
                for key, value in diagnosis.errors.by_recording.items()
                if quantity in value
            ),
            ("all", total),
        ]
        for name, row in tables:
            rows.append(
                {
                    "quantity": quantity.split("_")[0],
                    "unit": unit,
                    "name": name,
                    "values": [f"{factor * row[stage]:.3g}" for stage in (*STAGES, "floor")],
                }
            )
    return rows


def _ranked(state: Search) -> list[Candidate]:
    return sorted(
        (candidate for candidate in state.tried.values() if candidate.names),
        key=lambda c: -state.gain(c),
    )


def _gains(diagnosis: Diagnosis) -> list[tuple[str, float]]:
    singles = [candidate for candidate in _ranked(diagnosis.state) if len(candidate.names) == 1][
        :12
    ]
    chosen = [diagnosis.verdict.chosen] if len(diagnosis.verdict.chosen.names) > 1 else []
    return [
        (" + ".join(candidate.names), diagnosis.state.gain(candidate))
        for candidate in [*chosen, *singles]
    ]


def rivals(state: Search, verdict: Verdict) -> list[dict[str, Any]]:
    """The next best sets of the chosen size and where the chosen one predicts better.

    Where none was chosen: the single effects that gain most over the plain model, and where they
    do; `ahead` is the log-likelihood gained, which may be above 0, and `probability` what it comes
    to.
    """
    chosen = verdict.chosen
    rows = []
    others = [rival for rival in _ranked(state) if set(rival.names) != set(chosen.names)]
    for c in [other for other in others if len(other.names) == max(len(chosen.names), 1)][:4]:
        better, worse = (chosen, c) if chosen.names else (c, chosen)
        parts = better.evidence.parts(worse.evidence, chosen.evidence)
        channel, recording = max(parts, key=lambda k: parts[k])
        rows.append(
            {
                "names": " + ".join(c.names),
                "ahead": state.gain(c) - state.gain(chosen),
                "probability": sum(
                    probability
                    for names, probability in verdict.hypotheses
                    if set(c.names) <= set(names)
                ),
                "where": f"{channel.replace('_', ' ')} in {recording}",
                "scale": (
                    c.evidence.scale[channel, recording],
                    chosen.evidence.scale[channel, recording],
                ),
            }
        )
    return rows


def _group(diagnosis: Diagnosis) -> list[str]:
    names = [
        member
        for name, rivals in diagnosis.verdict.ambiguous.items()
        if rivals
        for member in (name, *rivals)
    ]
    return list(dict.fromkeys(names))
