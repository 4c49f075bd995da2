"""What people measured before a run is in its recording: whoever reads it believes what the run
believed.
"""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pyarrow.parquet as pq
import pytest

from testbed.errors import InputError
from testbed.estimation.live.joined import replay_rows
from testbed.estimation.live.unknowns import CONSTANTS
from testbed.formats.yaml_files import read_mapping, write_yaml
from testbed.machine.build import build_machine
from testbed.machine.names import JOINTS, LEGS, SIDES
from testbed.recording.robot import read_robot, read_robot_header
from testbed.recording.robot_columns import OF_BODY, described
from testbed.scenario.scenario import load_scenario
from testbed.simulation.live_run import simulate
from testbed.simulation.runs import read_run
from testbed.workflows.estimate import estimate_file, lacks_of, robot_belief, survey_of, with_body
from testbed.world.believed_robot import believed_robot
from testbed.world.simulation import Simulation
from testbed.world.summary import surveyed

ROPES = {"left": [0.6, 0.0, 0.8], "right": [0.6, 0.0, 0.8]}
SURVEY = {"rope_directions_in_world": ROPES, "payload_kg": 100.0}
FILE = Path("recording.yaml")


@pytest.mark.parametrize("height_m", [None, 0.28])
def test_the_ropes_are_attached_where_the_survey_says_else_where_the_urdf_does(
    height_m: float | None,
) -> None:
    machine = build_machine()
    urdf_m = survey_of(SURVEY, FILE).robot(machine).model.rope_attachments_m[:, 2]
    survey = SURVEY | {"rope_attachment_height_m": height_m}
    expected = urdf_m if height_m is None else np.full(2, height_m)
    found = survey_of(survey, FILE).robot(machine).model.rope_attachments_m[:, 2]
    np.testing.assert_allclose(found, expected)
    believed = believed_robot(machine, None)
    whole = with_body(believed.legs(1e-3), believed, survey, FILE)
    assert whole.body is not None
    np.testing.assert_allclose(whole.body["rope_point"][0, :, 2], expected)


def test_a_height_that_is_none_is_refused() -> None:
    with pytest.raises(InputError, match="surveyed"):
        survey_of(SURVEY | {"rope_attachment_height_m": "high"}, FILE)


@pytest.mark.slow
def test_a_run_on_a_wall_tells_how_high_its_ropes_are_attached() -> None:
    world = Simulation(load_scenario("drill_slope_45", ["ropes.attachment_height_m=0.28"], 0))
    try:
        survey = survey_of(surveyed(world), FILE)
        there = world.machine.chain.belief["body"]["rope_point"][0]
    finally:
        world.close()
    assert survey.rope_height_m == 0.28
    np.testing.assert_allclose(there[:, 2], 0.28)


@pytest.mark.parametrize(
    ("change", "said"),
    [
        ({"payload_kg": -1.0}, "surveyed.payload_kg = -1.0"),
        ({"payload": 3.0}, "surveyed.payload: unknown key"),
        (
            {"rope_directions_in_world": ROPES | {"left": [0.6, 0.0, 1.8]}},
            "surveyed.rope_directions_in_world.left .*is no unit vector: its length is 1.9",
        ),
        ({"rope_directions_sd_rad": 0.0}, "surveyed.rope_directions_sd_rad = 0.0"),
        ({"tolerances": "none"}, "surveyed.tolerances = 'none'"),
    ],
)
def test_a_survey_that_makes_no_sense_is_refused_by_field(change: Any, said: str) -> None:
    with pytest.raises(InputError, match=said):
        survey_of(SURVEY | change, FILE)


def test_ropes_that_nobody_is_sure_of_are_believed_less() -> None:
    machine = build_machine()
    believed, found = believed_robot(machine, None), []
    for sd_rad in (None, 0.05):
        survey = SURVEY | {"rope_directions_sd_rad": sd_rad}
        whole = with_body(believed.legs(1e-3), believed, survey, FILE)
        assert whole.body is not None
        known = dict(zip(CONSTANTS, whole.body["known"][0], strict=True))
        ways = [f"{way}_{side}" for way in ("azimuth", "elevation") for side in SIDES]
        found.append([float(known[way]) for way in ways])
    assert max(found[0]) < 0.02 and found[1] == [0.05] * 4


@pytest.mark.parametrize(
    ("task", "drills", "told", "balanced"),
    [
        ("drill", True, True, True),
        ("drill", True, False, False),
        (None, True, False, False),
        (None, False, False, True),
        ("crawl", True, False, True),
    ],
)
def test_feet_are_balanced_where_the_drills_thrust_is_known_or_none(
    task: str | None, drills: bool, told: bool, balanced: bool, tmp_path: Path
) -> None:
    names = [*OF_BODY, *(("ordered_thrust",) if told else ())]
    channels = {name: {"column": name, "unit": described(name)[0]} for name in names}  # type: ignore[index]
    head = {
        "format": "roboclimber-recording/1",
        "rig": "robot",
        "data": "data.parquet",
        "sample_rate_hz": 1000,
        "task": task,
        "channels": channels,
        "known": {},
        "surveyed": SURVEY | {"drills": drills},
    }
    write_yaml(tmp_path / "recording.yaml", head)
    lacks = lacks_of(read_robot_header(tmp_path / "recording.yaml"))
    assert (lacks is None) == balanced
    assert balanced or "ordered_thrust" in str(lacks)


