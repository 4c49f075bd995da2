"""What cannot be used is refused with one clear line that names the field, exit status 2, and
nothing written.
"""

from __future__ import annotations

import os
import sys
from collections.abc import Sequence
from pathlib import Path

import pytest
from command_line import completed

from testbed.cli import main

HEAD = "format: roboclimber-scenario/1\nduration_s: 0.2\n"

SCENARIOS: dict[str, tuple[str, str]] = {
    "yaml_error": ("terrain: {slope_deg: 45", "line 4"),
    "tab": ("terrain:\n\tslope_deg: 45", "not valid YAML"),
    "key_twice": ("seed: 1\nseed: 2", "'seed' is given twice"),
    "unknown_section": ("terain: {slope_deg: 45}", "terain: unknown key, did you mean 'terrain'?"),
    "unknown_key": (
        "terrain: {slop_deg: 45}",
        "terrain.slop_deg: unknown key, did you mean 'slope_deg'?",
    ),
    "section_is_a_number": ("terrain: 45", "terrain = 45"),
    "slope_too_steep": (
        "terrain: {slope_deg: 95}",
        "terrain.slope_deg = 95: is out of range (allowed: at most 85",
    ),
    "slope_negative": ("terrain: {slope_deg: -5}", "terrain.slope_deg = -5"),
    "number_is_a_word": ("terrain: {slope_deg: steep}", "terrain.slope_deg = 'steep'"),
    "number_is_true": ("terrain: {slope_deg: true}", "terrain.slope_deg = True"),
    "number_is_nan": ("terrain: {slope_deg: .nan}", "terrain.slope_deg = nan"),
    "number_is_infinite": ("ropes: {breaking_load_n: .inf}", "ropes.breaking_load_n = inf"),
    "no_such_ground": ("terrain: {kind: swamp}", "terrain.kind = 'swamp'"),
    "rough_plane": ("terrain: {roughness_m: 0.1}", "roughness_m"),
    "seed_with_a_point": ("seed: 1.5", "seed = 1.5"),
    "raise_to_below": ("task: {kind: raise, to_m: 0.1}", "task.to_m = 0.1: raises nothing"),
    "bound_beside_the_exact": (
        "expect: {summary: {tilt_max_deg: {equals: 3, min: 5}}}",
        "equals beside min or max",
    ),
    "bound_of_nothing": (
        "expect: {summary: {tilt_max_deg: {min: 5, max: 3}}}",
        "no number is so large and so small",
    ),
    "no_time": ("task: {kind: raise, every_s: 0}", "task.every_s = 0"),
    "no_such_task": (
        "task: {kind: dril}",
        "task.kind = 'dril': unknown kind, did you mean 'drill'?",
    ),
    "task_without_kind": ("task: {steps: 4}", "task.kind: is missing"),
    "phase_without_duration": (
        "task: {kind: drill, phases: [{kind: push}]}",
        "task.phases.0.duration_s: is missing",
    ),
    "feed_of_a_train": (
        "task: {kind: drill, phases: [{kind: push, duration_s: 1, feed_n: 1.0e6}]}",
        "task.phases.0.feed_n = 1000000.0",
    ),
    "leg_twice": ("task: {kind: crawl, order: [fl, fl, rl, rr]}", "task.order"),
    "three_legs": ("robot: {vertical_m: [0.2, 0.2, 0.2]}", "robot.vertical_m"),
    "beyond_the_stroke": (
        "robot: {vertical_m: 0.6}",
        "robot.vertical_m = 0.6: is outside the cylinder's stroke",
    ),
    "feet_under_the_ground": (
        "robot: {height_offset_m: -0.2}",
        "robot.height_offset_m = -0.2: puts the feet 0.2 m under",
    ),
    "rope_that_pushes": ("ropes: {tension_n: [100, -100]}", "ropes.tension_n"),
    "event_in_the_past": ("events: [{kind: cut_rope, at_s: -1, rope: left}]", "events.0.at_s = -1"),
    "stop_of_nothing": (
        "events: [{kind: stop, at_s: 1, duration_s: 1}]",
        "case.yaml: events: stop with nothing that walks",
    ),
    "no_such_rope": (
        "events: [{kind: cut_rope, at_s: 1, rope: middle}]",
        "events.0.rope = 'middle'",
    ),
    "no_such_hydraulic_part": (
        "hydraulics: {without: [frictoin]}",
        "hydraulics.without.0 = 'frictoin'",
    ),
    "no_such_parameter": (
        "hydraulics: {parameters: {body.mas_kg: 3}}",
        "hydraulics.parameters.body.mas_kg",
    ),
    "parameter_of_another_shape": (
        "model: {parameters: {total_mass_kg: [1, 2]}}",
        "model.parameters.total_mass_kg",
    ),
    "mass_of_the_world": (
        "hydraulics: {parameters: {body.mass_kg: 10}}",
        "hydraulics.parameters.body.mass_kg = 10.0: would have no effect: the URDF alone gives it",
    ),
    "mass_of_the_model": (
        "model: {parameters: {body.mass_kg: 10}}",
        "model.parameters.body.mass_kg = 10.0: would",
    ),
    "total_mass": (
        "hydraulics: {parameters: {total_mass_kg: 1}}",
        "hydraulics.parameters.total_mass_kg = 1.0: would",
    ),
    "mass_of_a_foot": (
        "hydraulics: {parameters: {legs.foot_mass_kg: 1}}",
        "hydraulics.parameters.legs.foot_mass_kg",
    ),
    "no_bore": (
        "model: {parameters: {vertical_cylinder.bore_m: 0}}",
        "case.yaml: model.parameters.vertical_cylinder.bore_m = 0.0: is out of range (allowed: more than 0)",
    ),
    "rod_wider_than_bore": (
        "model: {parameters: {vertical_cylinder.rod_m: 0.2}}",
        "model.parameters.vertical_cylinder.rod_m = 0.2: is impossible (allowed: 0 < rod < bore = 0.07 m)",
    ),
    "rod_wider_than_bore_in_truth": (
        "hydraulics: {parameters: {vertical_cylinder.rod_m: 0.2}}",
        "case.yaml: hydraulics.parameters.vertical_cylinder.rod_m = 0.2: is impossible",
    ),
    "valve_without_flow": (
        "model: {parameters: {valve.rated_flow_radial_m3_s: 0}}",
        "model.parameters.valve.rated_flow_radial_m3_s = 0.0: is out of range (allowed: more than 0",
    ),
    "tank_above_supply": (
        "hydraulics: {parameters: {power_unit.tank_pressure_pa: 1.0e8}}",
        "hydraulics.parameters.power_unit.supply_pressure_pa",
    ),
    "rate_that_does_not_divide": ("rates: {control_hz: 300}", "control_hz = 300 does not divide"),
    "undeclared_nowhere": (
        "undeclared: [{effect: sensor.gain_a, at: tail}]",
        "undeclared.0.at = 'tail'",
    ),
    "no_such_effect": (
        "undeclared: [{effect: sensor.gian_a, at: fl_vertical}]",
        "case.yaml: undeclared.0.effect = 'sensor.gian_a'",
    ),
    "no_such_effect_parameter": (
        "undeclared: [{effect: sensor.gain_a, at: fl_vertical, parameters: {gian: 0.1}}]",
        "case.yaml: undeclared.0.parameters.gian: unknown parameter",
    ),
    "effect_parameter_missing": (
        "undeclared: [{effect: inertia.mass, at: fl, parameters: {mass: 1}}, {effect: sensor.gain_a, at: fl}]",
        "case.yaml: undeclared.1.parameters: effect sensor.gain_a lacks parameter 'gain_error'",
    ),
    "expectation_without_bound": (
        "expect: {summary: {force_rms_n.kbf: {}}}",
        "expect.summary.force_rms_n.kbf",
    ),
    "no_such_verdict": ("expect: {verdict: flew}", "expect.verdict = 'flew'"),
    "no_such_urdf": ("robot: {urdf: absent.urdf}", "robot.urdf = 'absent.urdf': no such file"),
    "urdf_is_no_xml": ("robot: {urdf: broken.urdf}", "broken.urdf"),
    "urdf_without_links": ("robot: {urdf: empty.urdf}", "empty.urdf"),
    "name_with_a_slash": ("name: ../../etc", "name = '../../etc'"),
}

