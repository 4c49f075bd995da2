"""`testbed diagnose`: what does the believed model of one axis lack?"""

from __future__ import annotations

import numpy as np

from testbed.diagnosis.leg.base_models import declared, fit_base
from testbed.diagnosis.leg.errors import errors
from testbed.diagnosis.leg.evidence import Evidence
from testbed.diagnosis.leg.findings import Diagnosis, entries_of
from testbed.diagnosis.leg.fit import block_covariance
from testbed.diagnosis.leg.generic import correction
from testbed.diagnosis.leg.problem import Point, Problem
from testbed.diagnosis.leg.search import Progress, search
from testbed.diagnosis.leg.series import series_of
from testbed.diagnosis.leg.unexplained import unexplained
from testbed.diagnosis.leg.verdict import decide
from testbed.effects import Active, build
from testbed.errors import InputError
from testbed.recording.axis import Rig
from testbed.recording.leg_model import EffectEntry, Friction, LegModel

MOST_EFFECTS = {"vertical-leg": 2, "cylinder": 3, "drive": 3}
"""How many effects are looked for: bench axes of the measured kind are less well declared than legs."""

AMPLITUDE_FORM = 0.035
"""Half of the interval of a narrow band's amplitude, as a share of it, at least: smoothing damps it not exactly as
reckoned."""


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
        entries = _with_amplitude(problem, entries, chosen.fit.at)
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


def _with_amplitude(
    problem: Problem, entries: tuple[EffectEntry, ...], at: Point
) -> tuple[EffectEntry, ...]:
    """The amplitude of a narrow-band force is measured, not fitted: root mean square of its band times sqrt 2."""
    if "force.periodic" not in [a.effect.name for a in at.effects]:
        return entries
    value, spread = _amplitude(problem, at.friction, at.effects)
    out = []
    for entry in entries:
        if entry.name == "force.periodic":
            old = entry.parameters["amplitude"]
            new = old.model_copy(
                update={"value": value, "interval90": (value - spread, value + spread)}
            )
            entry = entry.model_copy(update={"parameters": {**entry.parameters, "amplitude": new}})
        out.append(entry)
    return tuple(out)


def _amplitude(
    problem: Problem, friction: Friction, effects: tuple[Active, ...]
) -> tuple[float, float]:
    """(amplitude N, half of its 90 % interval) from the band in each recording."""
    from testbed.estimation.leg.balance import corrected, force_terms, without_friction_n
    from testbed.estimation.leg.force import narrow_band
    from testbed.estimation.leg.friction import friction_n

    found, weight = [], []
    for s in problem.series:
        signals = corrected(s.signals, effects)
        terms = force_terms(problem.base, signals, effects)
        raw = without_friction_n(signals, terms) - friction_n(friction, signals, terms)
        raw = raw - (s.reference_n if s.reference_n is not None else 0.0)
        frequency, _, _ = terms.narrow_bands[0]
        band = narrow_band(raw, s.trusted, signals, frequency)
        # Every channel went through the same smoothing: the band was damped by it.
        damped = float(np.exp(-0.5 * (2.0 * np.pi * frequency * s.width_s) ** 2))
        if s.trusted.sum() > 200:
            found.append(float(np.sqrt(2.0 * np.mean(band[s.trusted] ** 2))) / damped)
            weight.append(float(s.trusted.sum()))
    mean = float(np.average(found, weights=weight))
    spread = 1.645 * float(
        np.sqrt(np.average((np.array(found) - mean) ** 2, weights=weight) / len(found))
    )
    return mean, max(spread, AMPLITUDE_FORM * mean)
