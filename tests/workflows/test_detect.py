"""`testbed detect` on a foot, one leg and the whole robot: contact states in a table, scored
against a reference.
"""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pyarrow.parquet as pq
import pytest
from synthetic_walk import Walk
from typer.testing import CliRunner

from testbed.cli import app
from testbed.errors import InputError
from testbed.estimation.contact_losses import LossRule
from testbed.formats.table import write_columns
from testbed.formats.yaml_files import read_mapping, write_yaml
from testbed.recording.checker.check import check_recording
from testbed.workflows.detect import table

SAMPLES = Path(__file__).parents[1] / "data" / "first_version"
WALK = Walk(noise=0.02, offset=0.01, duration_s=30.0)
KEYS = {
    "losses",
    "missed",
    "delay_median_s",
    "delay_p95_s",
    "missed_s",
    "false_flight_s",
    "touchdown_delay_median_s",
}


def _foot(folder: Path, walk: Walk, known: dict[str, float], factor: float = 1.0) -> Path:
    time, true, reading = walk.draw()
    folder.mkdir()
    columns = {"t": time, "F": factor * reading, "true": factor * true, "c": (true > 300.0) * 1.0}
    write_columns(folder / "data.csv", columns)
    channels = {
        "time": {"column": "t", "unit": "s"},
        "force": {"column": "F", "unit": "N"},
        "contact": {"column": "c", "unit": "1"},
    }
    header = {
        "format": "roboclimber-recording/1",
        "rig": "foot",
        "data": "data.csv",
        "sample_rate_hz": walk.rate_hz,
        "channels": channels,
        "known": known,
    }
    write_yaml(folder / "recording.yaml", header)
    return folder


def _detect(*arguments: object) -> dict[str, Any]:
    done = CliRunner().invoke(app, ["detect", *map(str, arguments), "--json"])
    if done.exception is not None and not isinstance(done.exception, SystemExit):
        raise done.exception
    assert done.exit_code == 0, done.output
    found: dict[str, Any] = json.loads(done.output)
    return found


def _recorded(folder: Path, time: np.ndarray, true: np.ndarray, reading: np.ndarray) -> Path:
    """A foot of which nothing is declared, with a contact channel."""
    carries = LossRule(float(true.max())).carrying(true, time)
    folder.mkdir()
    write_columns(folder / "data.csv", {"t": time, "F": reading, "c": carries * 1.0})
    header = {
        "format": "roboclimber-recording/1",
        "rig": "foot",
        "data": "data.csv",
        "sample_rate_hz": round(1.0 / (time[1] - time[0])),
        "channels": {
            "time": {"column": "t", "unit": "s"},
            "force": {"column": "F", "unit": "N"},
            "contact": {"column": "c", "unit": "1"},
        },
        "known": {},
    }
    write_yaml(folder / "recording.yaml", header)
    return folder


def _hopper() -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """A leg of 2 kg that hops 2.2 times a second: impacts that ring, an offset that drifts."""
    time, rng = np.arange(0.0, 20.0, 1.0 / 500.0), np.random.default_rng(5)
    phase = (2.2 * time) % 1.0
    stance, since = phase < 0.45, phase / 2.2
    push = 43.0 * np.sin(np.pi * np.minimum(phase / 0.45, 1.0))
    ring = 5.0 * np.exp(-since / 0.012) * np.sin(2.0 * np.pi * 60.0 * since)
    true = np.where(stance, np.maximum(push + ring, 0.0), 0.0)
    return time, true, true + rng.normal(0.0, 0.4, len(time)) - 0.8 + 0.02 * time


def _heavy_leg() -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """A hydraulic leg of 1 t: slow steps behind 700 N of friction, an offset that drifts."""
    time, rng = np.arange(0.0, 80.0, 1.0 / 200.0), np.random.default_rng(6)
    step = np.interp((0.15 * time) % 1.0, [0.0, 0.09, 0.6, 0.69, 1.0], [0.0, 1.0, 1.0, 0.0, 0.0])
    true = 9810.0 * step * (1.0 + 0.1 * np.sin(5.7 * time))
    held = np.zeros(len(time))
    for k in range(1, len(time)):
        held[k] = np.clip(held[k - 1] + 0.4 * (true[k] - true[k - 1]), -700.0, 700.0)
    return time, true, true - held + rng.normal(0.0, 60.0, len(time)) + 150.0 + 3.0 * time


