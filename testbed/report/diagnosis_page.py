"""`report.html` of a diagnosis: what the model lacks, why that and not its rival, and what it is
worth.
"""

from __future__ import annotations

from typing import Any

from testbed.diagnosis.leg.experiments import experiments
from testbed.diagnosis.leg.findings import Diagnosis, as_json
from testbed.diagnosis.leg.search import Candidate, Search
from testbed.diagnosis.leg.verdict import Verdict
from testbed.diagnosis.leg.verification import STAGES, closed_share
from testbed.effects import by_name
from testbed.report.diagnosis_figures import evidence_figure, flow_figure, residual_figure
from testbed.report.page import render
from testbed.report.words import words

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
