"""Mistakes planted into recordings, and how what a checker says of them is counted."""

from __future__ import annotations

import shutil
from pathlib import Path

import numpy as np
import pytest

from testbed.benchmarks.harness import answers
from testbed.benchmarks.recording_mistakes.benchmark import RecordingMistakes
from testbed.benchmarks.recording_mistakes.drawn import drawn_cases, drawn_sample
from testbed.benchmarks.recording_mistakes.sample import load
from testbed.benchmarks.recording_mistakes.table import Mistake, lacks, mistakes
from testbed.errors import InputError
from testbed.recording.axis import read_recording
from testbed.recording.checker.finding import Finding

SAMPLES = Path(__file__).parents[2] / "data" / "first_version"
SLOW = SAMPLES / "leg" / "identify" / "slow"
ALL = {mistake.name: mistake for rows in mistakes().values() for mistake in rows}


def test_every_mistake_says_what_has_to_be_said_of_it() -> None:
    rows = [mistake for group in mistakes().values() for mistake in group]
    assert len(ALL) == len(rows) > 50
    assert all(bool(row.blames and row.says) != row.sound for row in rows)
    assert set(lacks()) == {lack for row in rows for lack in row.blind}


def finding(channel: str, what: str) -> Finding:
    return Finding("error", channel, what, "0.1", "declare unit 'bar' if the column is in it")


@pytest.mark.parametrize(
    ("found", "outcome"),
    [
        ([], "missed"),
        ([finding("pressure_a", "is too small by 100000")], "named"),
        ([finding("known.bore_m", "is too small (or pressure_a: its unit)")], "among others"),
        ([finding("known.bore_m", "is too small")], "otherwise"),
        ([finding("position", "is odd"), finding("pressure_b", "is too small")], "named"),
    ],
)
def test_a_complaint_is_worth_what_it_names(found: list[Finding], outcome: str) -> None:
    assert ALL["pressures in bar, read as Pa"].outcome(load(SLOW), found) == outcome


def test_the_kind_has_to_be_right_as_well_as_the_channel() -> None:
    clipped = Finding("error", "pressure_a", "is clipped", "0.1", "declare range_pa")
    assert ALL["pressure A frozen for a second"].outcome(load(SLOW), [clipped]) == "otherwise"


CHOSEN = (
    "pressures A and B exchanged",
    "gap",
    "mass in grams",
    "pressures in bar, declared so",
    "time in ms, declared so",
)


def test_a_recording_is_judged_with_each_mistake_and_as_it_is(tmp_path: Path) -> None:
    shutil.copytree(SLOW, tmp_path / "rig" / "slow")
    benchmark = RecordingMistakes((tmp_path,), only=CHOSEN)
    result = benchmark.summarise(answers(benchmark))
    assert result["recordings"] == 1 and result["complaints"] == {}
    assert result["planted"] == 3 and result["missed"] == result["otherwise"] == 0
    assert result["mistakes"]["gap"]["named"] == 1
    assert result["declared_as_they_are"] == {"quiet": 2} and result["faults"] == []
    sums, each, *_ = benchmark.tables(result)
    assert ["mistakes planted that a recording can show; that it cannot", "3; 0"] in sums.rows
    assert result["rightly"]["count"] == 3 and result["rightly"]["share"] == 1.0
    assert {row[0] for row in each.rows} == set(CHOSEN[:3])


def test_a_recording_that_is_already_wrong_is_a_false_complaint_and_no_find(
    tmp_path: Path,
) -> None:
    ALL["gap"].planter()(sample := load(SLOW))
    sample.write(tmp_path / "with_gap")
    benchmark = RecordingMistakes((tmp_path,), only=("gap", "rows doubled"))
    result = benchmark.summarise(answers(benchmark))
    assert len(result["complaints"]) == 1
    assert result["mistakes"]["gap"]["missed"] == 1
    assert result["mistakes"]["rows doubled"]["named"] == 1


def test_what_a_recording_lacks_hides_a_mistake_with_a_reason(tmp_path: Path) -> None:
    drive = SAMPLES / "drive" / "identify" / "sine"
    shutil.copytree(drive, tmp_path / "drive")
    benchmark = RecordingMistakes((tmp_path,), only=("force in kN, read as N",))
    result = benchmark.summarise(answers(benchmark))
    assert result["planted"] == 0
    row = result["mistakes"]["force in kN, read as N"]
    assert row["hidden"] == 1 and row["lacking"] == {"drive of unknown mass": 1}


def test_a_drawn_recording_is_read_back_as_it_was_made(tmp_path: Path) -> None:
    assert len(list(drawn_cases(2, 500))) == 8
    sample = drawn_sample("bench 501 identify")
    read = read_recording(sample.write(tmp_path / "bench"))
    assert read.rig == "cylinder" and read.pressure_a_pa is not None
    np.testing.assert_array_equal(read.pressure_a_pa, sample["pressure_a"])


@pytest.mark.parametrize(
    ("mistake", "said"),
    [
        ("position in mm, read as m", "no cylinder is so long"),
        ("force turned round", "would drive the piston"),
        ("position turned round", "would drive the piston"),
    ],
)
def test_a_drive_with_a_mistake_is_refused_in_words_and_never_a_fault(
    mistake: str, said: str, tmp_path: Path
) -> None:
    shutil.copytree(SAMPLES / "drive" / "identify" / "sine", tmp_path / "drive")
    benchmark = RecordingMistakes((tmp_path,), only=(mistake,), use="identify")
    ((answer,),) = [one["planted"] for one in answers(benchmark).values()]
    assert answer["used"].startswith("refused") and said in answer["used"]


def test_no_recording_is_one_line(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="holds no recording"):
        RecordingMistakes((tmp_path,)).cases()


def test_a_row_of_the_table_that_names_nothing_known_is_refused() -> None:
    row = Mistake(name="x", plant={"no such": {}})
    with pytest.raises(KeyError):
        row.planter()