def test_that_nobody_drills_is_refused_beside_a_recorded_thrust(tmp_path: Path) -> None:
    channels = {n: {"column": n, "unit": described(n)[0]} for n in (*OF_BODY, "ordered_thrust")}  # type: ignore[index]
    head = {
        "format": "roboclimber-recording/1",
        "rig": "robot",
        "data": "data.parquet",
        "sample_rate_hz": 1000,
        "channels": channels,
        "known": {},
        "surveyed": SURVEY | {"drills": False},
    }
    write_yaml(tmp_path / "recording.yaml", head)
    with pytest.raises(InputError, match=r"surveyed\.drills = False: would have no effect"):
        read_robot_header(tmp_path / "recording.yaml")


def test_where_nobody_surveyed_the_place_a_diagnosis_says_so() -> None:
    with pytest.raises(InputError, match=r"recording.yaml: surveyed: is missing \(allowed: rope"):
        survey_of(None, FILE)


@pytest.mark.slow
@pytest.mark.parametrize("joints", [JOINTS, ("vertical",)])
def test_unsurveyed_feet_have_intervals_that_hold_the_truth_and_their_estimate(
    joints: tuple[str, ...], tmp_path: Path
) -> None:
    """On a drawn machine that lifts its body: without a balance friction hides several hundred N.
    Vertical cylinders alone know nothing of side loads, and are told to be wrong more often.
    """
    lifts = "task={kind: raise, start_s: 1, to_m: 0.33, speed_m_s: 0.02}"
    drawn = ("machine.draw=workshop", "machine.seed=9", lifts)
    with simulate(load_scenario("stand_slope_45", drawn, 9, 8.0), tmp_path / "run") as run:
        run.step(8000)
    unknown = tmp_path / "run" / "recording.yaml"
    head = {**read_mapping(unknown, "a recording"), "surveyed": None}
    others = [f"_{joint}" for joint in JOINTS if joint not in joints]
    head["channels"] = {
        name: channel
        for name, channel in head["channels"].items()
        if not name.endswith(tuple(others))
    }
    write_yaml(unknown, head)
    estimate_file(tmp_path / "run", None, tmp_path / "force.parquet")
    told = pq.read_table(tmp_path / "force.parquet").to_pydict()
    truth = read_run(tmp_path / "run").truth
    held = []
    for leg in LEGS:
        low, high, force = (np.array(told[f"force_{leg}_n{end}"]) for end in ("_low", "_high", ""))
        load = truth[f"foot_load_{leg}"]
        assert ((low <= force) & (force <= high)).all()
        held.append(np.mean((low <= load) & (load <= high)))
    assert np.mean(held) > (0.85 if joints == JOINTS else 0.6)


@pytest.mark.slow
def test_a_walking_robot_sampled_five_times_more_rarely_is_estimated_as_well(
    tmp_path: Path,
) -> None:
    """Filters that count samples instead of seconds lag behind loads where there are fewer: the
    error was 1.2 times as large.
    """
    drawn = ("machine.draw=workshop", "machine.seed=12011")
    with simulate(load_scenario("crawl_slope_45", drawn, 12011, 20.0), tmp_path / "run") as run:
        run.step(20_000)
        load = run.truth["foot_load"]
    recorded = read_robot(tmp_path / "run")
    errors = []
    for every in (1, 5):
        rare = replace(recorded, data={k: v[::every] for k, v in recorded.data.items()})
        rows = replay_rows(rare.data, robot_belief(rare, None))
        error = rows["estimate"]["own"] - load[::every]
        errors.append(np.sqrt(np.mean(error[rare.data["t"] > 1.0] ** 2)))
    assert errors[1] < 1.1 * errors[0]


@pytest.mark.slow
def test_a_drilling_robot_whose_acceleration_nobody_felt_has_wider_intervals(
    tmp_path: Path,
) -> None:
    drawn = ("machine.draw=workshop", "machine.seed=12010")
    with simulate(load_scenario("drill_slope_45", drawn, 12010, 12.0), tmp_path / "run") as run:
        run.step(12_000)
        load = run.truth["foot_load"]
    recorded, widths, held = read_robot(tmp_path / "run"), [], []
    for left_out in ("no column", "specific_force"):
        data = {k: v for k, v in recorded.data.items() if not k.startswith(left_out)}
        part = replace(recorded, data=data)
        rows = replay_rows(part.data, robot_belief(part, None))[1000:]
        low, high = rows["estimate_own"]["low"], rows["estimate_own"]["high"]
        widths.append(np.mean(high - low))
        held.append(np.mean((low <= load[1000:]) & (load[1000:] <= high)))
    assert widths[1] > 1.2 * widths[0]
    assert min(held) > 0.8
