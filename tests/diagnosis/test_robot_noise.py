"""What a sound robot's balances miss: seals that the body's last motion left, encoders that round,
joints that play.
"""

from __future__ import annotations

from pathlib import Path
from types import SimpleNamespace
from typing import Any, cast

import numpy as np
import pytest

from testbed.diagnosis.robot.evidence import RawGroup
from testbed.diagnosis.robot.force_noise import OF_A_SOUND_MACHINE, swung
from testbed.diagnosis.robot.friction import side_coefficient, side_growth
from testbed.diagnosis.robot.hypotheses import Hypothesis
from testbed.diagnosis.robot.motion_noise import (
    left_by_motions,
    slides_surely,
    swings,
    taken_by_stops,
)
from testbed.diagnosis.robot.noise_levels import OUTLYING, left_by, level_of, outlying
from testbed.diagnosis.robot.piston_positions import PLAY_S, lies_in_play, played, rounded, swept
from testbed.diagnosis.robot.tolerances import middle
from testbed.effects.force_cushion import BEYOND_M, Cushion
from testbed.effects.hydraulics_air import compliance_1_pa, free_share
from testbed.machine.build import build_machine
from testbed.machine.scale import ROBOCLIMBER, Scale
from testbed.recording.leg_model import Parameter
from testbed.recording.robot_model import RobotModelFile, write_robot_model
from testbed.world.believed_robot import believed_robot

STEP_S = 0.1
NOTHING = Hypothesis((), 0.0, np.zeros(0), np.zeros((0, 0)))


def test_what_the_encoder_takes_from_one_bin_it_gives_to_the_next() -> None:
    places = rounded(np.array([0.0, 1e-4, 0.0, 0.0]), STEP_S * np.arange(3.0))
    speed = (1e-4 / STEP_S) ** 2
    found = swept(np.array([1.0, -0.5]), places)
    assert found[:3, :3] == pytest.approx(speed * np.array([[1, -1, 0], [-1, 1, 0], [0, 0, 0]]))
    assert found[:3, 3:] == pytest.approx(-0.5 * found[:3, :3])


def test_play_is_passed_once_on_the_way_from_one_sense_to_the_other() -> None:
    sd, resting = 1e-3, np.zeros(5)
    turning = np.array([0.0, sd, sd, sd, 0.0])
    places = played(np.array([resting, turning, resting]), STEP_S * np.arange(4.0), PLAY_S)
    found = swept(np.ones(1), places)
    assert np.ones(4) @ found @ np.ones(4) == pytest.approx(0.0, abs=1e-12)
    into, inside = found[0, 0], found[1, 1]
    assert into == pytest.approx((sd / STEP_S) ** 2) and inside < 0.5 * into


def test_play_is_crossed_within_a_bin_where_a_slide_begins() -> None:
    sd, nothing = 1e-3, np.zeros(6)
    resting = np.array([sd, sd, sd, sd, 0.0, 0.0])
    begins = np.array([0.0, 0.0, 0.0, sd, 0.0, 0.0])
    time_s = STEP_S * np.arange(5.0)

    def crossed_m(beginning: np.ndarray) -> float:
        """Standard deviation of what the piston sweeps unseen in the last bin of a rest."""
        places = played(np.array([resting, nothing, beginning]), time_s, PLAY_S)
        return float(np.sqrt(swept(np.ones(1), places)[2, 2]) * STEP_S)

    assert crossed_m(nothing) < 0.3 * sd
    assert crossed_m(begins) == pytest.approx(sd, rel=0.05)


def test_a_joint_that_hunts_within_its_play_creeps_unseen_for_seconds() -> None:
    resting = np.full(41, 1e-3)
    places = played(
        np.array([resting, np.zeros(41), np.zeros(41)]), STEP_S * np.arange(40.0), PLAY_S
    )
    found = swept(np.ones(1), places)
    near, far = found[20, 21] / found[20, 20], found[20, 35] / found[20, 20]
    assert near > 0.5 and abs(far) < 0.2


def test_a_smaller_machine_crosses_its_play_sooner_and_sweeps_as_much_faster() -> None:
    play_m = np.abs(np.random.default_rng(1).normal(size=(3, 41))) * 1e-3
    large = played(play_m, STEP_S * np.arange(40.0), PLAY_S)
    small = played(play_m, 0.5 * STEP_S * np.arange(40.0), 0.5 * PLAY_S)
    assert small == pytest.approx(4.0 * large)