@pytest.mark.parametrize(("leg", "most_false_share"), [(_hopper, 0.05), (_heavy_leg, 0.04)])
def test_a_leg_of_2_kg_and_one_of_1_t_need_no_scale_of_their_own(
    tmp_path: Path, leg: Any, most_false_share: float
) -> None:
    time, true, reading = leg()
    done = _detect(
        _recorded(tmp_path / "leg", time, true, reading), "--out", tmp_path / "contact.parquet"
    )
    found = done["feet"]["foot"]
    assert found["losses"] >= 10 and found["missed"] == 0
    assert found["called_lost"] <= found["losses"] + 1
    assert found["missed_s"] < 0.2 and found["false_flight_s"] < most_false_share * time[-1]
    assert "assumed" in done["scale"]["foot"]["breakaway_from"]


def test_a_foot_is_scored_against_its_contact_channel_or_a_force(tmp_path: Path) -> None:
    foot = _foot(tmp_path / "foot", WALK, {"nominal_load_n": 9500.0})
    out = tmp_path / "contact.parquet"
    by_contact = _detect(foot, "--out", out)
    by_force = _detect(foot, "--out", out, "--reference", "true")
    for done in (by_contact, by_force):
        found = done["feet"]["foot"]
        assert set(found) >= KEYS and found["missed"] == 0 and found["losses"] > 5
        assert found["missed_s"] < 0.3 and found["false_flight_s"] < 0.5
    assert by_contact["reference"] == "channel contact"
    _, heads, rows = table(by_contact)
    shown = dict(zip(heads, rows[0], strict=True))
    counted = by_contact["feet"]["foot"]
    for head, key in (("losses", "losses"), ("missed", "missed"), ("false alarms", "false_alarms")):
        assert shown[head] == str(counted[key])
    assert by_contact["scale"]["foot"]["nominal_load_from"] == "declared"
    written = pq.read_table(out)
    assert written.column_names == ["t", "contact_foot", "known_foot"]
    assert set(written["contact_foot"].to_pylist()) == {0.0, 1.0}


def test_a_foot_that_carries_its_own_load_cell_is_scored_against_it(tmp_path: Path) -> None:
    """A foot that always hangs in the air is lost all the time."""
    foot, out = _foot(tmp_path / "foot", WALK, {"nominal_load_n": 9500.0}), tmp_path / "out.csv"
    by_column = _detect(foot, "--out", out, "--reference", "true")
    header = read_mapping(foot / "recording.yaml")
    del header["channels"]["contact"]
    scored = {}
    for kind in ({"kind": "load-cell", "column": "true", "unit": "N"}, {"kind": "free"}):
        write_yaml(foot / "recording.yaml", header | {"reference_force": kind})
        done = _detect(foot, "--out", out)
        assert done["reference"] == "reference_force"
        scored[kind["kind"]] = done["feet"]["foot"]
    assert scored["load-cell"] == by_column["feet"]["foot"]
    assert scored["free"]["missed_s"] > 1.0 and scored["free"]["false_flight_s"] == 0.0
    unknown = {"kind": "load-cell", "column": "cell", "unit": "N"}
    write_yaml(foot / "recording.yaml", header | {"reference_force": unknown})
    with pytest.raises(InputError, match=r"reference_force\.column"):
        _detect(foot, "--out", out)


def test_without_a_reference_every_score_is_told_as_unknown(tmp_path: Path) -> None:
    foot, out = _foot(tmp_path / "foot", WALK, {"nominal_load_n": 9500.0}), tmp_path / "out.csv"
    header = read_mapping(foot / "recording.yaml")
    del header["channels"]["contact"]
    write_yaml(foot / "recording.yaml", header)
    found = _detect(foot, "--out", out)["feet"]["foot"]
    assert all(found[key] is None for key in KEYS) and found["called_lost"] > 5


def test_two_kilograms_are_judged_as_a_tonne_is(tmp_path: Path) -> None:
    out = tmp_path / "contact.parquet"
    states = []
    for name, factor in (("tonne", 1.0), ("small", 1e-3)):
        done = _detect(_foot(tmp_path / name, WALK, {}, factor), "--out", out)
        assert done["scale"]["foot"]["nominal_load_from"] == "estimated from the force"
        assert done["feet"]["foot"]["missed"] == 0
        states.append(pq.read_table(out)["contact_foot"].to_numpy())
    assert np.mean(states[0] != states[1]) < 1e-3  # a table of text has other last digits


