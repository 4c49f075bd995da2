"""The diagnosis on random rigs of the reference leg: one rig, what was hidden, what was said."""

from __future__ import annotations

import time
from itertools import permutations
from typing import Any

from testbed.benchmarks.reference_leg.rigs import Hidden, make_rig
from testbed.diagnosis.leg.base_models import declared, fit_base
from testbed.diagnosis.leg.diagnose import diagnose
from testbed.diagnosis.leg.entries import entries_of
from testbed.diagnosis.leg.evidence import evidence, of_residual
from testbed.diagnosis.leg.findings import Diagnosis, as_json
from testbed.diagnosis.leg.fit import Fit
from testbed.diagnosis.leg.hypotheses import fit_shapes, fit_with
from testbed.diagnosis.leg.problem import Problem
from testbed.diagnosis.leg.search import Candidate
from testbed.diagnosis.leg.series import series_of
from testbed.diagnosis.leg.signs import signs
from testbed.diagnosis.leg.unexplained import fit_generic
from testbed.diagnosis.leg.verification import STAGES, Errors, closed_share, errors
from testbed.effects import OF_A_CYLINDER, by_name
from testbed.recording.leg_model import LegModel

KINDS = ("single", "single", "clean", "double", "outside", "single", "double", "outside")
"""In turn, so that every prefix of the run holds every kind."""
VISIBLE = 0.05


def trial(seed: int) -> dict[str, Any]:
    """One rig: make it, diagnose it, and compare with what an oracle that knows the names would
    reach.
    """
    kind = KINDS[seed % len(KINDS)]
    rig, hidden = make_rig(seed, kind)
    began = time.perf_counter()
    found = diagnose(rig)
    seconds = time.perf_counter() - began
    oracle = _oracle(found, hidden)
    sound = _sound_twin(found, seed, kind) if hidden.names else None
    box = _model(found, fit_generic(found.problem, found.state.refit.fit, seal=False))
    return {
        "seed": seed,
        "kind": kind,
        "truth": list(hidden.names),
        "strength": list(hidden.strengths),
        "form": list(hidden.forms),
        "numbers": hidden.numbers,
        "seconds": seconds,
        "visible": _visible(oracle) if oracle else sound is not None and _differs(found, sound),
        "verdict": found.verdict.kind,
        "names": [entry.name for entry in found.entries],
        "hypotheses": as_json(found)["hypotheses"],
        "parameters": {
            entry.name: {
                name: [parameter.value, parameter.interval90]
                for name, parameter in entry.parameters.items()
            }
            for entry in found.entries
        },
        "error": found.errors.by_recording,
        "sound": sound,
        "oracle": oracle.by_recording if oracle else None,
        "closed_force": closed_share(found.errors),
        "closed_flow": closed_share(found.errors, "flow_m3_s"),
        "oracle_closed_force": closed_share(oracle) if oracle else None,
        "black_box_closed_force": closed_share(_errors(found, box)),
        "raw_bic": _raw_bic(found),
        "signs": signs(found.state, found.found).as_json(),
    }


def _model(diagnosis: Diagnosis, fit: Fit) -> LegModel:
    return diagnosis.models["refit"].model_copy(
        update={"friction": fit.at.friction, "effects": entries_of(fit, 1.0)}
    )


def _errors(diagnosis: Diagnosis, after: LegModel) -> Errors:
    series = series_of(diagnosis.rig.verify, diagnosis.models["refit"].known)
    return errors(
        diagnosis.rig.verify,
        series,
        diagnosis.models | {"after": after},
        diagnosis.problem.with_flow,
    )


def _oracle(diagnosis: Diagnosis, hidden: Hidden) -> Errors | None:
    """Errors with the true names fitted on identify; None where there is no name."""
    if not hidden.names or not set(hidden.names) <= {effect.name for effect in OF_A_CYLINDER}:
        return None
    found = [_named(diagnosis, order) for order in permutations(hidden.names)]
    if (known := diagnosis.state.tried.get(frozenset(hidden.names))) is not None:
        found.append(known)
    return _errors(diagnosis, _model(diagnosis, max(found, key=diagnosis.state.gain).fit))


def _named(diagnosis: Diagnosis, names: tuple[str, ...]) -> Candidate:
    """The set of these names, each fitted after the one before, with further shapes where they
    predict better.
    """
    current = diagnosis.state.refit
    for name in names:
        effect = by_name(name)
        fits = [fit_with(diagnosis.problem, current.fit, effect)]
        if effect.shapes:
            fits.append(fit_shapes(diagnosis.problem, fits[0], effect))
        options = [
            Candidate((*current.names, name), fit, evidence(diagnosis.problem, fit)) for fit in fits
        ]
        current = max(options, key=diagnosis.state.gain)
    return current


def _visible(oracle: Errors) -> bool:
    rows = [error for row in oracle.by_recording.values() for error in row.values()]
    return any(row["after"] < (1.0 - VISIBLE) * row["refit"] for row in rows)


Table = dict[str, dict[str, float]]


def _sound_twin(diagnosis: Diagnosis, seed: int, kind: str) -> Table:
    """Recording -> quantity -> error on verify of the refitted model of the rig's twin without what
    is hidden.
    """
    twin, _ = make_rig(seed, kind, sound=True)
    series = series_of(twin.identify, twin.known)
    refit = fit_base(Problem(series, declared(twin), diagnosis.problem.with_flow))[1]
    checks = series_of(twin.verify, twin.known)
    found = errors(twin.verify, checks, dict.fromkeys(STAGES, refit), diagnosis.problem.with_flow)
    return {
        name: {quantity: errors["refit"] for quantity, errors in row.items()}
        for name, row in found.by_recording.items()
    }


def _differs(diagnosis: Diagnosis, sound: Table) -> bool:
    """An effect without a name is visible where its rig's sound twin, refitted, has an error at
    least VISIBLE lower.

    Motions in the air only: on the load cell the twin lands in its own way, and as a hundredth of
    such a recording's samples holds most of its squared error, sound twins differ among themselves
    by tens of per cent.
    """
    return any(
        errors < (1.0 - VISIBLE) * diagnosis.errors.by_recording[name][quantity]["refit"]
        for name, row in sound.items()
        for quantity, errors in row.items()
        if not name.startswith("press")
    )


def _raw_bic(diagnosis: Diagnosis) -> list[str]:
    """What a stepwise search by the plain criterion would name: every sample a witness, no held-out
    blocks.
    """
    import numpy as np

    def score(fit: Fit) -> float:
        found = of_residual(diagnosis.problem, fit.residual)
        samples = sum(found.count.values())
        return sum(found.log_likelihood.values()) - 0.5 * len(fit.coordinates) * float(
            np.log(samples)
        )

    best = max(diagnosis.state.tried.values(), key=lambda c: score(c.fit))
    return list(best.names)
