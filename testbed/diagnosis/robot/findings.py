"""What a diagnosis of the whole robot found, as `findings.json` and model files carry it."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

from testbed.diagnosis.leg.findings import FORMAT, LEAST_PROBABILITY, numbers_in_words
from testbed.diagnosis.robot.diagnose import RobotDiagnosis
from testbed.diagnosis.robot.groups import FORCES, GROUND, LINE, ROPES
from testbed.diagnosis.robot.parameters import Found
from testbed.effects import by_name, kind_of, place_of
from testbed.formats.files import make_folder, write_json
from testbed.recording.robot_model import PlacedEffect, RobotModelFile, write_robot_model

QUANTITIES = {
    FORCES: "force_n",
    "feet": "foot_place_m",
    "supply": "supply_pa",
    ROPES: "rope_stiffness_share",
    GROUND: "ground_rad",
}
"""Group -> how its error is called; the oil's are `flow_m3_s`, the lines' `force_n`."""


def as_json(d: RobotDiagnosis) -> dict[str, Any]:
    """The contents of findings.json; an effect has a `place` beside its name, a hypothesis is
    `name@place`.
    """
    listed = [(names, p) for names, p in d.verdict.hypotheses if p >= LEAST_PROBABILITY]
    total = sum(p for _, p in listed)
    return {
        "format": FORMAT,
        "rig": d.name,
        "verdict": d.verdict.kind,
        "effects": [_effect(d, found) for found in d.found],
        **({"believed": not d.not_believed} if d.found else {}),
        **({"not_believed": d.not_believed} if d.found and d.not_believed else {}),
        "hypotheses": [{"names": list(names), "probability": p / total} for names, p in listed],
        "error": {
            "force_n": d.errors[FORCES],
            "by_recording": {
                group: {_quantity(group): dict(row)} for group, row in d.errors.items()
            },
        },
        "left_out": [
            {"name": kind, "reason": f"{UNSEEN} {', '.join(places)}"}
            for kind, places in d.left_out.items()
        ],
        **({"resembles": d.resembles} if d.resembles else {}),
        **({"beyond": d.beyond} if d.beyond else {}),
        **({"not_recalled": dict(d.not_recalled)} if d.not_recalled else {}),
    }


def _quantity(group: str) -> str:
    of_oil = "force_n" if group.startswith(LINE) else "flow_m3_s"
    return QUANTITIES.get(group, of_oil)


def _effect(d: RobotDiagnosis, found: Found) -> dict[str, Any]:
    effect = by_name(found.kind)
    return {
        "name": found.kind,
        "place": found.place,
        "probability": d.verdict.probability(found.name),
        "believed": found.name in {believed.name for believed in d.believed},
        "ambiguous_with": list(d.verdict.ambiguous.get(found.name, ())),
        "parameters": {
            key: {"value": p.value, "unit": p.unit, "interval90": list(p.interval90 or ())}
            for key, p in found.parameters.items()
        },
        "equation": effect.equation,
    }


def models(d: RobotDiagnosis, believed: RobotModelFile) -> dict[str, RobotModelFile]:
    """`before`, `refit` and `after`: what was believed, and that with what was found, unless its
    place or size is in doubt or forces that were kept back are predicted worse with it. Of a robot
    nothing is refitted that all machines share: its numbers are commissioning's.
    """
    new = tuple(
        PlacedEffect(name=f.kind, place=f.place, parameters=dict(f.parameters)) for f in d.believed
    )
    after = believed.model_copy(update={"effects": (*believed.effects, *new)})
    return {"before": believed, "refit": believed, "after": after}


def write_findings(d: RobotDiagnosis, believed: RobotModelFile, out: Path) -> None:
    """Write findings.json and the three model files. Raises InputError where `out` cannot be
    written.
    """
    make_folder(out)
    write_json(out / "findings.json", as_json(d))
    for stage, name in FILES.items():
        write_robot_model(out / name, models(d, believed)[stage])


UNSEEN = "one of the usual size would not be seen in this recording at"

FILES: Mapping[str, str] = {
    "before": "model_before.yaml",
    "refit": "model_refit.yaml",
    "after": "model.yaml",
}


def summary_rows(d: RobotDiagnosis) -> tuple[list[str], list[list[str]]]:
    """(header, rows) of a short table: the verdict, effects with their places, and what is missing
    on the part kept back.
    """
    rows = [["verdict", d.verdict.kind, f"probability {d.verdict.probability_of_kind:.3f}"]]
    if d.beyond:
        rows.append(["beyond what was tried", "", d.beyond])
    for found in d.found:
        probability = f"probability {d.verdict.probability(found.name):.3f}"
        rows.append([spoken(found.name), numbers_in_words(found.parameters), probability])
    error = ", ".join(f"{k} {v:.0f}" for k, v in d.errors[FORCES].items())
    rows.append(["equations of motion", error, "missing on the part kept back, N and N m"])
    if d.not_recalled:
        rows.append(["earlier recording", not_recalled(d), NOT_RECALLED])
    if d.found and d.not_believed:
        rows.append(["model.yaml", in_the_model(d), d.not_believed])
    return ["what", "value", "remark"], rows


def in_the_model(d: RobotDiagnosis) -> str:
    """What `model.yaml` has of what was found, in words."""
    return " and ".join(f"{spoken(f.name)} alone" for f in d.believed) or "as before"


def not_recalled(d: RobotDiagnosis) -> str:
    """What is not taken from the earlier recording, in words; empty where all is."""
    counts = ", ".join(f"{key.replace('_', ' ')} {count}" for key, count in d.not_recalled.items())
    return f"not recalled: {counts}" if counts else ""


NOT_RECALLED = "numbers that it shows beyond what any workshop leaves; was it sound?"


def spoken(name: str) -> str:
    """`sensor.gain_a@fl_vertical` as a person says it."""
    place = place_of(name)
    return f"{kind_of(name)} at {place.replace('_', ' ')}" if place else kind_of(name)