def test_a_force_that_friction_hides_is_that_of_a_foot_in_the_air(tmp_path: Path) -> None:
    """50 N to and fro, of a seal that hides 400 N: the scale is the seal's, not the errors' own."""
    walk = replace(WALK, noise=0.0)
    foot, out = _foot(tmp_path / "foot", walk, {"breakaway_n": 400.0}), tmp_path / "out.csv"
    time = walk.draw()[0]
    noise = 10.0 * np.random.default_rng(3).standard_normal(len(time))
    error = 50.0 * np.sin(2.0 * np.pi * time) + noise
    write_columns(foot / "data.csv", {"t": time, "F": error})
    header = read_mapping(foot / "recording.yaml")
    del header["channels"]["contact"]
    write_yaml(foot / "recording.yaml", header | {"reference_force": {"kind": "free"}})
    done = _detect(foot, "--out", out)
    assert done["feet"]["foot"]["missed_s"] == 0.0
    assert done["feet"]["foot"]["called_lost_share"] == 1.0
    write_columns(foot / "data.csv", {"t": time, "F": error + 1000.0 * (time > 10.0)})
    loaded = _detect(foot, "--out", out)
    assert loaded["scale"]["foot"]["nominal_load_from"] == "estimated from the force"
    assert loaded["feet"]["foot"]["called_lost_share"] == pytest.approx(1.0 / 3.0, abs=0.01)


def test_a_zero_that_hides_losses_shows_in_the_least_force_and_is_seen_once_declared(
    tmp_path: Path,
) -> None:
    walk, out = replace(WALK, offset=0.3), tmp_path / "out.csv"
    hidden = _detect(_foot(tmp_path / "plain", walk, {}), "--out", out)["feet"]["foot"]
    assert hidden["missed"] == hidden["losses"] > 0
    assert hidden["least_share_of_nominal_load"] > 0.2
    known = {"breakaway_n": 0.3 * walk.nominal_n}
    told = _detect(_foot(tmp_path / "told", walk, known), "--out", out)["feet"]["foot"]
    assert told["missed"] < 0.1 * told["losses"]


def test_the_scale_given_wins_and_decides_what_a_loss_is(tmp_path: Path) -> None:
    foot, out = _foot(tmp_path / "foot", WALK, {"nominal_load_n": 1.0}), tmp_path / "out.csv"
    done = _detect(foot, "--out", out, "--scale", 9500)
    assert done["scale"]["foot"]["nominal_load_n"] == 9500.0
    assert done["feet"]["foot"]["missed"] == 0
    halved = _detect(foot, "--out", out, "--scale", "9500,0.5,0.02", "--reference", "true")
    assert halved["loss"] == {"share_of_nominal_load": 0.5, "time_s": 0.02}
    for wrong in ("-1", "9500,2,0.02", "9500,0.03", "heavy"):
        with pytest.raises(InputError, match="--scale"):
            _detect(foot, "--out", out, "--scale", wrong)


def test_missing_forces_hold_the_state_and_are_said_to_be_unknown(tmp_path: Path) -> None:
    foot = _foot(tmp_path / "foot", replace(WALK, missing=0.3), {"nominal_load_n": 9500.0})
    found = _detect(foot, "--out", tmp_path / "out.csv")["feet"]["foot"]
    assert found["missed"] == 0 and found["missed_s"] < 0.4


def test_a_force_without_any_number_is_refused_by_check_and_by_detect(tmp_path: Path) -> None:
    time, true, reading = WALK.draw()
    foot = _recorded(tmp_path / "foot", time, true, np.full_like(reading, np.nan))
    (found,) = check_recording(foot).findings
    assert (found.channel, found.what) == ("force", "holds no number at all")
    with pytest.raises(InputError, match=r"channels\.force: holds no number"):
        _detect(foot, "--out", tmp_path / "out.csv")


def test_a_detector_of_ones_own_judges_a_foot(tmp_path: Path) -> None:
    mine = tmp_path / "mine.py"
    mine.write_text(
        "class Mine:\n    threshold = 0.9\n\n    def update(self, sample):\n"
        "        return 1.0 - sample.force / sample.nominal_load\n"
    )
    foot = _foot(tmp_path / "foot", WALK, {"nominal_load_n": 9500.0})
    done = _detect(foot, "--out", tmp_path / "out.csv", "--detector", f"{mine}:Mine")
    assert done["feet"]["foot"]["missed"] == 0
    with pytest.raises(InputError, match="does not work on forces alone"):
        _detect(foot, "--out", tmp_path / "out.csv", "--detector", "combined")


def test_all_feet_of_a_robot_from_pressures_and_from_a_named_force(tmp_path: Path) -> None:
    out = tmp_path / "contact.parquet"
    done = _detect(SAMPLES / "robot", "--out", out)
    assert done["detector"] == "learned" and set(done["feet"]) == {"fl", "fr", "rl", "rr"}
    assert {"t", "contact_fl", "contact_rr"} <= set(pq.read_table(out).column_names)
    single = _detect(SAMPLES / "robot", "--out", out, "--detector", "single_force")
    assert single["scale"]["fl"]["nominal_load_n"] == pytest.approx(9810.0, rel=0.1)
    column = _detect(SAMPLES / "robot", "--out", out, "--force", "estimate_own")
    assert column["detector"] == "single_force" and set(column["feet"]) == set(done["feet"])
    one = _detect(SAMPLES / "robot", "--out", out, "--force", "estimate_own_fl")
    assert set(one["feet"]) == {"fl"}


