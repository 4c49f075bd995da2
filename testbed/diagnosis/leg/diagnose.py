"""`testbed diagnose`: what the believed model of one axis lacks."""

from __future__ import annotations

import numpy as np

from testbed.diagnosis.leg.amplitude import with_amplitudes
from testbed.diagnosis.leg.base_models import declared, fit_base
from testbed.diagnosis.leg.evidence import Evidence
from testbed.diagnosis.leg.findings import Diagnosis, entries_of
from testbed.diagnosis.leg.fit import block_covariance
from testbed.diagnosis.leg.generic import correction
from testbed.diagnosis.leg.problem import Problem
from testbed.diagnosis.leg.search import Progress, search
from testbed.diagnosis.leg.series import series_of
from testbed.diagnosis.leg.unexplained import unexplained
from testbed.diagnosis.leg.verdict import decide
from testbed.diagnosis.leg.verification import errors
from testbed.effects import build
from testbed.errors import InputError
from testbed.recording.axis import Rig
from testbed.recording.leg_model import EffectEntry, LegModel

MOST_EFFECTS = {"vertical-leg": 2, "cylinder": 3, "drive": 3}
"""How many effects are looked for: bench axes of the measured kind are less well declared than legs."""


def diagnose(
    rig: Rig, progress: Progress | None = None, model: LegModel | None = None
) -> Diagnosis:
    """Fit, search, judge. Nothing is fitted or chosen on `rig.verify`; it only gives the errors.

    `model`: believed instead of what the rig declares; its effects are taken for granted, and what is looked for is
    what it lacks. Raises InputError where the recordings cannot show friction (the piston does not slide both ways),
    or for a model of another kind of rig.
    """
    tell = progress or (lambda _: None)
    for recording in (*rig.identify, *rig.verify):
        if recording.reference_force_n is None:
            raise InputError(
                "the external force is not known", file=recording.folder, field="reference_force"
            )
    base = declared(rig) if model is None else believed(rig, model)
    granted = build(base.effects)
    series = series_of(rig.identify, base.known)
    with_flow = base.known.declares_flow and all(s.opening is not None for s in series)
    tell("friction before")
    free = tuple(s for s in series if s.free) or series
    before = model or fit_base(Problem(free, base, with_flow))[1]
    tell("friction on everything")
    problem = Problem(series, base, with_flow, granted)
    fit, refit = fit_base(problem)
    state = search(problem, fit, MOST_EFFECTS[rig.kind], tell)
    tell("what is left")
    found = unexplained(state, rig.identify)
    verdict = decide(state, found)
    models = {"before": before, "refit": refit, "after": refit}
    entries: tuple[EffectEntry, ...] = ()
    new = {*verdict.chosen.names}
    if verdict.kind == "effect":
        chosen = verdict.chosen
        entries = entries_of(
            chosen.fit, _memory(chosen.evidence), block_covariance(problem, chosen.fit)
        )
        entries = with_amplitudes(problem, entries, chosen.fit.at)
        models["after"] = chosen.fit.model(problem.base).model_copy(update={"effects": entries})
    generic = correction(problem, fit) if verdict.kind == "unnamed" else None
    if generic is not None:
        models["after"] = generic.model(problem.base).model_copy(
            update={"effects": entries_of(generic, 1.0)}
        )
    tell("errors on verify")
    checks = series_of(rig.verify, refit.known)
    table = errors(
        rig.verify, checks, models, with_flow and all(s.opening is not None for s in checks)
    )
    new_entries = tuple(e for e in entries if e.name in new)
    return Diagnosis(rig, problem, state, found, verdict, models, new_entries, table)


def believed(rig: Rig, model: LegModel) -> LegModel:
    """A model to start from, checked against the rig. Raises InputError for another kind of rig."""
    if model.rig != rig.kind:
        raise InputError(
            "is a model of another kind of rig",
            field="--model rig",
            value=model.rig,
            allowed=rig.kind,
        )
    return model


def _memory(found: Evidence) -> float:
    """Typical correlation time of the moving groups' residuals, bins."""
    values = [v for k, v in found.memory.items() if k[0] in ("force", "flow_a", "flow_b")]
    return float(np.median(values)) if values else 1.0
