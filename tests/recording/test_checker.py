"""`testbed check` sees every planted fault, in the right channel, and nothing in a sound
recording.
"""

from __future__ import annotations

import json
import os
import shutil
from pathlib import Path

import numpy as np
import pytest
from planted import FAULTS, REFERENCE, load, planted

from testbed.cli import main
from testbed.errors import InputError
from testbed.machine.build import build_machine
from testbed.recording.checker.balance import _scaled_or_open, leaves_fewer_newtons
from testbed.recording.checker.check import check_recording
from testbed.recording.checker.finding import Finding
from testbed.recording.checker.forces import Forces
from testbed.recording.checker.motion import Even
from testbed.recording.checker.raw import Raw, read_raw, repetitions
from testbed.recording.checker.sensors import check_frozen
from testbed.recording.checker.spikes import check_spikes, spikes
from testbed.recording.known import Known
from testbed.scenario.scenario import load_scenario
from testbed.simulation.run_folder import recording_meta

SAMPLES = Path(__file__).parents[1] / "data" / "first_version"
LEG = SAMPLES / "leg" / "verify" / "press"
DRIVE = SAMPLES / "drive" / "identify" / "sine"
DATA = os.environ.get("TESTBED_DATA")
CASES = [
    (folder, name)
    for folder in (LEG, DRIVE)
    for name, fault in FAULTS.items()
    if fault.applies(load(folder))
]


@pytest.mark.parametrize("folder", [LEG, DRIVE, SAMPLES / "leg" / "identify" / "sine"], ids=str)
def test_a_sound_recording_has_no_error_and_no_warning(folder: Path) -> None:
    found = check_recording(folder)
    assert found.usable
    assert [f for f in found.findings if f.severity != "note"] == []


@pytest.mark.parametrize(
    ("folder", "name"), CASES, ids=[f"{f.parts[-3]}: {name}" for f, name in CASES]
)
def test_a_planted_fault_is_found_in_its_channel(folder: Path, name: str, tmp_path: Path) -> None:
    fault = FAULTS[name]
    found = check_recording(planted(load(folder), fault).write(tmp_path / "recording"))
    serious = [f for f in found.findings if f.severity != "note"]
    assert any(channel in f.channel for f in serious for channel in fault.channels), serious
    assert all(f.what and f.evidence and f.advice for f in serious)


def test_what_is_planted_covers_leg_and_drive() -> None:
    assert len(CASES) > 30 and {name for _, name in CASES} >= set(FAULTS) - {
        "valve turned round",
        "valve in per cent",
        "valve frozen",
        "supply in bar",
    }


def test_a_clock_jump_is_told_from_a_gap_by_the_motion(tmp_path: Path) -> None:
    sample = load(LEG)
    jump = check_recording(planted(sample, FAULTS["clock jumps"]).write(tmp_path / "jump"))
    gap = check_recording(planted(sample, FAULTS["gap"]).write(tmp_path / "gap"))
    assert "clock jumps" in jump.findings[0].what
    assert "samples are missing" in gap.findings[0].what


def test_the_stretch_of_a_frozen_sensor_is_where_it_was_planted(tmp_path: Path) -> None:
    sample = load(LEG)
    values, time = sample["pressure_a"].copy(), sample["time"]
    values[(time >= 2.0) & (time <= 3.0)] = values[time >= 2.0][0]
    sample["pressure_a"] = values
    (found,) = [
        f for f in check_recording(sample.write(tmp_path)).findings if f.severity == "error"
    ]
    assert found.from_s == pytest.approx(2.0, abs=0.02)
    assert found.to_s == pytest.approx(3.0, abs=0.02)


def test_repetitions_are_first_rows_and_lengths() -> None:
    first, length = repetitions(np.array([1.0, 1.0, 2.0, 3.0, 3.0, 3.0]))
    assert first.tolist() == [0, 2, 3] and length.tolist() == [2, 1, 3]


def foot(folder: Path, force: np.ndarray, contact: np.ndarray) -> Path:
    folder.mkdir()
    (folder / "recording.yaml").write_text(
        "format: roboclimber-recording/1\nrig: foot\ndata: data.csv\nsample_rate_hz: 100\n"
        "channels:\n  time: {column: t, unit: s}\n  force: {column: F, unit: N}\n"
        "  contact: {column: c, unit: '1'}\nknown: {nominal_load_n: 20.0}\n"
    )
    rows = zip(np.arange(len(force)) / 100.0, force, contact, strict=True)
    (folder / "data.csv").write_text("t,F,c\n" + "".join(f"{t},{f},{c:g}\n" for t, f, c in rows))
    return folder