def test_one_leg_is_judged_by_its_estimated_force(tmp_path: Path) -> None:
    out = tmp_path / "contact.csv"
    leg = SAMPLES / "leg" / "verify" / "press"
    done = _detect(leg, "--out", out, "--model", SAMPLES / "leg" / "model.yaml")
    assert done["force"].startswith("the model") and set(done["feet"]) == {"foot"}
    assert "--model" in _detect(leg, "--out", out)["force"]


def test_a_column_that_is_not_there_is_one_line_and_nothing_is_written(tmp_path: Path) -> None:
    foot, out = _foot(tmp_path / "foot", WALK, {}), tmp_path / "out.csv"
    for option in ("--force", "--reference"):
        with pytest.raises(InputError, match=f"{option} = .G.: data.csv has no such column"):
            _detect(foot, "--out", out, option, "G")
    assert not out.exists()


@pytest.mark.parametrize("force", [(), ("--force", "F")])
def test_a_model_that_would_estimate_nothing_is_refused(
    force: tuple[str, ...], tmp_path: Path
) -> None:
    """A foot has its force, and so has every recording of which `--force` names it."""
    places = [_foot(tmp_path / "foot", WALK, {})] + [SAMPLES / "leg" / "verify" / "press"] * (
        force != ()
    )
    for place in places:
        with pytest.raises(InputError, match=r"--model = .m\.yaml.: estimates nothing"):
            _detect(place, "--out", tmp_path / "out.csv", "--model", "m.yaml", *force)


def test_a_column_that_is_no_force_is_not_taken_for_one(tmp_path: Path) -> None:
    foot, out = _foot(tmp_path / "foot", WALK, {}), tmp_path / "out.csv"
    header = read_mapping(foot / "recording.yaml")
    time = header["channels"]["time"]["column"]
    for option in ("--force", "--reference"):
        with pytest.raises(InputError, match=f"{option} = '{time}': is in s, which is no force"):
            _detect(foot, "--out", out, option, time)
    assert not out.exists()


def test_a_named_column_is_read_in_the_unit_that_the_header_declares(tmp_path: Path) -> None:
    """Of an axis and of a foot, of a channel that rides along and of the load cell: kN are not
    taken for N.
    """
    leg = SAMPLES / "leg" / "verify" / "press"
    header = read_mapping(leg / "recording.yaml")
    cell = header["reference_force"]
    table = pq.read_table(leg / header["data"])
    columns = {name: table[name].to_numpy() for name in table.column_names}
    columns["own"] = columns[cell["column"]] = columns[cell["column"]] / 1e3
    known = {"rig": "foot", "known": {}}
    foot = {"time": header["channels"]["time"], "force": {"column": "own", "unit": "kN"}}
    for rig, said in {
        "leg": {"channels": header["channels"] | {"own_force": {"column": "own", "unit": "kN"}}},
        "foot": known | {"channels": foot},
    }.items():
        (tmp_path / rig).mkdir()
        write_columns(tmp_path / rig / "data.parquet", columns)
        in_kn = {"kind": "load-cell", "column": cell["column"], "unit": "kN"}
        written = header | said | {"data": "data.parquet", "reference_force": in_kn}
        write_yaml(tmp_path / rig / "recording.yaml", written)
        found = [
            _detect(tmp_path / rig, "--out", tmp_path / "out.csv", "--force", force, *reference)
            for force in ("own", cell["column"])
            for reference in ((), ("--reference", "own"), ("--reference", cell["column"]))
        ]
        assert [done["feet"] for done in found] == [found[0]["feet"]] * len(found)
        assert found[0]["scale"]["foot"]["nominal_load_n"] > 1000.0


def test_an_answer_beside_the_recording_is_written_anew_and_the_recording_never(
    tmp_path: Path,
) -> None:
    folder = _foot(tmp_path / "foot", WALK, {"nominal_load_n": 1e4})
    recorded, answer = folder / "data.csv", folder / "contact.csv"
    before = recorded.read_bytes()
    _detect(folder, "--out", answer)
    first = answer.read_bytes()
    _detect(folder, "--out", answer)
    assert answer.read_bytes() == first
    done = CliRunner().invoke(app, ["detect", str(folder), "--out", str(recorded)])
    assert isinstance(done.exception, InputError) or done.exit_code == 2
    assert recorded.read_bytes() == before
