"""A channel that rides along goes with friction that it makes larger, however that turns round."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from testbed.benchmarks.diagnosis.bench_rigs import make_bench
from testbed.diagnosis.leg.base_models import declared, first_friction
from testbed.diagnosis.leg.companions import companions
from testbed.diagnosis.leg.fit import solve
from testbed.diagnosis.leg.points import Point, friction_coordinates
from testbed.diagnosis.leg.problem import Problem
from testbed.diagnosis.leg.series import series_of
from testbed.effects import by_name
from testbed.effects.active import Active
from testbed.estimation.leg.balance import force_terms, friction_n
from testbed.estimation.leg.flow import Edges

SOUND = 16
"""A drive that lacks nothing."""
REACH_M = 2e-3
"""After which the damper's friction has turned round."""
CURRENTS_A = (0.5, 0.9, 1.6)
"""One a run: what holds still within a run tells only from the other runs."""


@pytest.mark.parametrize(("recorded", "told"), [(True, True), (False, False)])
def test_a_current_that_holds_still_within_each_run_goes_with_a_damper_that_turns_round_slowly(
    recorded: bool, told: bool
) -> None:
    rig = make_bench(SOUND)[0]
    base = declared(rig)
    plain = series_of(rig.identify, base.known)
    friction, scale_n = first_friction(plain, base, bench=False)
    stiffness = friction.coulomb_plus_n / REACH_M
    bristles = by_name("friction.presliding")
    values = bristles.complete({"stiffness": stiffness, "damping": 0.0})
    bristle = Active(bristles, values)
    model = base.model_copy(update={"friction": friction})
    damped = []
    for series, current_a in zip(plain, CURRENTS_A, strict=True):
        signals = series.signals
        terms = force_terms(model, signals, (bristle,))
        damper_n = current_a * friction_n(friction, signals, terms)
        force_n = terms.mass_kg * signals.acceleration_m_s2 + damper_n
        ride = np.full_like(force_n, current_a if recorded else 1.0)
        ride[::2] += 1e-3
        forced = signals.with_(actuator_force_n=force_n)
        damped.append(replace(series, signals=forced, extra={"current": ride}))
    problem = Problem(tuple(damped), base, False)
    coordinates = friction_coordinates(friction, scale_n)
    fit = solve(problem, coordinates, Point(friction, Edges(), (bristle,)))
    falls = companions(problem, fit)
    assert (falls.get("current", 0.0) > 0.9) == told
