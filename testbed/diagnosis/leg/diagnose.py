"""`testbed diagnose` of one axis: which effects its believed model lacks."""

from __future__ import annotations

from collections.abc import Callable, Collection, Mapping
from dataclasses import dataclass, field
from functools import partial

from testbed.diagnosis.leg.acceptance import WORSE, Proof, proven
from testbed.diagnosis.leg.amplitude import with_amplitudes
from testbed.diagnosis.leg.base_models import declared, fit_base, not_declared
from testbed.diagnosis.leg.bench_correction import bench_correction, foretells_every_run
from testbed.diagnosis.leg.companions import companions
from testbed.diagnosis.leg.entries import entries_of, memory_of
from testbed.diagnosis.leg.findings import Diagnosis
from testbed.diagnosis.leg.generic import correction
from testbed.diagnosis.leg.leave_one_out import RunErrors, Runs, overall, worst_ratio
from testbed.diagnosis.leg.prediction import block_covariance
from testbed.diagnosis.leg.problem import Problem
from testbed.diagnosis.leg.search import Progress, Search, search
from testbed.diagnosis.leg.series import series_of
from testbed.diagnosis.leg.unexplained import Unexplained, unexplained
from testbed.diagnosis.leg.verdict import Verdict, decide, decide_on_bench
from testbed.diagnosis.leg.verification import errors
from testbed.effects import build, check_channels
from testbed.effects.unnamed import UNNAMED
from testbed.errors import InputError
from testbed.estimation.friction.identification import identify_rig
from testbed.recording.axis import Rig
from testbed.recording.leg_model import EffectEntry, LegModel

MOST_EFFECTS = {"vertical-leg": 2, "cylinder": 3, "drive": 3}
"""Largest number of effects in one model: bench axes are declared less completely than legs."""


def diagnose(
    rig: Rig, progress: Progress | None = None, model: LegModel | None = None
) -> Diagnosis:
    """Diagnose a rig. Nothing is fitted or chosen on `rig.verify`, which only gives the errors.

    In order: fit the published model (`before`, `refit`), search for effects, decide on a verdict,
    build the final model (`after`), compute the errors. `model`: believed in place of the declared
    numbers; its effects are kept, and only further ones are searched for. Raises InputError if the
    recordings do not declare their external force, if they cannot show friction (the piston has to
    slide both ways), or for a model of another kind of rig.
    """
    tell = progress or (lambda _: None)
    for recording in (*rig.identify, *rig.verify):
        recording.known_force_n()  # refused before anything is fitted
    identified = identify_rig(rig).model
    base = declared(rig, identified) if model is None else believed(rig, model)
    unknown = not_declared(rig) if model is None else ()
    granted = build(base.effects)
    series = series_of(rig.identify, base.known)
    with_flow = base.known.declares_flow and all(one.opening is not None for one in series)
    tell("friction before")
    free = tuple(one for one in series if one.free) or series
    before = model or fit_base(Problem(free, base, with_flow, (), unknown))[1]
    tell("friction on everything")
    problem = Problem(series, base, with_flow, granted, unknown)
    fit, refit = fit_base(problem)
    state = search(problem, fit, MOST_EFFECTS[rig.kind], tell)
    tell("what is left")
    judged = (
        _judged_leg(state, rig, identified)
        if rig.kind == "vertical-leg"
        else _judged_bench(state, rig, identified)
    )
    tell("errors on verify")
    models = {"before": before, "identify": identified, "refit": refit}
    models["after"], entries = _after(state, judged, models, rig)
    checks = series_of(rig.verify, refit.known)
    table = errors(
        rig.verify, checks, models, with_flow and all(check.opening is not None for check in checks)
    )
    new_entries = tuple(entry for entry in entries if entry.name in judged.verdict.chosen.names)
    return Diagnosis(
        rig,
        problem,
        state,
        judged.found,
        judged.verdict,
        models,
        new_entries,
        table,
        judged.proof,
        judged.companions,
    )


@dataclass(frozen=True, eq=False)
class _Judged:
    """The verdict on a finished search, and the evidence for it."""

    found: Unexplained
    verdict: Verdict
    proof: Proof | None = None
    companions: Mapping[str, float] = field(default_factory=dict)


def _judged_leg(state: Search, rig: Rig, identified: LegModel) -> _Judged:
    found = unexplained(state, rig.identify)
    return _Judged(found, decide(state, found, identified))


