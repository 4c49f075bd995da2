"""What a diagnosis of the whole robot found, as `findings.json` and model files carry it."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from testbed.diagnosis.leg.findings import (
    FORMAT,
    effect_json,
    hypotheses_json,
    numbers_in_words,
    write_models,
)
from testbed.diagnosis.robot.diagnose import RobotDiagnosis
from testbed.effects import kind_of, place_of
from testbed.formats.files import make_folder, write_json
from testbed.recording.leg_model import EffectEntry


def found_entries(d: RobotDiagnosis) -> tuple[EffectEntry, ...]:
    """The findings among the model's effects: those at one place; the others are declared of all legs."""
    new = set(d.verdict.chosen.names) if d.verdict.kind == "effect" else set()
    return tuple(e for e in d.entries if f"{e.name}@{e.place}" in new)


def as_json(d: RobotDiagnosis) -> dict[str, Any]:
    """The contents of findings.json; an effect has a `place` beside its name, a hypothesis is `name@place`."""
    return {
        "format": FORMAT,
        "rig": d.name,
        "verdict": d.verdict.kind,
        "effects": [effect_json(entry, d.verdict) for entry in found_entries(d)],
        "hypotheses": hypotheses_json(d.verdict),
        "error": {
            "force_n": d.total(),
            "by_recording": {axis: {"force_n": row} for axis, row in d.errors.items()},
        },
        "left_out": [{"name": x.name, "reason": x.reason} for x in d.state.left_out],
    }


def write_findings(d: RobotDiagnosis, out: Path) -> None:
    """Write findings.json and the three model files. Raises InputError where `out` cannot be written."""
    make_folder(out)
    write_json(out / "findings.json", as_json(d))
    write_models(d.models, out)


def summary_rows(d: RobotDiagnosis) -> tuple[list[str], list[list[str]]]:
    """(header, rows) of a short table: leg and effect, and the residuals kept back."""
    rows = []
    for entry in found_entries(d):
        probability = d.verdict.probability(f"{entry.name}@{entry.place}")
        rows.append(
            [
                f"{entry.place}: {entry.name}",
                numbers_in_words(entry),
                f"probability {probability:.3f}",
            ]
        )
    for axis, row in d.errors.items():
        rows.append(
            [
                axis,
                ", ".join(f"{k} {v:.0f}" for k, v in row.items()),
                "residual against expected load, N",
            ]
        )
    return ["", "value", ""], rows


def spoken(name: str) -> str:
    """`sensor.gain_a@fl_vertical` as a person says it."""
    place = place_of(name)
    return f"{kind_of(name)} at {place.replace('_', ' ')}" if place else kind_of(name)