COMMANDS: dict[str, tuple[list[str], str]] = {
    "no_such_file": (["run", "absent.yaml"], "absent.yaml: no such scenario"),
    "no_such_name": (["run", "absent"], "one of"),
    "misspelt_name": (
        ["run", "stand_slop_45"],
        "stand_slop_45: no such scenario, did you mean 'stand_slope_45'?",
    ),
    "folder_as_scenario": (["run", "."], "no such scenario"),
    "not_text": (["run", "binary.yaml"], "binary.yaml"),
    "a_list": (["run", "list.yaml"], "list.yaml: [1, 2]: must be a mapping"),
    "other_format": (["run", "old.yaml"], "format = 'roboclimber-scenario/0'"),
    "no_format": (["run", "bare.yaml"], "format: is missing"),
    "set_without_value": (["run", "good.yaml", "--set", "terrain.slope_deg"], "terrain.slope_deg"),
    "set_unknown": (
        ["run", "good.yaml", "--set", "terrain.slop_deg=3"],
        "terrain.slop_deg: unknown key",
    ),
    "set_out_of_range": (
        ["run", "good.yaml", "--set", "terrain.slope_deg=95"],
        "terrain.slope_deg = 95",
    ),
    "set_beyond_a_list": (["run", "good.yaml", "--set", "events.3.at_s=1"], "events"),
    "seed_negative": (["run", "good.yaml", "--seed", "-1"], "seed = -1"),
    "seed_word": (["run", "good.yaml", "--seed", "lucky"], "--seed"),
    "duration_zero": (["run", "good.yaml", "--duration", "0"], "duration_s = 0"),
    "duration_nan": (["run", "good.yaml", "--duration", "nan"], "duration_s = nan"),
    "out_is_a_file": (["run", "good.yaml", "--out", "bare.yaml"], "--out"),
    "out_below_a_file": (["run", "good.yaml", "--out", "bare.yaml/run"], "--out"),
    "out_is_foreign": (["run", "good.yaml", "--out", "thesis"], "chapter.tex"),
    "out_cannot_be_made": (["run", "good.yaml", "--out", "/proc/run"], "/proc/run"),
    "no_such_model": (["run", "good.yaml", "--model", "absent-model.yaml"], "absent-model.yaml"),
    "model_is_no_model": (["run", "good.yaml", "--model", "bare.yaml"], "bare.yaml"),
    "no_such_option": (["run", "good.yaml", "--sped", "2"], "--sped"),
    "no_such_command": (["fly"], "fly"),
    "nothing_to_run": (["run"], "scenario"),
    "estimate_nothing": (
        ["estimate", "absent", "--out", "f.csv", "--model", "bare.yaml"],
        "absent: no such folder",
    ),
    "estimate_nothing_at_all": (
        ["estimate", "absent", "--out", "f.csv"],
        "absent: no such folder",
    ),
    "estimate_empty_folder": (
        ["estimate", "thesis", "--out", "f.csv"],
        "thesis/recording.yaml: no such file",
    ),
    "estimate_to_nowhere": (["estimate", "thesis", "--out", "absent/f.csv"], "--out"),
    "estimate_to_a_picture": (["estimate", "thesis", "--out", "f.png"], "allowed: .parquet, .csv"),
    "estimate_to_no_name": (["estimate", "thesis", "--out", ""], "--out: names no file"),
    "estimate_to_a_pipe": (
        ["estimate", "thesis", "--out", "pipe.csv"],
        "pipe.csv: --out: is no regular file",
    ),
    "identify_to_no_name": (["identify", "thesis", "--out", ""], "--out: names no file"),
    "identify_to_a_folder": (
        ["identify", "thesis", "--out", "thesis"],
        "thesis: --out: is no regular file",
    ),
    "identify_to_nowhere": (
        ["identify", "thesis", "--out", "absent/m.yaml"],
        "--out: its folder does not exist",
    ),
    "suggest_to_a_text": (
        ["diagnose", "thesis", "--out", "d", "--suggest", "s.txt"],
        "--suggest: unknown ending",
    ),
    "suggest_to_nowhere": (
        ["diagnose", "thesis", "--out", "d", "--suggest", "no/s.csv"],
        "no/s.csv: --suggest: its",
    ),
    "span_without_samples": (
        ["sweep", "good.yaml", "--vary", "robot.payload_kg=0:400", "--out", "s"],
        "--vary = 'robot.payload_kg=0:400': cannot be used (allowed: path=value,value or path=low:high:samples",
    ),
    "no_such_plain_effect": (
        ["lab", "plain-effects", "--effect", "friction.laod", "--out", "p"],
        "--effect = 'friction.laod': no such kind of effect, did you mean 'friction.load'?",
    ),
    "no_such_family_of_laws": (
        ["lab", "other-laws", "--family", "bristels", "--out", "o"],
        "--family = 'bristels': no such family of laws, did you mean 'bristles'?",
    ),
    "check_of_a_folder_with_a_foreign_link": (
        ["check", "linked"],
        "linked/recording.yaml: no such file",
    ),
    "identify_of_a_folder_with_a_foreign_link": (
        ["identify", "linked", "--out", "m.yaml"],
        "linked: has no folder 'identify'",
    ),
    "loop_to_a_file": (["loop", "--out", "bare.yaml"], "bare.yaml: --out: cannot be written"),
    "hydraulics_to_a_file": (
        ["hydraulics", "--out", "bare.yaml"],
        "bare.yaml: --out: cannot be written",
    ),
    "filters_to_a_file": (["filters", "--out", "bare.yaml"], "bare.yaml: --out: cannot be written"),
    "estimators_to_a_file": (["estimators", "--out", "bare.yaml"], "--out: cannot be written"),
    "paper_to_a_file": (["paper", "--out", "bare.yaml"], "bare.yaml: --out: cannot be written"),
    "controller_that_breaks_when_imported": (
        ["distribution", "--controller", "breaks.py:Mine", "--out", "out"],
        "breaks.py: line 1 of your own file raised ZeroDivisionError: division by zero",
    ),
    "controller_without_a_plan": (
        ["distribution", "--controller", "planless.py:Mine", "--out", "out"],
        "planless.py: controller = 'Mine': has no method plan (allowed: a class with plan(self, now))",
    ),
    "distribution_to_a_file": (
        ["distribution", "--out", "bare.yaml"],
        "bare.yaml: --out: cannot be written",
    ),
    "contact_loss_to_a_file": (["contact-loss", "--out", "bare.yaml"], "--out: cannot be written"),
    "trials_to_a_file": (["evaluate-diagnosis", "--out", "bare.yaml"], "--out: cannot be written"),
    "saved_before_the_start": (
        ["save", "good.yaml", "--at", "-1", "--out", "s.npz"],
        "--at = -1.0: is out of range (allowed: 0 to 0.2 s",
    ),
    "saved_after_the_end": (["save", "good.yaml", "--at", "1e9", "--out", "s.npz"], "--at = 10000"),
    "saved_at_no_time": (["save", "good.yaml", "--at", "nan", "--out", "s.npz"], "--at = nan"),
    "no_run_to_view": (["view", "thesis"], "thesis: holds no run"),
}


