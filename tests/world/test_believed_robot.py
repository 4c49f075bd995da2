"""A model file of the whole robot is believed by the run: numbers by path, weight, zeros and
sensors as effects.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from testbed.errors import InputError
from testbed.machine.build import build_machine
from testbed.machine.names import AXES
from testbed.scenario.machines import WORKSHOP, tolerances
from testbed.scenario.scenario import load_scenario
from testbed.world.believed_robot import believed_robot
from testbed.world.simulation import Simulation

HEAD = "format: roboclimber-model/1\nrig: robot\n"
HEAVY = "{name: robot.payload, place: body, parameters: {mass: 90, x: 0.3, y: 0.0, z: 0.2}}"
ASKEW = "{name: robot.attitude, place: body, parameters: {roll: 0.004, pitch: -0.006}}"
PIN = "{name: rope.tension_gain, place: rope_left, parameters: {gain_error: 0.02, zero: 150}}"
ZERO = "{name: sensor.zero_a, place: fl_vertical, parameters: {zero: 4.0e4}}"
HIDDEN = (
    "undeclared=["
    "{effect: robot.payload, at: body, parameters: {mass: 90, x: 0.3, y: 0.0, z: 0.2}},"
    "{effect: robot.attitude, at: body, parameters: {roll: 0.004, pitch: -0.006}},"
    "{effect: rope.tension_gain, at: rope_left, parameters: {gain_error: 0.02, zero: 150}},"
    "{effect: sensor.zero_a, at: fl_vertical, parameters: {zero: 4.0e4}}]"
)


def model(tmp_path: Path, body: str) -> Path:
    path = tmp_path / "model.yaml"
    path.write_text(HEAD + body)
    return path


def error_n(believed: Path | None) -> float:
    world = Simulation(load_scenario("stand_slope_45", ["duration_s=3", HIDDEN]), believed)
    try:
        data, truth = world.run_block(3000)
        legs = ("fl", "fr", "rl", "rr")
        own = data[:, [world.data_columns.index(f"estimate_own_{leg}") for leg in legs]]
        true = truth[:, [world.truth_columns.index(f"foot_load_{leg}") for leg in legs]]
        return float(np.sqrt(np.mean((own - true)[1000:] ** 2)))
    finally:
        world.close()


def test_a_robot_that_believes_what_its_world_hides_errs_less(tmp_path: Path) -> None:
    whole = model(tmp_path, f"effects: [{HEAVY}, {ASKEW}, {PIN}, {ZERO}]\n")
    assert error_n(whole) < 0.6 * error_n(None)


def test_every_entry_changes_what_is_believed(tmp_path: Path) -> None:
    plain = _belief(None)
    path = "machine: {axes.fl_vertical.cylinder.coulomb_out_n: 700.0}\n"
    for body in (path, *(f"effects: [{one}]\n" for one in (HEAVY, ASKEW, PIN, ZERO))):
        assert _belief(model(tmp_path, body)).tobytes() != plain.tobytes()


def _belief(believed: Path | None) -> np.ndarray:
    world = Simulation(load_scenario("stand_slope_45"), believed)
    try:
        return np.array(world.machine.chain.belief)
    finally:
        world.close()


@pytest.mark.parametrize(
    ("body", "said"),
    [
        ("machine: {oil.nothing: 1.0}\n", "no such parameter"),
        ("effects: [{name: sensor.nothing, place: body, parameters: {}}]\n", "no effect has that"),
        (
            "effects: [{name: ground.friction, place: body, parameters: {coefficient: 0.1}}]\n",
            "cannot sit there",
        ),
        (
            "effects: [{name: sensor.zero_a, place: mine.py:Mine, parameters: {zero: 4.0e4}}]\n",
            "no such place",
        ),
        (
            "effects: [{name: robot.payload, place: body, parameters: {mass: 9000, x: 0, y: 0, z: 0}}]\n",
            "out of bounds",
        ),
    ],
)
def test_what_cannot_be_believed_is_refused(tmp_path: Path, body: str, said: str) -> None:
    with pytest.raises(InputError, match=said):
        Simulation(load_scenario("stand_slope_45"), model(tmp_path, body))


def test_what_was_found_beside_one_drawing_is_not_believed_of_another(tmp_path: Path) -> None:
    file = tmp_path / "model.yaml"
    file.write_text(HEAD + "drawing_mass_kg: 4000.0\n")
    shipped = build_machine()
    assert believed_robot(shipped, file).machine.total_mass_kg == shipped.total_mass_kg
    file.write_text(HEAD + "drawing_mass_kg: 8000.0\n")
    with pytest.raises(InputError, match=r"drawing_mass_kg = 8000.0: is of another machine"):
        believed_robot(shipped, file)


def test_what_is_declared_otherwise_than_drawn_is_believed_as_declared() -> None:
    """Where a tolerance's middle is not the drawing's number, that middle is expected of the
    drawing's number alone.
    """
    number = "axes.fl_vertical.seal.side_load_coefficient"
    drawn = build_machine()
    told = drawn.replaced({number: 0.15})
    assert believed_robot(drawn, None).expected.quantity(number).value == pytest.approx(0.2)
    assert believed_robot(told, None).expected.quantity(number).value == 0.15


def test_tolerances_know_the_number_that_they_are_about() -> None:
    drawn = build_machine()
    about = {name: one.about for one in tolerances(WORKSHOP) for name in one.names()}
    known = {name: value for name, value in about.items() if value is not None}
    assert len(known) == 2 * len(AXES)
    assert all(drawn.quantity(name).value == value for name, value in known.items())
