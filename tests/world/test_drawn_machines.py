"""A drawn machine in its world: every tolerance changes what happens, and nothing that the robot
knows.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from perturbed import changes_recording

from testbed.formats.arrays import Array
from testbed.formats.yaml_files import read_mapping
from testbed.machine.names import LEGS, SIDES
from testbed.scenario import machines as drawn
from testbed.scenario.machines import Tolerance, tolerances
from testbed.scenario.scenario import Scenario, load_scenario
from testbed.simulation.run import run_scenario
from testbed.world.simulation import Simulation

CHANGES = (
    "duration_s=1.0",
    "task={kind: sway, start_s: 0.0, amplitude_m: [0.05, 0.05, 0.05], period_s: [2, 2, 2]}",
    "ropes.sag=false",
)
DRAWN = ["machine.draw=workshop", "machine.seed=3"]


@pytest.mark.parametrize(
    "tolerance",
    [
        pytest.param(one, id=one.number, marks=[pytest.mark.slow] * (index % 6 > 0))
        for index, one in enumerate(tolerances("workshop"))
    ],
)
def test_every_tolerance_by_itself_changes_what_is_measured(
    tolerance: Tolerance, monkeypatch: pytest.MonkeyPatch
) -> None:
    place = tolerance.number.rpartition(".")[0]
    group = tolerances("workshop") if "@" in place else (tolerance,)
    alone = [t.model_copy(update={"chance": 1.0}) for t in group if t.number.startswith(place)]
    monkeypatch.setattr(drawn, "tolerances", lambda _: alone)
    assert changes_recording(("stand_slope_45", CHANGES), *DRAWN, truth=False)


@pytest.mark.slow
def test_the_recording_says_the_same_of_a_drawn_machine_and_the_drawing(tmp_path: Path) -> None:
    short = ["duration_s=0.2"]
    for name, changes in (("drawn", DRAWN), ("plain", [])):
        run_scenario(load_scenario("stand_slope_45", [*short, *changes]), tmp_path / name)
    told = [read_mapping(tmp_path / name / "recording.yaml") for name in ("drawn", "plain")]
    surveyed = [header.pop("surveyed") for header in told]
    assert told[0] == told[1]
    assert [survey["tolerances"] for survey in surveyed] == ["workshop", "workshop"]
    for side in SIDES:  # surveyed from where the machine stands, which its hinges shift
        ropes = [survey["rope_directions_in_world"][side] for survey in surveyed]
        np.testing.assert_allclose(*ropes, atol=1e-3)
    assert not (tmp_path / "plain" / "truth_machine.yaml").exists()
    truth = read_mapping(tmp_path / "drawn" / "truth_machine.yaml")
    assert truth["seed"] == 3
    assert abs(truth["numbers"]["total_mass_kg"]["value"] - 4000.0) < 130.0
    shift_m = truth["numbers"]["robot.centre_of_mass@body.x"]["value"]
    assert 0.0 < abs(shift_m) < 0.055


def all_columns(scenario: Scenario) -> dict[str, Array]:
    """Data and truth of a whole run, by name."""
    simulation = Simulation(scenario)
    try:
        data, truth = simulation.run_block(int(scenario.duration_s / simulation.dt))
    finally:
        simulation.machine.engine.close()
    found = {name: truth[:, k] for k, name in enumerate(simulation.truth_columns)}
    return found | {name: data[:, k] for k, name in enumerate(simulation.data_columns)}


def friction_use(truth: dict[str, Array], leg: str, slope_deg: float, friction: float) -> Array:
    """Tangential over normal force of a foot on a plane, over its coefficient of friction."""
    slope = np.radians(slope_deg)
    across = [truth[f"foot_force_in_world_{leg}_{axis}"] for axis in "xyz"]
    normal = np.cos(slope) * across[2] - np.sin(slope) * across[0]
    up = np.cos(slope) * across[0] + np.sin(slope) * across[2]
    return np.asarray(np.hypot(up, across[1]) / normal / friction)


ENCODERS_OFF = [
    "undeclared=["
    "{effect: sensor.encoder_offset, at: rl_radial, parameters: {offset: 1.0e-3}},"
    "{effect: sensor.encoder_offset, at: fr_vertical, parameters: {offset: -1.0e-3}}]"
]


def test_control_begins_to_hold_a_machine_where_its_encoders_have_it() -> None:
    """Zeros of encoders that are a millimetre off (20 kN of oil) move no valve of a standing robot
    and leave the feet their loads.
    """
    rows = {}
    for name, changes in (("sound", []), ("off", ENCODERS_OFF)):
        rows[name] = all_columns(load_scenario("stand_slope_45", changes, duration=1.0))
    sound, off = rows["sound"], rows["off"]
    moved = off["reference_rl_radial"] - sound["reference_rl_radial"]
    np.testing.assert_allclose(moved, 1e-3)
    for name in ("valve_rl_radial", "valve_fr_vertical"):
        assert not off[name].any()
    for leg in LEGS:
        load = f"foot_load_{leg}"
        np.testing.assert_allclose(off[load], sound[load], atol=60.0)


@pytest.mark.slow
@pytest.mark.parametrize("seed", [1, 2, 3, 4])
def test_a_drawn_machine_that_stands_quietly_does_not_fight_itself(seed: int) -> None:
    changes = ["machine.draw=workshop", f"machine.seed={seed}"]
    scenario = load_scenario("stand_slope_45", changes, duration=30.0)
    truth = all_columns(scenario)
    assert truth["t"][-1] > 29.9
    slope, friction = scenario.terrain.slope_deg, scenario.terrain.friction
    use = np.array([friction_use(truth, leg, slope, friction) for leg in LEGS])
    assert use.max() < 0.4
    assert use[:, -1000:].max() < 0.3
