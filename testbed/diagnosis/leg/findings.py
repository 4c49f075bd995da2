"""What a diagnosis found, as `findings.json` and model files carry it."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from testbed.diagnosis.leg.acceptance import Proof
from testbed.diagnosis.leg.entries import memory_of
from testbed.diagnosis.leg.hypotheses import LeftOut
from testbed.diagnosis.leg.problem import Problem
from testbed.diagnosis.leg.search import Search
from testbed.diagnosis.leg.unexplained import Unexplained
from testbed.diagnosis.leg.used_numbers import used_numbers
from testbed.diagnosis.leg.valve_edges import edges_of
from testbed.diagnosis.leg.verdict import Verdict
from testbed.diagnosis.leg.verification import Errors
from testbed.effects import by_name
from testbed.effects.base import MARK
from testbed.estimation.friction.declared_numbers import Used
from testbed.formats.files import make_folder, write_json
from testbed.formats.intervals import rounded, unit_name
from testbed.recording.axis import Rig
from testbed.recording.leg_model import EffectEntry, LegModel, Parameter, write_model

FORMAT = "roboclimber-findings/1"
LEAST_PROBABILITY = 5e-4


@dataclass(frozen=True, eq=False)
class Diagnosis:
    """Everything about one rig: the search, the verdict, the three models and their errors on
    `verify`.
    """

    rig: Rig
    problem: Problem
    state: Search
    found: Unexplained
    verdict: Verdict
    models: dict[str, LegModel]
    entries: tuple[EffectEntry, ...]
    errors: Errors
    proof: Proof | None = None
    """Of a bench or a drive: which names passed their trials, and the errors of recordings left
    out.
    """
    companions: Mapping[str, float] = field(default_factory=dict)
    """Channel that rides along -> share by which it lowers what the names leave, whatever the
    verdict.
    """

    @property
    def left_out(self) -> list[LeftOut]:
        """Hypotheses that this data cannot show."""
        return self.state.left_out

    @property
    def valve_edges(self) -> dict[str, Parameter]:
        """Sizes of the valve's edges against its plate, fitted beside what was found."""
        chosen = self.verdict.chosen
        return edges_of(self.problem, chosen.fit, memory_of(chosen.evidence))

    @property
    def used(self) -> tuple[Used, ...]:
        """Declared numbers that the final model has otherwise."""
        return used_numbers(self.rig.known, self.models["after"].known)


def as_json(diagnosis: Diagnosis) -> dict[str, Any]:
    """The contents of findings.json."""
    quantities = {
        quantity: diagnosis.errors.total(quantity) for quantity in ("force_n", "flow_m3_s")
    }
    trials = {} if diagnosis.proof is None else trials_json(diagnosis.proof)
    return {
        "format": FORMAT,
        "rig": diagnosis.rig.name,
        "verdict": diagnosis.verdict.kind,
        "effects": [effect_json(entry, diagnosis.verdict) for entry in diagnosis.entries],
        "hypotheses": hypotheses_json(diagnosis.verdict),
        "error": {name: quantity for name, quantity in quantities.items() if quantity}
        | {"by_recording": diagnosis.errors.by_recording},
        "left_out": [
            {"name": recording.name, "reason": recording.reason} for recording in diagnosis.left_out
        ],
        **({"valve_edges": parameters_json(edges)} if (edges := diagnosis.valve_edges) else {}),
        **({"declared": {one.name: vars(one) for one in used}} if (used := diagnosis.used) else {}),
        **({"goes_with": dict(diagnosis.verdict.goes_with)} if diagnosis.verdict.goes_with else {}),
        **trials,
    }


def trials_json(proof: Proof) -> dict[str, Any]:
    """Names that passed their trials (whatever the verdict), share of resampled rigs that would
    name each again, names refused with the reason, errors of runs left out, N.
    """
    return {
        "passed": list(proof.kept.names),
        "repeated": dict(proof.repeated),
        "refused": [{"name": name, "reason": why} for name, why in proof.refused.items()],
        "error_of_runs_left_out_n": {name: dict(error) for name, error in proof.run_errors.items()},
    }