@pytest.mark.parametrize(
    ("factor", "turned", "channel"),
    [(1.0, False, ""), (-1.0, False, "force"), (1e-3, False, "force"), (1.0, True, "contact")],
)
def test_a_foot_of_two_kilograms_is_checked_by_its_own_scale(
    factor: float, turned: bool, channel: str, tmp_path: Path
) -> None:
    carries = np.arange(600) % 200 > 60
    force = np.where(carries, 20.0, 0.0) + np.random.default_rng(0).normal(0.0, 0.3, 600)
    contact = (carries != turned).astype(float)
    found = check_recording(foot(tmp_path / "foot", factor * force, contact)).findings
    assert [f.channel for f in found if f.severity != "note"] == ([channel] if channel else [])


def test_a_foot_that_reads_a_load_in_the_air_is_told(tmp_path: Path) -> None:
    """A zero of three tenths of the load, either way; friction of a twentieth is none."""
    carries = np.arange(600) % 200 > 60
    noise = np.random.default_rng(0).normal(0.0, 0.3, 600)
    for zero, told in ((6.0, True), (-6.0, True), (1.0, False)):
        force = np.where(carries, 20.0, 0.0) + zero + noise
        checked = check_recording(foot(tmp_path / f"{zero:g}", force, carries.astype(float)))
        said = [f.what for f in checked.findings if f.severity == "warning"]
        assert checked.usable and said == ["reads a load in the air"] * told


def test_forces_that_detect_bridges_leave_a_foot_usable(tmp_path: Path) -> None:
    carries = np.arange(600) % 200 > 60
    force = np.where(carries, 20.0, 0.0) + np.random.default_rng(0).normal(0.0, 0.3, 600)
    force[100:103] = np.nan
    checked = check_recording(foot(tmp_path / "foot", force, carries.astype(float)))
    assert checked.usable
    assert [(f.severity, f.what) for f in checked.findings] == [("warning", "is not a number")]


@pytest.mark.parametrize("value", [np.nan, np.inf, 0.0, 1e300])
def test_a_column_of_one_value_that_is_none_is_reported_and_never_a_fault(
    tmp_path: Path, value: float
) -> None:
    for quantity in ("time", "position", "pressure_a", "pressure_b"):
        sample = load(SAMPLES / "leg" / "identify" / "sine")
        sample[quantity] = np.full(len(sample[quantity]), value)
        with np.errstate(over="ignore"):
            checked = check_recording(sample.write(tmp_path / f"{quantity}-{value:g}"))
        assert checked.findings, quantity


def robot(folder: Path) -> Path:
    shutil.copytree(SAMPLES / "robot", folder)
    return folder


def test_a_robot_is_checked_axis_by_axis(tmp_path: Path) -> None:
    sample = load(robot(tmp_path / "sound"))
    assert check_recording(tmp_path / "sound").usable
    a, b = (sample.columns[f"pressure_{c}_fr_vertical"].copy() for c in "ab")
    sample.columns["pressure_a_fr_vertical"], sample.columns["pressure_b_fr_vertical"] = b, a
    sample.columns["attitude_roll"] = sample.columns["attitude_roll"] + 40.0
    found = check_recording(sample.write(tmp_path / "wrong"))
    channels = " ".join(f.channel for f in found.findings if f.severity == "error")
    assert "pressure_a_fr_vertical" in channels and "attitude_roll" in channels
    assert "fl_vertical" not in channels


def test_a_supply_that_follows_the_load_is_measured_by_what_it_rises_to(tmp_path: Path) -> None:
    """A pump that idles at 20 bar and gives 95 for a tenth of the time, to a cylinder that takes
    90.
    """
    sample = load(robot(tmp_path / "sound"))
    works = np.arange(len(sample.columns["t"])) % 100 < 10
    noise = np.random.default_rng(0).normal(0.0, 3.0e3, works.size)
    sample.columns["supply_pressure"] = np.where(works, 9.5e6, 2.0e6) + noise
    sample.columns["pressure_b_fl_rotation"] = np.where(works, 9.0e6, 1.0e6) + noise
    found = check_recording(sample.write(tmp_path / "idling"))
    assert [f.what for f in found.findings if "scale than the supply" in f.what] == []
    sample.columns["supply_pressure"] /= 1e5
    found = check_recording(sample.write(tmp_path / "in_bar"))
    assert any("scale than the supply" in f.what for f in found.findings)


