"""What a scenario or a model says is taken whole or not at all: shapes, rates, bounds of the
thrust.
"""

from __future__ import annotations

from dataclasses import replace

import pytest

from testbed.errors import InputError
from testbed.estimation.live.believed import Believed
from testbed.estimation.live.chain import EstimatorChain
from testbed.machine.build import build_machine
from testbed.recording.leg_model import EffectEntry, LegModel
from testbed.scenario.scenario import load_scenario
from testbed.world.simulation import Simulation
from testbed.world.summary import world_summary

KNOWN = {"bore_m": 0.07, "rod_m": 0.056, "moving_mass_kg": 90.0, "stroke_m": 0.5}


def drift(**values: float) -> EffectEntry:
    unit = {"rate": "Pa/s", "decay": "1/s"}
    parameters = {k: {"value": v, "unit": unit[k], "interval90": [v, v]} for k, v in values.items()}
    return EffectEntry.model_validate({"name": "sensor.drift_a", "parameters": parameters})


def test_a_shape_that_the_live_chain_does_not_know_is_not_believed_by_halves() -> None:
    leg = Believed.from_machine(build_machine(), 1e-3).legs[0]
    assert leg.with_effect(drift(rate=2000.0)).drift_a_pa_s == 2000.0
    assert leg.with_effect(drift(rate=2000.0, decay=0.0)).drift_a_pa_s == 2000.0
    with pytest.raises(InputError, match=r"drift_a\.parameters\.decay = 0\.15: is a shape"):
        leg.with_effect(drift(rate=2000.0, decay=0.15))


def test_a_shape_that_the_world_does_not_have_is_refused_by_its_name() -> None:
    hidden = "{effect: sensor.drift_a, at: fl_vertical, parameters: {rate: 500, decay: %s}}"
    with pytest.raises(InputError, match=r"undeclared\.0\.parameters\.decay = 0\.1: is a shape"):
        Simulation(load_scenario("stand_slope_45", [f"undeclared=[{hidden % 0.1}]"]))
    Simulation(load_scenario("stand_slope_45", [f"undeclared=[{hidden % 0.0}]"])).close()


def test_a_models_detector_runs_at_the_estimators_rate() -> None:
    model = LegModel.model_validate(
        {"format": "roboclimber-model/1", "rig": "vertical-leg", "known": KNOWN}
    )
    for dt in (4e-3, 1e-3):
        assert EstimatorChain(Believed.from_model(model, dt, build_machine())).belief["dt"] == dt


def test_rates_at_which_the_observers_diverge_are_refused() -> None:
    with pytest.raises(InputError, match="estimator_hz"):
        load_scenario("stand_slope_45", ["rates.estimator_hz=50"])
    good = Believed.from_machine(build_machine(), 5e-3)
    with pytest.raises(InputError, match="at least 200 Hz"):
        replace(good, dt_s=0.02)


@pytest.mark.slow
def test_a_drill_that_may_push_less_drills_less_deep_and_orders_what_it_may() -> None:
    depths = []
    for reserve in ("null", "0.9"):
        changes = [
            "terrain.slope_deg=75",
            f"control.thrust_reserve={reserve}",
            "duration_s=7",
            "rates.record_hz=100",
        ]
        world = Simulation(load_scenario("drill_shallow", changes))
        data, _ = world.run_block(700)
        depths.append(world_summary(world)["hole_depth_m"])
        ordered, most = (
            data[:, world.data_columns.index("ordered_thrust")].max(),
            world.machine.thrust.most_n,
        )
        assert 0.0 < ordered <= most + 1e-6
        world.close()
    assert 0.0 < depths[1] < 0.5 * depths[0]