KNOWN = "{bore_m: 0.07, rod_m: 0.04, stroke_m: 0.5, moving_mass_kg: 91.7, inclination_deg: 0}"
MODEL = f"format: roboclimber-model/1\nknown: {KNOWN}\n"
RECORDING = (
    "format: roboclimber-recording/1\nrig: vertical-leg\ndata: data.csv\nsample_rate_hz: 1000\nchannels:\n"
    "  time: {column: t, unit: s}\n  position: {column: x, unit: m}\n"
    f"  pressure_a: {{column: pA, unit: Pa}}\n  pressure_b: {{column: pB, unit: Pa}}\nknown: {KNOWN}\n"
)
ROWS = [[k / 1000.0, 0.2 + 1e-5 * k, 3e6 + k, 1e6 - k] for k in range(200)]

RECORDINGS: dict[str, tuple[dict[str, str], dict[int, object], str]] = {
    "number_is_nan": ({}, {2: float("nan")}, "pA"),
    "number_is_a_word": ({}, {1: "far"}, "data.csv"),
    "time_goes_back": ({}, {0: 0.01}, "data.csv"),
    "no_such_column": ({"column: pB": "column: pZ"}, {}, "pZ"),
    "no_such_unit": ({"unit: m}": "unit: furlong}"}, {}, "channels.position.unit"),
    "no_such_rig": ({"vertical-leg": "horizontal-leg"}, {}, "rig"),
    "no_such_key": ({"rig: vert": "license: MIT\nrig: vert"}, {}, "license"),
    "rod_wider_than_bore": ({"rod_m: 0.04": "rod_m: 0.4"}, {}, "rod_m"),
    "table_is_missing": ({"data: data.csv": "data: other.csv"}, {}, "other.csv"),
}