def test_a_supply_that_idles_while_a_valve_holds_the_load_is_no_other_scale(tmp_path: Path) -> None:
    """Half of what the strongest cylinder holds; in bar it is another unit all the same."""
    sample = load(robot(tmp_path / "sound"))
    held = max(np.quantile(v, 0.99) for n, v in sample.columns.items() if n.startswith("pressure_"))
    for divisor, said in ((1.0, False), (1e5, True)):
        sample.columns["supply_pressure"] = np.full(len(sample.columns["t"]), 0.5 * held / divisor)
        found = check_recording(sample.write(tmp_path / f"{divisor:g}")).findings
        assert any("scale than the supply" in f.what for f in found) == said


def test_a_robots_supply_in_bar_is_said_once_and_a_position_in_mm_of_its_axis(
    tmp_path: Path,
) -> None:
    sample = load(robot(tmp_path / "sound"))
    sample.columns["supply_pressure"] *= 1e-5
    sample.columns["position_rl_radial"] *= 1e3
    found = check_recording(sample.write(tmp_path / "wrong")).findings
    errors = {f.channel: f.what for f in found if f.severity == "error"}
    assert set(errors) == {"supply_pressure", "position_rl_radial"}
    assert errors["position_rl_radial"] == "is beyond the cylinder's end"


