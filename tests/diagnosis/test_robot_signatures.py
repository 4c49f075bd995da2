"""What an effect is said to do to the robot's balances is what it does: signatures against
differences.
"""

from __future__ import annotations

from dataclasses import replace
from functools import cache

import numpy as np
import numpy.typing as npt
import pytest

from testbed.diagnosis.robot import feet, forces
from testbed.diagnosis.robot.balance import EVERY, BodyBalance, OtherSigns, balance_of
from testbed.diagnosis.robot.bins import Bins, Frame, bins_of
from testbed.diagnosis.robot.hauling import Hauling
from testbed.diagnosis.robot.oil import oil_of
from testbed.diagnosis.robot.supply import supply_of
from testbed.effects import by_name
from testbed.effects.sensor_hysteresis import TURNED_PA, sense_of_reading
from testbed.effects.sensor_linearity import bowed
from testbed.machine.build import build_machine
from testbed.machine.names import AXES
from testbed.machine.scale import ROBOCLIMBER
from testbed.robot.model import Payload, RobotModel
from testbed.robot.robot import Robot

Array = npt.NDArray[np.float64]
ROPES = np.array([[0.9, 0.2, 0.39], [0.9, -0.2, 0.39]])
ROPES /= np.linalg.norm(ROPES, axis=1)[:, None]


@cache
def robot() -> Robot:
    """The shipped machine."""
    return Robot.of(build_machine())


@cache
def recorded() -> dict[str, Array]:
    """Three seconds of a robot on a slope whose joints and pressures move slowly; nothing in it has
    to balance.
    """
    t = np.arange(750) / 250.0
    rng = np.random.default_rng(4)
    data = {"t": t, "supply_pressure": 0 * t + 9e6, "oil_temperature": 0 * t + 30.0}
    for axis in AXES:
        middle = 0.0 if axis.endswith("rotation") else 0.2
        data[f"position_{axis}"] = middle + 0.02 * np.sin(2.0 * t + rng.uniform(0, 6))
        data[f"pressure_a_{axis}"] = 3e6 + 5e5 * np.sin(t + rng.uniform(0, 6))
        data[f"pressure_b_{axis}"] = 2e6 + 3e5 * np.sin(t + rng.uniform(0, 6))
        data[f"valve_{axis}"] = 0.1 * np.sin(3.0 * t)
    for side, tension in (("left", 9e3), ("right", 12e3)):
        data[f"rope_tension_{side}"] = tension + 500.0 * np.sin(t)
    for k, angle in enumerate(("roll", "pitch", "yaw")):
        data[f"attitude_{angle}"] = 0 * t + (0.02, -0.6, 0.01)[k]
    for k, lift in zip("xyz", (5.5, 0.2, 8.1), strict=True):
        data[f"specific_force_{k}"] = 0 * t + lift
        data[f"angular_rate_{k}"] = 0 * t
    data["ordered_thrust"] = 2000.0 * (t > 1.0)
    data["ordered_torque"] = 0 * t
    return data


def balanced(
    data: dict[str, Array] | None = None, ropes: Array = ROPES, body: Robot | None = None
) -> BodyBalance:
    """The balances of a recording."""
    columns, machine = data or recorded(), body or robot()
    bins = bins_of(columns, machine)
    return balance_of(bins, other(columns, bins, machine), machine, ropes)


def other(data: dict[str, Array], bins: Bins, body: Robot) -> OtherSigns:
    """Oil and supply of a recording, no lines."""
    frame = Frame.of(data["t"])
    oils = oil_of(data, bins, frame, body)
    return OtherSigns(
        oils,
        supply_of(oils, bins, frame, body.machine, Hauling.none(bins.count)),
        np.ones(12),
        np.zeros(12),
    )


@cache
def sound() -> BodyBalance:
    """The recording as it is."""
    return balanced()


def predicted(name: str, place: str, **numbers: float) -> Array:
    """What the signature says that the balances miss."""
    effect, body = by_name(name), sound()
    signature = effect.signature(body.seen, place)
    linear = effect.to_linear(numbers)
    columns = [linear[k] * forces.rows_of(body, change) for k, change in signature.items()]
    return np.asarray(np.sum(columns, axis=0))


def missed(body: BodyBalance) -> Array:
    """By how much more the changed recording misses."""
    return np.asarray((body.missing - sound().missing)[sound().counted])


def close(found: Array, told: Array, share: float) -> bool:
    """Equal to a share of the largest number, which is not nothing."""
    size = float(np.abs(told).max())
    return size > 1.0 and bool(np.allclose(found, told, rtol=1e-7, atol=share * size))


def test_a_pressure_gain_adds_its_share_of_the_piston_force() -> None:
    data = dict(recorded())
    data["pressure_a_fr_radial"] = 1.01 * data["pressure_a_fr_radial"]
    assert close(
        missed(balanced(data)), predicted("sensor.gain_a", "fr_radial", gain_error=0.01), 0.05
    )