def test_a_slide_that_is_over_within_a_bin_was_partly_at_rest() -> None:
    way = np.array([0.0, 1.0, 0.0, 0.0, -1.0, -1.0, -1.0, -0.4, 0.0])[:, None]
    expected = [0.0, 0.0, 0.0, 0.0, 1.0, 1.0, 1.0, 0.4, 0.0]
    assert slides_surely(way)[:, 0] == pytest.approx(expected)


def test_seals_at_rest_are_left_as_the_body_moved_on_its_feet() -> None:
    feet = np.array([[[1.0, 0.5, -1.0], [1.0, -0.5, -1.0], [-1.0, 0.5, -1.0], [-1.0, -0.5, -1.0]]])
    straight = np.broadcast_to(np.eye(3), (1, 4, 3, 3))  # joints that move the foot along x, y, z
    seen = SimpleNamespace(foot_m=feet, foot_by_joint=straight, arm_m=np.ones((1, 12)), bins=1)
    left = left_by_motions(cast(Any, seen))[0].reshape(4, 3, 6)
    along_x, about_z = left[:, :, 0], left[:, :, 5]
    assert along_x == pytest.approx(np.outer(np.ones(4), [-1.0, 0.0, 0.0]))
    back = np.column_stack([feet[0, :, 1], -feet[0, :, 0], np.zeros(4)])
    assert np.sign(about_z) == pytest.approx(np.sign(back)) and np.abs(left).max() <= 1.0
    assert np.abs(about_z[:, 0]).max() < 1.0  # the nearer way is the shorter


def test_a_recording_says_itself_how_noisy_it_is_and_when() -> None:
    quiet, loud = 0.3, 2.0
    time = STEP_S * np.arange(400)
    rng = np.random.default_rng(0)
    missing = rng.normal(size=400) * np.where(time < 20.0, quiet, loud)
    flat = RawGroup(
        missing=missing,
        time_s=time,
        noise=2.0 * np.eye(400),
        lasting=np.eye(400),
        tolerated=np.zeros((400, 1)),
        rows_of=lambda change: change.force[0][0] * np.ones(400),
    )
    still = cast(Any, SimpleNamespace(raw={"oil x": flat}, groups={"oil x": flat.whitened({})}))
    still.candidates = {}
    level = level_of("oil x", flat, left_by(still, NOTHING)["oil x"])
    assert 0.5 * quiet**2 < level[:150].mean() < 0.7  # each window is held to the whole run
    assert level[-150:].mean() > 2.0 * level[:150].mean()
    noise = flat.levelled(level).noise
    assert np.diag(noise) == pytest.approx(1.0 + level) and noise[0, 1] == 0.0
    assert level_of("line x", flat, missing) == pytest.approx(1.0)


def test_an_instant_that_misses_far_more_than_its_neighbours_counts_for_less() -> None:
    """Rows of one bin have its variance in common, whatever order they are in."""
    time_s = STEP_S * np.repeat(np.arange(40.0), 6)
    left = np.random.default_rng(3).normal(size=len(time_s))
    left[time_s == time_s[60]] = 10.0
    found = outlying(time_s, left)
    assert found[60:66] == pytest.approx(100.0 / OUTLYING)
    assert np.mean(found[:60]) < 1.2
    order = np.argsort(left)
    assert outlying(time_s[order], left[order]) == pytest.approx(found[order])


def test_side_friction_grows_along_the_stroke_as_declared() -> None:
    axis = build_machine().axes["fl_radial"]
    assert side_growth(axis, np.array([0.25, 0.0, 0.5]), 0.5) == pytest.approx(
        1.0 + axis.seal.side_load_growth * np.array([0.0, -0.5, 0.5])
    )


def test_side_friction_is_what_was_told_of_a_seal_else_the_middle_of_its_tolerance(
    tmp_path: Path,
) -> None:
    """What a commissioning found of one seal is not taken for the workshop's usual one."""
    file, told = tmp_path / "model.yaml", Parameter(value=0.12, unit="1")
    path = "axes.fl_radial.seal.side_load_coefficient"
    write_robot_model(file, RobotModelFile(machine={path: told}))
    machine = believed_robot(build_machine(), file).machine
    found = {name: side_coefficient(axis, machine.seal) for name, axis in machine.axes.items()}
    usual = middle("axes.*.seal.side_load_coefficient", machine.seal.side_load_coefficient)
    assert found.pop("fl_radial") == told.value != usual
    assert set(found.values()) == {usual}