def test_a_robots_clock_is_told_by_the_axis_that_would_have_gone_farthest(tmp_path: Path) -> None:
    sample = load(robot(tmp_path / "sound"))
    rows = len(sample.columns["t"])
    row = np.arange(rows)
    sample.columns["position_fl_vertical"] = 0.2 + 0.2 * np.minimum(4.0 * row / rows, 1.0)
    sample.columns["position_rr_vertical"] = 0.2 + 0.1 * row / rows
    sample.columns["t"][rows // 2 :] += 0.5
    found = check_recording(sample.write(tmp_path / "jumps")).findings
    assert any("clock jumps" in f.what for f in found)


@pytest.mark.parametrize(
    ("factors", "named"),
    [
        ({"attitude_pitch": -1.0}, "attitude_pitch"),
        ({"specific_force_z": -1.0}, "specific_force_z"),
        ({f"specific_force_{axis}": -1.0 for axis in "xyz"}, "specific_force"),
        ({f"specific_force_{axis}": 1.0 / 9.81 for axis in "xyz"}, "specific_force"),
        ({"specific_force_y": None}, "specific_force_x"),
        ({}, None),
    ],
    ids=["pitch", "z", "all three", "in g0", "one is missing", "sound"],
)
def test_attitude_and_specific_force_have_to_agree_on_where_down_is(
    factors: dict[str, float | None], named: str | None, tmp_path: Path
) -> None:
    """Of a robot that leans back by 0.77 rad: its x feels 9.81 sin(0.77) m/s2, its z the rest."""
    sample = load(robot(tmp_path / "sound"))
    sample.columns["attitude_pitch"] -= 0.77
    upwards = sample.columns["specific_force_z"].copy()
    sample.columns["specific_force_x"] += upwards * np.sin(0.77)
    sample.columns["specific_force_z"] = upwards * np.cos(0.77)
    for name, factor in factors.items():
        if factor is None:
            del sample.columns[name], sample.head["channels"][name]
        else:
            sample.columns[name] *= factor
    found = check_recording(sample.write(tmp_path / "turned")).findings
    of_unit = [f for f in found if f.channel.startswith(("attitude", "specific_force"))]
    assert [f.channel for f in of_unit] == ([] if named is None else [named])


@pytest.mark.parametrize(("factor", "usable"), [(0.5, True), (2.0, True), (1e-3, False)])
def test_legs_may_load_each_other_across_their_diagonal_and_not_in_another_unit(
    factor: float, usable: bool, tmp_path: Path
) -> None:
    sample = load(robot(tmp_path / "sound"))
    for leg in ("fl", "rr"):
        sample.columns[f"expected_{leg}"] *= factor
    assert check_recording(sample.write(tmp_path / "shared")).usable == usable


def test_after_a_fall_no_sensor_is_blamed(tmp_path: Path) -> None:
    """Expected are the loads of a robot that lies on its side from the middle on."""
    sample = load(robot(tmp_path / "sound"))
    fallen = np.arange(len(sample.columns["t"])) >= len(sample.columns["t"]) // 2
    sample.columns["attitude_roll"] += 1.4 * fallen
    for name in ("specific_force_y", "specific_force_z"):
        sample.columns[name][fallen] = 9.81 * (np.sin(1.4) if name.endswith("y") else np.cos(1.4))
    for leg in ("fl", "fr", "rl", "rr"):
        sample.columns[f"expected_{leg}"][fallen] *= 20.0
    found = check_recording(sample.write(tmp_path / "fallen")).findings
    assert not any("vertical" in f.channel or "expected" in f.channel for f in found)


@pytest.mark.parametrize(("held_n", "usable"), [(400.0, True), (4000.0, False)])
def test_a_leg_at_rest_may_bear_what_its_seals_hold_and_no_more(
    held_n: float, usable: bool, tmp_path: Path
) -> None:
    """Of a leg that stands still, with a rod's chamber that bears as much as the seals may hold."""
    sample = load(robot(tmp_path / "sound"))
    for name in ("position_fl_vertical", "pressure_a_fl_vertical", "expected_fl"):
        sample.columns[name] = np.full_like(sample.columns[name], np.mean(sample.columns[name]))
    cylinder = build_machine().vertical_cylinder
    known = Known(bore_m=cylinder.bore_m, rod_m=cylinder.rod_m)
    assert known.area_a_m2 and known.area_b_m2
    push_n = known.area_a_m2 * sample.columns["pressure_a_fl_vertical"]
    sample.columns["expected_fl"] = push_n
    sample.columns["pressure_b_fl_vertical"] = np.full_like(push_n, held_n / known.area_b_m2)
    found = check_recording(sample.write(tmp_path / "standing"))
    errors = [f.channel for f in found.findings if f.severity == "error"]
    assert (not any("fl_vertical" in channel for channel in errors)) == usable


@pytest.mark.parametrize(
    ("lowest_pa", "range_pa", "clipped"),
    [(0.0, [0.0, 1.0e7], False), (0.0, None, True), (4.0e5, [0.0, 1.0e7], True)],
)
def test_an_empty_chamber_is_not_clipped_where_its_range_is_declared(
    lowest_pa: float, range_pa: list[float] | None, clipped: bool, tmp_path: Path
) -> None:
    sample = load(robot(tmp_path / "sound"))
    name = "pressure_b_fl_rotation"
    noise = np.random.default_rng(0).normal(lowest_pa, 3.0e3, len(sample.columns[name]))
    sample.columns[name] = np.maximum(
        noise + 1.0e5 * (np.arange(len(noise)) % 400 > 300), lowest_pa
    )
    if range_pa is not None:
        sample.head["channels"][name]["range_pa"] = range_pa
    found = check_recording(sample.write(tmp_path / "drained")).findings
    assert any(f.channel == name and "clipped" in f.what for f in found) == clipped


def test_a_runs_own_recording_declares_what_its_transducers_span() -> None:
    columns = ["t", "pressure_a_fl_vertical", "supply_pressure"]
    meta = recording_meta(load_scenario("stand_flat"), build_machine(), columns, {})
    span = build_machine().sensor.pressure_range_pa
    assert meta["channels"]["pressure_a_fl_vertical"]["range_pa"] == [0.0, span]
    assert "range_pa" not in meta["channels"]["supply_pressure"]


def test_a_counter_at_rest_flickers_by_a_count_and_a_spike_does_not() -> None:
    counts = np.full(8000, 6250)
    counts[[9, 700, 701, 1500, 2500, 4000, 5000, 6000]] += 1
    assert not spikes(1e-5 * counts).any()
    counts[2000] += 300
    assert np.flatnonzero(spikes(1e-5 * counts)).tolist() == [2000]


@pytest.mark.parametrize(("row", "found"), [(500, 0), (503, 0), (750, 1), (300, 1)])
def test_a_touchdown_within_a_row_is_no_spike_and_a_peak_of_a_foot_that_stands_is(
    row: int, found: int
) -> None:
    """A foot in the air until row 500: what strikes it is over within 50 ms. In the air nothing
    does.
    """
    time = np.arange(1000) / 100.0
    force = np.where(time < 5.0, 0.0, 2000.0) + np.random.default_rng(0).normal(0.0, 5.0, 1000)
    force[row] = 9000.0
    raw = Raw("foot", "foot", None, time, {"force": force}, {}, {})
    assert len(list(check_spikes(raw))) == found


def test_a_scale_that_makes_one_force_outweigh_all_others_mends_no_balance() -> None:
    """Of a leg whose strong seals move a foot in the air, which the reference hardly knows of."""
    time = np.arange(0.0, 20.0, 0.001)
    speed = 0.03 * np.sin(2.0 * np.pi * 0.2 * time)
    seals = 14.0 * np.sign(speed)
    known = Known(bore_m=0.016, rod_m=0.010, moving_mass_kg=0.0)
    assert known.area_a_m2
    shaken = np.random.default_rng(1).normal(0.0, 6.0, len(time))
    series = {
        "pressure_a": (seals + shaken) / known.area_a_m2,
        "pressure_b": np.zeros_like(time),
        "reference": -0.05 * np.sign(speed),
    }
    forces = Forces(Even(1000.0, speed, np.gradient(speed, 0.001), series), known)
    assert forces.misfit({"reference": 3000.0}) < 0.5 * forces.misfit({})
    assert not leaves_fewer_newtons(forces, {"reference": 3000.0})


def test_bodies_that_no_estimate_could_read_are_found(tmp_path: Path) -> None:
    sample = load(robot(tmp_path / "sound"))
    (tmp_path / "bodies.urdf").write_text("no XML")
    sample.head["surveyed"] = {**(sample.head.get("surveyed") or {})}
    sample.head["surveyed"]["urdf"] = str(tmp_path / "bodies.urdf")
    found = check_recording(sample.write(tmp_path / "other"))
    assert not found.usable and "is not XML" in found.findings[0].what


def test_a_header_that_cannot_be_read_is_a_finding_and_no_folder_is_an_error(
    tmp_path: Path,
) -> None:
    sample = load(LEG)
    sample.head["rig"] = "table"
    sample.write(tmp_path)
    found = check_recording(tmp_path)
    assert not found.usable and found.findings[0].channel == "rig"
    with pytest.raises(InputError, match="no such folder"):
        check_recording(tmp_path / "nothing")


@pytest.mark.parametrize(("fault", "status"), [(None, 0), ("gap", 0), ("clock set back", 2)])
def test_the_command_prints_json_and_exits_2_where_it_cannot_be_used(
    fault: str | None,
    status: int,
    tmp_path: Path,
    capsys: pytest.CaptureFixture[str],
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    folder = LEG
    if fault is not None:
        folder = planted(load(LEG), FAULTS[fault]).write(tmp_path / "r")
    monkeypatch.setattr("sys.argv", ["testbed", "check", str(folder), "--json"])
    with pytest.raises(SystemExit) as end:
        main()
    answer = json.loads(capsys.readouterr().out)
    assert end.value.code == status and answer["usable"] == (status == 0)
    for finding in answer["findings"]:
        assert set(finding) == {
            "severity",
            "channel",
            "what",
            "evidence",
            "advice",
            "from_s",
            "to_s",
        }


@pytest.mark.long
@pytest.mark.skipif(DATA is None, reason="TESTBED_DATA (recordings/ and real/) is not set")
def test_no_recording_of_the_shared_rigs_is_refused() -> None:
    folders = [
        p.parent
        for base in ("recordings", "real")
        for p in sorted((Path(str(DATA)) / base).glob("*/*/*/recording.yaml"))
    ]
    found = {folder: check_recording(folder) for folder in folders}
    assert len(found) > 100
    assert [str(folder) for folder, one in found.items() if not one.usable] == []
    warned = [
        f
        for folder, one in found.items()
        for f in one.findings
        if f.severity == "warning" and not _slow_line(folder, f)
    ]
    assert len(warned) <= 0.03 * len(found)


def _slow_line(folder: Path, found: Finding) -> bool:
    """Whether a finding is of the hidden effect of rig-08: a slow line to its sensor B."""
    return "rig-08" in folder.parts and found.channel == "pressure_b" and "late" in found.what


def test_a_load_cell_that_is_frozen_is_found_though_it_repeats_itself_now_and_then() -> None:
    rng, t = np.random.default_rng(0), np.arange(4000) / 1000.0
    force = 50.0 + 2.0 * np.round(1.5 * rng.standard_normal(t.size))
    pressure = 1e5 * (2.0 + np.sin(6.0 * t)) + rng.standard_normal(t.size)
    series = {"pressure_a": pressure, REFERENCE: force}
    header = read_raw(LEG).header
    sound = Raw("cell", "cylinder", header, t, series, {}, {})
    assert 0.1 < np.mean(np.diff(force) == 0.0) < 0.4
    assert list(check_frozen(sound)) == []
    rows = slice(1200, 2400)
    held = force.copy()
    held[rows] = held[rows.stop] = 50.0  # it wakes up where it fell asleep
    (found,) = check_frozen(Raw("cell", "cylinder", header, t, {**series, REFERENCE: held}, {}, {}))
    assert (found.channel, found.what) == (REFERENCE, "is frozen at one value")
    assert found.from_s == pytest.approx(t[rows.start], abs=5e-3)
    assert found.to_s == pytest.approx(t[rows.stop], abs=5e-3)


@pytest.mark.parametrize(("frozen", "told"), [(True, True), (False, False)])
def test_a_coarse_load_cell_that_rests_by_right_is_frozen_where_it_works(
    frozen: bool, told: bool
) -> None:
    """In the air it reads 0 for seconds; pressed by 3 to 6 kN it flickers by its count of 10 N."""
    rng, t = np.random.default_rng(0), np.arange(8000) / 1000.0
    pressed = (t > 4.0) * (4500.0 + 1500.0 * np.sin(2.0 * t))
    force = 10.0 * np.round((pressed + (t > 4.0) * rng.normal(0.0, 6.0, t.size)) / 10.0)
    if frozen:
        force[5200:6200] = force[5200]
    series = {"pressure_a": 300.0 * pressed + rng.standard_normal(t.size), REFERENCE: force}
    raw = Raw("cell", "cylinder", read_raw(LEG).header, t, series, {}, {})
    assert any("frozen" in f.what for f in check_frozen(raw)) == told


def test_a_channel_is_clipped_where_it_stays_at_its_end_though_it_comes_there_often(
    tmp_path: Path,
) -> None:
    """Held near its end for long, the counts below the end come as often as the end itself."""
    sample = load(LEG)
    rng, rows = np.random.default_rng(0), len(sample["time"])
    values = 1.0 + 1e-3 * np.round(
        rng.normal(0.0, 1.5, rows) + 100.0 * (np.arange(rows) % 500 > 99)
    )
    values[600:800] = values.max()
    sample["pressure_a"] = values
    sample.head["channels"]["pressure_a"].pop("range_pa", None)
    found = check_recording(sample.write(tmp_path)).findings
    assert any(f.channel == "pressure_a" and "clipped" in f.what for f in found)


def test_a_mass_in_tonnes_weighs_less_than_its_rod(tmp_path: Path) -> None:
    sample = load(LEG)
    sample.head["known"]["moving_mass_kg"] *= 1e-3
    found = check_recording(sample.write(tmp_path / "recording"))
    assert "known.moving_mass_kg" in [f.channel for f in found.findings if f.severity != "note"]


@pytest.mark.parametrize(("counts", "blamed"), [(1, False), (2, True)])
def test_a_fast_channel_skips_counts_and_has_its_declared_resolution_all_the_same(
    counts: int, blamed: bool, tmp_path: Path
) -> None:
    sample = load(DRIVE)
    fine, rng = 1e-5, np.random.default_rng(0)
    once = np.cumsum(rng.choice([2, 3, 5], size=sample["time"].size // 2))
    there_and_back = np.concatenate([once, once[::-1]])
    sample["position"] = counts * fine * np.resize(there_and_back, sample["time"].size)
    sample.head["channels"]["position"]["resolution"] = fine
    found = check_recording(sample.write(tmp_path / "recording")).findings
    assert any("resolution" in finding.what for finding in found) == blamed


def test_a_step_is_told_in_the_unit_in_which_it_is_declared(tmp_path: Path) -> None:
    sample = load(LEG)
    sample["position"] = np.round(1e3 * sample["position"], 1)
    sample.head["channels"]["position"] |= {"unit": "mm", "resolution": 1e-4}
    found = check_recording(sample.write(tmp_path / "recording")).findings
    (step,) = [one for one in found if "resolution" in one.what]
    assert step.evidence == "steps of 0.1 mm in the table, 0.0001 mm declared"
    assert step.advice == "put channels.position.resolution right: the smallest step, mm"


@pytest.mark.parametrize(
    ("channel", "declared"), [("actuator_force", "moving mass"), ("pressure_a", "bore")]
)
def test_another_scale_is_put_down_to_what_a_rig_declares(channel: str, declared: str) -> None:
    """A drive whose mass is another one balances with another scale of its force, too."""
    forces = Forces(Even(1000.0, np.zeros(2), np.zeros(2), {}), Known())
    (found,) = _scaled_or_open(forces, [(0.01, channel, 0.86)], 0.04)
    assert declared in found.advice
