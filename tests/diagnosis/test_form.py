"""What no formula is true to: a share of the friction and of the metered flow of a motion."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from testbed.benchmarks.reference_leg.rigs import make_rig
from testbed.diagnosis.leg.base_models import declared, fit_base
from testbed.diagnosis.leg.form import FRICTION_FORM, METERING_FORM, form_floors
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