EFFECTS: dict[str, tuple[str, str]] = {
    "unknown": ("{name: foo, parameters: {}}", "effects.1.name = 'foo': no effect has that name"),
    "lacking": (
        "{name: sensor.gain_a, parameters: {}}",
        "effects.1.parameters: effect sensor.gain_a lacks parameter",
    ),
    "misspelt": (
        "{name: sensor.gain_a, parameters: {gian: 0.1}}",
        "effects.1.parameters.gian: unknown parameter",
    ),
    "wild": (
        "{name: sensor.gain_a, parameters: {gain_error: 9.0}}",
        "effects.1.parameters.gain_error = 9.0: out of bounds",
    ),
    "in another unit": (
        "{name: sensor.drift_a, parameters: {rate: {value: 0.02, unit: bar/s}}}",
        "effects.1.parameters.rate.unit = 'bar/s': wrong unit (allowed: Pa/s)",
    ),
}


@pytest.mark.parametrize("command", ["run", "estimate"])
@pytest.mark.parametrize("case", EFFECTS)
def test_an_effect_of_a_model_that_cannot_be_is_named_with_file_and_entry(
    case: str,
    command: str,
    desk: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    entry, word = EFFECTS[case]
    sound = "{name: inertia.mass, parameters: {mass: 1.0}}"
    (desk / "model.yaml").write_text(f"{MODEL}effects: [{sound}, {entry}]\n")
    write_press(desk, RECORDING, ROWS)
    arguments = {
        "run": ["run", "good.yaml", "--model", "model.yaml", "--out", "run"],
        "estimate": ["estimate", "press", "--model", "model.yaml", "--out", "f.csv"],
    }
    assert_refused(arguments[command], f"testbed: model.yaml: {word}", monkeypatch, capsys, desk)


@pytest.mark.parametrize(
    ("known", "entry", "said"),
    [
        (
            KNOWN.replace("stroke_m: 0.5, ", ""),
            "{name: friction.position, parameters: {slope: 0.5}}",
            "model.yaml: known.stroke_m: is missing: friction.position needs it",
        ),
        (
            KNOWN,
            "{name: friction.temperature, parameters: {rate: 0.02}}",
            "channels.oil_temperature: is not recorded: friction.temperature of the model needs it",
        ),
    ],
    ids=["stroke", "temperature"],
)
def test_an_effect_that_lacks_what_its_law_is_made_of_is_not_left_out(
    known: str,
    entry: str,
    said: str,
    desk: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    (desk / "model.yaml").write_text(MODEL.replace(KNOWN, known) + f"effects: [{entry}]\n")
    write_press(desk, RECORDING, ROWS)
    command = ["estimate", "press", "--model", "model.yaml", "--out", "f.csv"]
    assert_refused(command, said, monkeypatch, capsys, desk)


def write_press(desk: Path, header: str, rows: Sequence[Sequence[object]]) -> None:
    folder = desk / "press"
    folder.mkdir()
    (folder / "recording.yaml").write_text(header)
    (folder / "data.csv").write_text(
        "t,x,pA,pB\n" + "\n".join(",".join(map(str, row)) for row in rows) + "\n"
    )


def test_an_estimate_of_a_leg_needs_a_model(
    desk: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    write_press(desk, RECORDING, ROWS)
    assert_refused(
        ["estimate", "press", "--out", "f.csv"], "--model: is missing", monkeypatch, capsys, desk
    )


@pytest.mark.parametrize("case", RECORDINGS)
def test_a_recording_that_cannot_be_used(
    case: str, desk: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    changes, cells, word = RECORDINGS[case]
    text = RECORDING
    for old, new in changes.items():
        text = text.replace(old, new)
    rows = [list(row) for row in ROWS]
    for column, value in cells.items():
        rows[120][column] = value  # type: ignore[call-overload]
    write_press(desk, text, rows)
    (desk / "model.yaml").write_text(MODEL)
    assert_refused(
        ["estimate", "press", "--model", "model.yaml", "--out", "f.csv"],
        word,
        monkeypatch,
        capsys,
        desk,
    )


def test_the_same_recording_without_its_fault_is_read(
    desk: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    write_press(desk, RECORDING, ROWS)
    (desk / "model.yaml").write_text(MODEL)
    monkeypatch.setattr(
        sys, "argv", ["testbed", "estimate", "press", "--model", "model.yaml", "--out", "f.csv"]
    )
    with pytest.raises(SystemExit) as end:
        main()
    assert end.value.code == 0
    assert len((desk / "f.csv").read_text().splitlines()) == 201


@pytest.mark.parametrize(
    "table", ["press/data.csv", "link/data.csv", "press/../press/data.csv", "press/truth.parquet"]
)
def test_an_estimate_does_not_take_the_place_of_its_recording(
    table: str, desk: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    (desk / "press").mkdir()
    (desk / "link").symlink_to(desk / "press")
    (desk / "press/recording.yaml").write_text(RECORDING)
    (desk / "press/data.csv").write_text(
        "t,x,pA,pB\n" + "\n".join(",".join(map(str, row)) for row in ROWS) + "\n"
    )
    (desk / "model.yaml").write_text(MODEL)
    assert_refused(
        ["estimate", "press", "--model", "model.yaml", "--out", table],
        f"{table}: --out: is the recording itself",
        monkeypatch,
        capsys,
        desk,
    )
    assert (desk / "press/data.csv").read_text().startswith("t,x,pA,pB")


@pytest.mark.parametrize("name", ["recording.yaml", "data.csv"])
def test_a_model_does_not_take_the_place_of_a_recording_that_it_was_found_from(
    name: str, desk: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    (desk / "rig/identify/press").mkdir(parents=True)
    (desk / "rig/identify/press/recording.yaml").write_text(RECORDING)
    assert_refused(
        ["identify", "rig", "--out", f"rig/identify/press/{name}"],
        f"rig/identify/press/{name}: --out: is the recording itself",
        monkeypatch,
        capsys,
        desk,
    )


@pytest.fixture
def desk(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A folder with files of all sorts; the working directory."""
    (tmp_path / "good.yaml").write_text(HEAD)
    (tmp_path / "bare.yaml").write_text("duration_s: 3\n")
    (tmp_path / "old.yaml").write_text("format: roboclimber-scenario/0\n")
    (tmp_path / "list.yaml").write_text("- 1\n- 2\n")
    (tmp_path / "binary.yaml").write_bytes(bytes(range(256)))
    (tmp_path / "broken.urdf").write_text("<robot><link")
    (tmp_path / "empty.urdf").write_text("<robot name='x'></robot>")
    (tmp_path / "breaks.py").write_text("1 / 0\n")
    (tmp_path / "planless.py").write_text("class Mine:\n    pass\n")
    os.mkfifo(tmp_path / "pipe.csv")
    (tmp_path / "thesis").mkdir()
    (tmp_path / "thesis/chapter.tex").write_text("precious")
    (tmp_path / "linked").mkdir()
    (tmp_path / "linked/elsewhere").symlink_to("/etc/hostname")
    monkeypatch.chdir(tmp_path)
    return tmp_path


def assert_refused(
    arguments: list[str],
    word: str,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
    desk: Path,
) -> None:
    before = {p: p.lstat().st_mtime_ns for p in desk.rglob("*")}
    monkeypatch.setattr(sys, "argv", ["testbed", *arguments])
    with pytest.raises(SystemExit) as end:
        main()
    out, told = capsys.readouterr()
    err = "".join(line for line in told.splitlines(True) if "first start compiles" not in line)
    assert end.value.code == 2, err
    assert out == ""
    assert err.count("\n") == 1 and err.endswith("\n")
    assert word in err
    assert {p: p.lstat().st_mtime_ns for p in desk.rglob("*")} == before


READERS: tuple[tuple[str, ...], ...] = (
    ("run", "{}", "--out", "new"),
    ("run", "good.yaml", "--model", "{}", "--out", "new"),
    ("save", "{}", "--at", "0.1", "--out", "new.npz"),
    ("resume", "{}", "--out", "new"),
    ("sweep", "{}", "--out", "new"),
    ("view", "{}"),
    ("export", "{}", "--out", "new.csv"),
    ("import", "{}", "--map", "map.yaml", "--out", "new"),
    ("import", "table.csv", "--map", "{}", "--out", "new"),
    ("estimate", "{}", "--out", "new.csv"),
    ("detect", "{}", "--out", "new.csv"),
    ("machine", "{}"),
    ("calibrate", "{}"),
    ("identify", "{}", "--out", "new.yaml"),
    ("identify-measured", "{}"),
    ("commission", "{}", "--out", "new.yaml"),
    ("diagnose", "{}", "--out", "new"),
    ("play", "{}", "good.yaml"),
    ("loop", "--scenario", "{}", "--out", "new"),
)


@pytest.mark.parametrize("place", ["absent", "folder", "empty.yaml"])
@pytest.mark.parametrize("command", READERS, ids=" ".join)
def test_what_is_not_there_or_holds_nothing_is_refused_with_what_is_allowed(
    command: tuple[str, ...],
    place: str,
    desk: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    (desk / "folder").mkdir()
    (desk / "empty.yaml").touch()
    (desk / "map.yaml").write_text("time: {column: t, unit: s}\nrig: cylinder\n")
    (desk / "table.csv").write_text("t\n0.0\n")
    given = [word.format(place) for word in command]
    assert_refused(given, "(allowed: ", monkeypatch, capsys, desk)


@pytest.mark.parametrize("place", ["x" * 300, "circle", "circle/below"])
@pytest.mark.parametrize("command", READERS, ids=" ".join)
def test_a_place_that_cannot_be_is_bad_input(
    command: tuple[str, ...],
    place: str,
    desk: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    """A name that is longer than the disk's, links that lead in a circle: to read, and to write."""
    (desk / "circle").symlink_to("circle")
    (desk / "map.yaml").write_text("time: {column: t, unit: s}\nrig: cylinder\n")
    (desk / "table.csv").write_text("t\n0.0\n")
    given = [word.format(place) for word in command]
    assert_refused(given, "testbed: ", monkeypatch, capsys, desk)
    if "--out" in given and place != "circle":
        given = [word.format("good.yaml") for word in command]
        given[given.index("--out") + 1] = place + Path(given[given.index("--out") + 1]).suffix
        assert_refused(given, "testbed: ", monkeypatch, capsys, desk)


@pytest.mark.parametrize("case", SCENARIOS)
def test_a_scenario_that_cannot_be_used(
    case: str, desk: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    text, word = SCENARIOS[case]
    (desk / "case.yaml").write_text(HEAD + text)
    assert_refused(["run", "case.yaml"], word, monkeypatch, capsys, desk)


@pytest.mark.parametrize("case", COMMANDS)
def test_a_command_that_cannot_be_carried_out(
    case: str, desk: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    arguments, word = COMMANDS[case]
    assert_refused(arguments, word, monkeypatch, capsys, desk)


def test_a_loop_is_not_begun_where_one_of_its_scenarios_cannot_be_used(
    desk: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    (desk / "out").mkdir()
    loop = ["loop", "--scenario", "good.yaml", "--scenario", "old.yaml", "--out"]
    monkeypatch.setattr("testbed.simulation.run.run_scenario", lambda *_: pytest.fail("began"))
    monkeypatch.setattr(sys, "argv", ["testbed", *loop, "out"])
    with pytest.raises(SystemExit) as end:
        main()
    assert (
        end.value.code == 2
        and "old.yaml: format = 'roboclimber-scenario/0'" in capsys.readouterr().err
    )
    assert not list((desk / "out").iterdir())


def test_the_shell_sees_the_same(desk: Path) -> None:
    done = completed("run", "good.yaml", "--set", "terrain.slope_deg=95")
    assert done.returncode == 2
    assert done.stdout == ""
    assert (
        done.stderr
        == "testbed: good.yaml: terrain.slope_deg = 95: is out of range (allowed: at most 85)\n"
    )