def test_a_bow_of_both_sensors_adds_what_they_read_too_much_in_the_middle_of_their_range() -> None:
    data, bow_pa = dict(recorded()), 5e4
    range_pa = build_machine().axes["fr_radial"].sensor.pressure_range_pa
    for name in ("pressure_a_fr_radial", "pressure_b_fr_radial"):
        data[name] = data[name] + bow_pa * bowed(data[name], range_pa)
    assert close(
        missed(balanced(data)), predicted("sensor.linearity", "fr_radial", bow=bow_pa), 0.05
    )


def test_sensors_that_stick_read_too_little_on_the_way_up_and_too_much_on_the_way_down() -> None:
    rises = np.concatenate([np.linspace(1e6, 3e6, 20), np.linspace(3e6, 1e6, 20)])
    sense = sense_of_reading(rises, TURNED_PA)
    assert sense[0] == 0.0
    assert sense[1:20] == pytest.approx(1.0) and sense[21:] == pytest.approx(-1.0)
    noisy = 2e6 + 0.5 * TURNED_PA * np.sin(np.arange(50.0))
    assert np.abs(sense_of_reading(noisy, TURNED_PA)).max() < 1.0


def test_a_loop_of_both_sensors_adds_its_half_width_against_the_way_they_came() -> None:
    change = by_name("sensor.hysteresis").signature(sound().seen, "fr_radial")["width"]
    seen, i = sound().seen, AXES.index("fr_radial")
    up_a, up_b = (np.sign(rate[:, i]) for rate in (seen.pressure_a_rate, seen.pressure_b_rate))
    told = -(seen.area_a_m2[i] * up_a - seen.area_b_m2[i] * up_b)
    assert np.mean(np.isclose(change.force[i], told)) > 0.7  # but where one begins or turns


def test_a_drift_grows_with_time_from_the_start() -> None:
    data = dict(recorded())
    data["pressure_a_rl_vertical"] = data["pressure_a_rl_vertical"] + 1e4 * data["t"]
    assert close(missed(balanced(data)), predicted("sensor.drift_a", "rl_vertical", rate=1e4), 0.05)


def test_an_encoder_offset_moves_the_foot_and_what_its_force_does() -> None:
    data = dict(recorded())
    data["position_rr_radial"] = data["position_rr_radial"] + 0.002
    told = predicted("sensor.encoder_offset", "rr_radial", offset=0.002)
    bins = sound().seen.bins  # between every EVERY-th bin the change is a straight line
    found, told = (rows.reshape(bins, -1)[::EVERY] for rows in (missed(balanced(data)), told))
    assert close(found, told, 0.05)


def test_a_load_pin_pulls_along_its_rope() -> None:
    data = dict(recorded())
    data["rope_tension_left"] = 1.1 * data["rope_tension_left"] + 200.0
    told = predicted("rope.tension_gain", "rope_left", gain_error=0.1, zero=200.0)
    assert close(missed(balanced(data)), told, 1e-9)


def test_a_turned_unit_weighs_and_pulls_elsewhere() -> None:
    roll = 0.004
    data = dict(recorded())
    y, z = data["specific_force_y"], data["specific_force_z"]
    data["attitude_roll"] = data["attitude_roll"] + roll
    data["specific_force_y"] = np.cos(roll) * y + np.sin(roll) * z
    data["specific_force_z"] = np.cos(roll) * z - np.sin(roll) * y
    assert close(
        missed(balanced(data)), predicted("robot.attitude", "body", roll=roll, pitch=0.0), 0.03
    )


def test_a_payload_that_is_believed_takes_away_what_its_signature_adds() -> None:
    mass, point = 150.0, (0.4, -0.2, 0.3)
    machine = robot()
    loaded = replace(machine, model=RobotModel(machine.machine.urdf, Payload(mass, point)))
    found = -missed(balanced(body=loaded))
    x, y, z = point
    assert close(found, predicted("robot.payload", "body", mass=mass, x=x, y=y, z=z), 1e-6)


def test_an_anchor_to_the_left_turns_the_rope_to_the_left() -> None:
    """An anchor further to the left pulls more to the left than believed: the believed force misses
    it.
    """
    seen = sound().seen
    told = predicted("rope.direction", "rope_right", azimuth=0.01, elevation=0.0)
    rows = told.reshape(seen.bins, -1)[:, :3]
    to_the_left = np.einsum("nj,nj->n", rows, seen.slope_frame[:, 1])
    up = np.einsum("nj,nj->n", seen.rope_way[:, 1], seen.slope_frame[:, 0])
    np.testing.assert_allclose(to_the_left, -0.01 * up * seen.tension_n[:, 1], rtol=1e-9)