def effect_json(entry: EffectEntry, verdict: Verdict) -> dict[str, Any]:
    """A found effect as findings.json carries it; one at a place with its place."""
    name = entry.name if entry.place is None else f"{entry.name}{MARK}{entry.place}"
    return {
        "name": entry.name,
        **({} if entry.place is None else {"place": entry.place}),
        "probability": round(verdict.probability(name), 4),
        "ambiguous_with": list(verdict.ambiguous.get(name, ())),
        "at_bounds": list(verdict.at_bounds.get(name, ())),
        "parameters": parameters_json(entry.parameters),
        "equation": by_name(entry.name).equation,
    }


def parameters_json(parameters: Mapping[str, Parameter]) -> dict[str, Any]:
    """Numbers with their units and intervals as findings.json carries them."""
    return {
        key: {
            "value": parameter.value,
            "unit": parameter.unit,
            "interval90": list(parameter.interval90) if parameter.interval90 else None,
        }
        for key, parameter in parameters.items()
    }


def numbers_in_words(parameters: Mapping[str, Parameter]) -> str:
    """`slope 0.90 (0.81 to 0.99), delay 0.01 s`: with the 90 % interval where there is one."""
    return ", ".join(f"{name} {_in_words(number)}" for name, number in parameters.items())


def _in_words(number: Parameter) -> str:
    unit = unit_name(number.unit or "")
    if number.interval90 is None:
        return f"{number.value:.4g} {unit}".strip()
    value, low, high = rounded(number.value, number.interval90)
    return f"{value} ({low} to {high}) {unit}".strip()


def write_models(models: Mapping[str, LegModel], out: Path) -> None:
    """Write the three model files. Raises InputError where `out` cannot be written."""
    for stage, name in (("before", "model_before"), ("refit", "model_refit"), ("after", "model")):
        write_model(out / f"{name}.yaml", models[stage])


def hypotheses_json(verdict: Verdict) -> list[dict[str, Any]]:
    """Sets with a probability above LEAST_PROBABILITY, rounded so that they add up to 1 exactly."""
    kept = [
        (names, probability)
        for names, probability in verdict.hypotheses
        if probability > LEAST_PROBABILITY
    ]
    total = sum(probability for _, probability in kept)
    rounded = [round(probability / total, 4) for _, probability in kept]
    rounded[0] = round(rounded[0] + 1.0 - sum(rounded), 4)
    return [
        {"names": list(names), "probability": probability}
        for (names, _), probability in zip(kept, rounded, strict=True)
    ]


def summary_rows(diagnosis: Diagnosis) -> tuple[list[str], list[list[str]]]:
    """(header, rows) of a short table: the verdict, what is missing, and the errors on verify."""
    verdict = diagnosis.verdict
    rows = [["verdict", verdict.kind, f"probability {verdict.hypotheses[0][1]:.3f}"]]
    for entry in diagnosis.entries:
        said = f"probability {verdict.probability(entry.name):.3f}"
        ended = verdict.at_bounds.get(entry.name, ())
        said += f", {' and '.join(ended)} at a bound" if ended else ""
        rivals = ", ".join(verdict.ambiguous.get(entry.name, ()))
        rows.append(
            [
                entry.name,
                numbers_in_words(entry.parameters),
                f"{said}, not distinguished from {rivals}" if rivals else said,
            ]
        )
    for channel, share in verdict.goes_with.items():
        lowered = f"lowers by {100 * share:.0f} % what is left of recordings left out"
        rows.append(["candidate", f"{channel} (rides along)", lowered])
    if edges := diagnosis.valve_edges:
        sizes = ", ".join(f"{edge.upper()} {size.value:.3f}" for edge, size in edges.items())
        rows.append(["valve edges", sizes, "flow over the plate's, fitted; no finding"])
    rows += [["declared", str(number), "no finding"] for number in diagnosis.used]
    for quantity, unit, factor in (("force_n", "N", 1.0), ("flow_m3_s", "cm³/s", 1e6)):
        total = diagnosis.errors.total(quantity)
        if total:
            rows.append(
                [
                    f"error, {unit}",
                    ", ".join(f"{name} {factor * value:.3g}" for name, value in total.items()),
                    "root mean square on verify",
                ]
            )
    return ["what", "value", "remark"], rows


def write_findings(diagnosis: Diagnosis, out: Path) -> None:
    """Write findings.json and the three model files. Raises InputError where `out` cannot be
    written.
    """
    make_folder(out)
    write_json(out / "findings.json", as_json(diagnosis))
    write_models(diagnosis.models, out)
