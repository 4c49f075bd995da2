"""Commands are values; set points move by them in one place; a measured row stays as it was."""

from __future__ import annotations

import copy
import dataclasses

import numpy as np
import pytest

from testbed.control.gait import (
    REST_1_S,
    Command,
    Layered,
    Measured,
    SetPoints,
    along_vertical,
    rows_of,
)
from testbed.recording.rows import DataRow

DT = 0.01


def test_a_command_cannot_be_changed_nor_by_the_arrays_that_it_was_made_of() -> None:
    joints = np.full(12, 0.2)
    command = Command(joints)
    joints[0] = 9.0
    assert command.joints[0] == 0.2
    with pytest.raises(ValueError, match="read-only"):
        command.joints[0] = 1.0
    with pytest.raises(ValueError, match="read-only"):
        command.stance[0] = False
    with pytest.raises(dataclasses.FrozenInstanceError):
        command.hold_drill = True  # type: ignore[misc]


def test_set_points_go_steadily_from_where_they_stand_to_where_the_command_wants_them() -> None:
    set_points = SetPoints(np.zeros(12))
    begin, rates = set_points.follow(Command(np.full(12, 0.003)), DT)
    assert not begin.any() and rates == pytest.approx(np.full(12, 0.3))
    begin, rates = set_points.follow(Command(np.full(12, 0.003)), DT)
    assert begin == pytest.approx(np.full(12, 0.003)) and not rates.any()


def test_what_is_slower_than_rest_does_not_creep() -> None:
    set_points = SetPoints(np.zeros(12))
    _, rates = set_points.follow(Command(np.full(12, 0.5 * REST_1_S * DT)), DT)
    assert not rates.any() and not set_points.joints.any()


def test_a_command_with_rates_begins_where_they_lead_to_its_set_points() -> None:
    set_points = SetPoints(np.zeros(12))
    begin, rates = set_points.follow(Command(np.full(12, 0.2), np.full(12, 0.5)), DT)
    assert begin == pytest.approx(np.full(12, 0.195)) and rates == pytest.approx(np.full(12, 0.5))
    assert set_points.joints == pytest.approx(np.full(12, 0.2))


def test_an_offset_moves_set_points_and_their_rates_alike() -> None:
    offset, rate = along_vertical([0.01, 0.0, 0.0, -0.01]), along_vertical([0.1, 0.0, 0.0, -0.1])
    plain = Command(np.zeros(12)).moved(offset, rate)
    assert plain.joint_rates is None and plain.joints[2] == 0.01 and plain.joints[11] == -0.01
    ruled = Command(np.zeros(12), np.zeros(12)).moved(offset, rate)
    assert ruled.joint_rates is not None and ruled.joint_rates[2] == 0.1


def test_layers_are_laid_from_the_inside_out() -> None:
    class Scaled:
        def __init__(self, factor: float, more: float) -> None:
            self.factor, self.more = factor, more

        def over(self, command: Command, t: float, dt: float, measured: Measured) -> Command:
            return dataclasses.replace(command, joints=command.joints * self.factor + self.more)

    class Ones:
        def command(self, t: float, dt: float, measured: Measured) -> Command:
            return Command(np.ones(12))

    layered = Layered(Ones(), (Scaled(1.0, 1.0), Scaled(3.0, 0.0)))
    assert layered.command(0.0, DT, Measured.of()).joints[0] == 6.0


def test_a_measured_row_is_read_by_the_recordings_names_and_stays_as_it_was() -> None:
    row = DataRow.zeros(1)
    row["rope_tension"] = 1000.0, 2000.0
    row["estimate"]["own"] = 1.0, 2.0, 3.0, 4.0
    seen = Measured(row)
    row["rope_tension"] = 0.0
    assert seen.rope_tension.tolist() == [1000.0, 2000.0] and seen.load.tolist() == [1, 2, 3, 4]
    other = seen.but(load=[5.0, 6.0, 7.0, 8.0], supply_pressure=9.0e6)
    assert other.load[0] == 5.0 and seen.load[0] == 1.0 and other.supply_pressure == 9.0e6
    assert copy.deepcopy(seen).load.tolist() == seen.load.tolist()
    with pytest.raises(AttributeError, match="a row of data has no foot_force"):
        _ = seen.foot_force


def test_recorded_columns_become_rows_and_what_was_not_recorded_is_zero() -> None:
    rows = rows_of({"t": np.array([0.1, 0.2]), "contact_rl": np.array([1.0, 0.0])})
    assert rows["t"].tolist() == [0.1, 0.2] and rows["contact"][:, 2].tolist() == [1.0, 0.0]
    assert not rows["position"].any()