@pytest.mark.parametrize(
    ("name", "numbers"),
    [
        ("robot.payload", {"mass": 120.0, "x": 0.3, "y": -0.2, "z": 0.1}),
        ("force.spring", {"stiffness": 9000.0, "rest": 0.2}),
        ("drill.thrust", {"factor": 1.3}),
        ("supply.pump", {"flow_factor": 0.7, "pressure_factor": 0.9}),
    ],
)
def test_parameters_come_back_from_the_numbers_of_the_signature(
    name: str, numbers: dict[str, float]
) -> None:
    effect = by_name(name)
    back = effect.from_linear(effect.to_linear(numbers), sound().seen, effect.places[0])
    assert back == pytest.approx(numbers)


def test_a_foot_sinks_at_an_even_rate_to_a_depth() -> None:
    """What its two ways make together comes back as rate and depth."""
    effect = by_name("ground.settling")
    seen = sound().seen
    signature = effect.signature(seen, "foot_rl")
    for change in signature.values():
        assert change.feet is not None
        off_slope = np.einsum("nj,nj->n", change.feet[:, 2], seen.slope_frame[:, 2])
        assert np.all(np.diff(off_slope) <= 1e-12) and np.all(off_slope[1:] < 0.0)
        assert not change.feet[:, [0, 1, 3]].any()
    rates = dict.fromkeys(signature, 0.0) | {next(iter(signature)): 0.002}
    assert effect.from_linear(rates, seen, "foot_rl") == pytest.approx(
        {"rate": 0.002, "depth": 0.006}
    )


def test_a_foot_that_is_unloaded_without_being_lifted_stays_where_it_is() -> None:
    body = sound()
    bins = bins_of(recorded(), robot())
    loads = np.full_like(body.foot_force, 0.0)
    loads[:, :, 2] = 6000.0
    loads[8:14, 1, 2] = 100.0
    carrying = np.ones((bins.count, 4))
    still = feet.standing_of(
        replace(body, foot_force=loads), replace(bins, carrying=carrying), ROBOCLIMBER
    )
    assert set(still.phase[still.legs == 1]) == set(still.phase[still.legs == 0])
    carrying[9:13, 1] = 0.0
    lifted = feet.standing_of(
        replace(body, foot_force=loads), replace(bins, carrying=carrying), ROBOCLIMBER
    )
    assert len(set(lifted.phase[lifted.legs == 1])) == 2


def test_what_forces_miss_is_the_same_on_the_lines_of_another_machine() -> None:
    forces_n = {AXES.index("fl_radial"): np.full(sound().seen.bins, 40.0)}
    bins = bins_of(recorded(), robot())
    there = balance_of(bins, other(recorded(), bins, robot()), robot(), ROPES, forces_n)
    size = float(np.abs(sound().by_force[:, :, 1]).max()) * 40.0
    np.testing.assert_allclose(there.missing, sound().missing, atol=0.02 * size)
    assert np.abs(there.foot_force - sound().foot_force).max() > 20.0


def test_a_foot_slips_only_while_it_uses_all_the_friction_that_it_has() -> None:
    use = np.full((sound().seen.bins, 4), 0.05)
    use[:, 1] = np.where(np.arange(len(use)) < len(use) // 2, 0.6, 0.1)
    seen = replace(sound().seen, friction_use=use)
    for leg, place in enumerate(("foot_fl", "foot_fr")):
        ways = [
            np.linalg.norm(change.feet[:, leg], axis=1)
            for change in by_name("ground.friction").signature(seen, place).values()
            if change.feet is not None
        ]
        late = np.sum(np.abs(np.diff(ways, axis=1))[:, len(use) // 2 :])
        assert late == 0.0 if place == "foot_fr" else late > 0.5


def test_a_foot_whose_use_of_friction_is_known_badly_may_slip_whenever_it_bears_at_a_price() -> (
    None
):
    use = np.full((sound().seen.bins, 4), 0.05)
    use[:, 1] = np.where(np.arange(len(use)) < len(use) // 2, 0.6, 0.1)
    seen = replace(sound().seen, friction_use=use)
    at_most_used, at_any_use = by_name("ground.friction").courses(seen, "foot_fr")
    assert at_most_used.price == 0.0 < at_any_use.price
    assert set(at_most_used.signature) < set(at_any_use.signature)


def test_a_seal_that_turns_round_a_little_late_is_within_what_sound_machines_do() -> None:
    balance = sound()
    group = forces.group_of(balance, robot().machine)
    (late, *_) = by_name("friction.presliding").signature(balance.seen, "fl_vertical").values()
    column = group.rows_of(late)
    assert np.any(column)
    within = np.abs(forces.TURNS_BEHIND * column[:, None] - group.tolerated).max(axis=0)
    assert within.min() == pytest.approx(0.0, abs=1e-9 * np.abs(column).max())