def test_what_shakes_stands_off_the_line_through_its_neighbours() -> None:
    ramp = np.linspace(0.0, 9.0, 10)[:, None]
    assert swings(ramp) == pytest.approx(0.0, abs=1e-12)
    ramp[5] += 2.0
    assert swings(ramp)[4:7, 0] == pytest.approx(2.0) and swings(ramp)[2, 0] == 0.0


def test_a_piston_inside_its_cushion_all_along_shows_it() -> None:
    extension = np.linspace(0.05, 0.15, 20)
    seen = cast(
        Any,
        SimpleNamespace(
            extension_m=extension[:, None],
            axis=lambda _: 0,
            bins=20,
            stroke_m=np.array([0.5]),
            travel_m=lambda _: (extension.min(), extension.max()),
        ),
    )
    stiffness, start = 5.0e4, 0.22
    columns = [c.force[0] for c in Cushion().signature(seen, "fl_vertical").values()]
    numbers = np.linalg.lstsq(
        np.column_stack(columns[2:]), -stiffness * (start - extension), rcond=None
    )[0]
    assert (numbers > 0.0).all() and start < extension.max() + BEYOND_M
    linear = dict(zip(Cushion().signature(seen, "fl_vertical"), [0.0, 0.0, *numbers], strict=True))
    found = Cushion().from_linear(linear, seen, "fl_vertical")
    assert found == pytest.approx({"stiffness": stiffness, "start": start})


def test_free_air_falls_with_pressure_as_the_compliance_says() -> None:
    low, high = 4.0e5, 4.001e5
    fall = (free_share(low) - free_share(high)) / (high - low)
    assert fall == pytest.approx(compliance_1_pa(0.5 * (low + high), 1.0), rel=1e-4)


def test_an_end_stop_may_take_all_that_the_oil_can_push_and_nothing_between_the_ends() -> None:
    stroke, area = np.full(12, 0.5), np.full(12, 4e-3)
    extension = np.tile([[1e-3], [0.25], [0.4999]], (1, 12))
    seen = SimpleNamespace(
        extension_m=extension, stroke_m=stroke, area_a_m2=area, supply_pa=np.full(3, 9e6)
    )
    found = taken_by_stops(cast(Any, seen))
    assert found[:, 0] == pytest.approx([3.6e4, 0.0, 3.6e4])


def test_a_machine_of_an_eighth_of_the_weight_is_as_quiet() -> None:
    half = OF_A_SOUND_MACHINE.of_size(Scale(0.125, 0.5))
    assert half.white_n == pytest.approx(OF_A_SOUND_MACHINE.white_n / 8.0)
    assert half.white_n_m == pytest.approx(OF_A_SOUND_MACHINE.white_n_m / 16.0)
    assert half.rest_share == OF_A_SOUND_MACHINE.rest_share
    assert OF_A_SOUND_MACHINE.of_size(ROBOCLIMBER) == OF_A_SOUND_MACHINE


def test_a_joint_lies_at_the_end_of_its_play_to_which_it_was_dragged_last() -> None:
    direction = np.concatenate([np.zeros(5), np.ones(10), np.zeros(5), -np.ones(10)])[:, None]
    lies, unsure = lies_in_play(direction)
    assert np.all(lies[:5] == 0.0) and np.all(lies[5:20] == 1.0) and np.all(lies[20:] == -1.0)
    assert np.all(unsure[15:20] == 1.0) and np.all(unsure[7:13] == 0.0)


def test_a_line_takes_turns_in_bins_of_half_its_period() -> None:
    seen = cast(
        Any,
        SimpleNamespace(
            time_s=STEP_S * np.arange(6.0), line_hz=np.array([5.0]), line_n=np.array([100.0])
        ),
    )
    apart = np.abs(np.subtract.outer(seen.time_s, seen.time_s))
    found = swung(seen, 0, np.ones(6), apart)
    assert found[0, 0] == pytest.approx(0.5 * (100.0 * 2.0 / np.pi) ** 2)
    assert found[0, 1] < -0.9 * found[0, 0] and found[0, 2] > 0.9 * found[0, 0]