def _judged_bench(state: Search, rig: Rig, identified: LegModel) -> _Judged:
    """Keep only the names that pass their trials (acceptance.py); the rest may be an unnamed
    effect.
    """
    proof = proven(state, rig.identify)
    state.best, state.order = proof.kept, list(proof.kept.names)
    found = unexplained(state, rig.identify)
    goes_with = companions(state.problem, proof.kept.fit)
    verdict = decide_on_bench(
        state,
        found,
        proof,
        goes_with,
        lambda: (
            not state.problem.believed
            and foretells_every_run(state.problem, rig.identify, identified)
        ),
    )
    return _Judged(found, verdict, proof, goes_with)


def _after(
    state: Search, judged: _Judged, models: Mapping[str, LegModel], rig: Rig
) -> tuple[LegModel, tuple[EffectEntry, ...]]:
    """(the final model, its effects). By the verdict:

    effect: the published model with the named effects. unnamed: with a generic correction, if it
    improves recordings it was not fitted on. none, or no correction: the identified model, unless
    the refit predicts left-out recordings better; on a bench with an unnamed effect, which distorts
    the identified model less, that one.
    """
    problem, chosen = state.problem, judged.verdict.chosen
    if judged.verdict.kind == "effect":
        by_blocks = block_covariance(problem, chosen.fit)
        entries = entries_of(chosen.fit, memory_of(chosen.evidence), by_blocks)
        entries = _of_model(problem, with_amplitudes(problem, entries, chosen.fit.at), chosen.names)
        return chosen.fit.model(problem.base).model_copy(update={"effects": entries}), entries
    if judged.proof is not None and not problem.believed:
        if judged.verdict.kind == "none":
            runs = Runs.of(problem, rig.identify)
            estimates = partial(runs.estimates, state.refit.fit)
            return models[nothing_lacking(judged.proof, judged.found.excess, estimates)], ()
        return bench_correction(problem, rig.identify, models["identify"]) or models["identify"], ()
    generic = correction(problem, state.refit.fit) if judged.verdict.kind == "unnamed" else None
    if generic is None and problem.believed:
        return models["refit"], ()
    if generic is None:
        by_refit, identified = Runs.of(problem, rig.identify).estimates(state.refit.fit)
        return models["refit" if _better(by_refit, identified) else "identify"], ()
    entries = _of_model(problem, entries_of(generic, 1.0), (UNNAMED.name,))
    return generic.model(problem.base).model_copy(update={"effects": entries}), ()


def _of_model(
    problem: Problem, entries: tuple[EffectEntry, ...], names: Collection[str]
) -> tuple[EffectEntry, ...]:
    """The effects that a model is given: those that are believed and those of some names, and not
    what every sound leg has a little of.
    """
    wanted = {*names, *(active.effect.name for active in problem.believed)}
    return tuple(entry for entry in entries if entry.name in wanted)


NEAR_FLOOR = 5.0
"""Largest residual of a bench for which the refit may be chosen, in units of the sensors' floor. On
measured seals with more, left-out runs favoured refits that were up to 45 % worse elsewhere.
"""


def nothing_lacking(
    proof: Proof, excess: float, estimates: Callable[[], tuple[RunErrors, RunErrors]]
) -> str:
    """The final model of a bench that lacks nothing: `refit` if its residual is small and it
    predicts left-out runs better, by the bins that are fitted as by the estimated force that a
    diagnosis is judged by, else `identify`.

    `excess`: residual of the refit over the sensors' floor. `estimates`: gives the errors of the
    runs' estimated force by the refit and as identified (`Runs.estimates`).
    """
    by_bins = proof.run_errors["refit"], proof.run_errors["identify"]
    carries_over = excess < NEAR_FLOOR and _better(*by_bins) and _better(*estimates())
    return "refit" if carries_over else "identify"


def _better(errors: RunErrors, against: RunErrors) -> bool:
    """Better over all runs, and on none of them worse by more than is promised."""
    return overall(errors) < overall(against) and worst_ratio(errors, against) <= WORSE


def believed(rig: Rig, model: LegModel) -> LegModel:
    """A model to start from, checked against the rig. Raises InputError for another kind of rig."""
    if model.rig != rig.kind:
        raise InputError(
            "is a model of another kind of rig",
            field="--model rig",
            value=model.rig,
            allowed=rig.kind,
        )
    for recording in (*rig.identify, *rig.verify):
        check_channels(model, recording)
    return model
