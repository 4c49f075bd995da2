"""What no formula is true to: a share of the friction and of the metered flow of a motion."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from testbed.benchmarks.diagnosis.bench_rigs import make_bench
from testbed.benchmarks.reference_leg.rigs import make_rig
from testbed.diagnosis.leg.base_models import declared, fit_base
from testbed.diagnosis.leg.model_form_error import (
    FRICTION_FORM,
    FRICTION_FORM_OF_BENCHES,
    METERING_FORM,
    form_floors,
)
from testbed.diagnosis.leg.problem import Problem
from testbed.diagnosis.leg.series import series_of
from testbed.recording.leg_model import Friction


def test_it_is_a_share_of_the_friction_of_both_ways_and_of_the_flow_that_moves_the_piston() -> None:
    rig, _ = make_rig(12, "clean")
    base = declared(rig)
    problem = Problem(series_of(rig.identify[:1], base.known), base, True)
    fit, _ = fit_base(problem)
    (one,) = problem.series
    for plus, minus in ((300.0, 300.0), (500.0, 100.0)):  # a constant force apart
        dry = Friction(coulomb_plus_n=plus, coulomb_minus_n=minus)
        found = form_floors(problem, replace(fit, at=replace(fit.at, friction=dry)))
        assert found["force", one.name] == pytest.approx(FRICTION_FORM * 300.0)
    moving = one.trusted & one.clear
    swept = base.known.area_a_m2 * float(np.sqrt(np.mean(one.signals.velocity_m_s[moving] ** 2)))
    assert found["flow_a", one.name] == pytest.approx(METERING_FORM * swept, rel=0.05)
    assert set(found) == {(part, one.name) for part in ("force", "flow_a", "flow_b")}


def test_of_a_bench_it_is_all_that_a_sound_one_may_leave() -> None:
    rig, _ = make_bench(16)
    base = declared(rig)
    problem = Problem(series_of(rig.identify, base.known), base, False)
    fit, _ = fit_base(problem)
    dry = Friction(coulomb_plus_n=30.0, coulomb_minus_n=30.0)
    found = form_floors(problem, replace(fit, at=replace(fit.at, friction=dry)))
    assert set(found) == {("force", one.name) for one in problem.series}
    assert list(found.values()) == pytest.approx([FRICTION_FORM_OF_BENCHES * 30.0] * len(found))
