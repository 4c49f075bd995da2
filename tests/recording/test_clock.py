"""The clock of a recording: which rows rise, and what a gap, a jump or another unit looks like."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from testbed.formats.table import write_columns
from testbed.formats.yaml_files import write_yaml
from testbed.recording.axis_header import AnyHeader
from testbed.recording.checker.check import check_recording
from testbed.recording.checker.clock import OTHER_UNIT, check_clock, rising
from testbed.recording.checker.finding import Checked, Finding, sorted_findings
from testbed.recording.checker.raw import Raw

RATE_HZ = 200.0


def recorded(time: np.ndarray, position: np.ndarray | None = None) -> Raw:
    header = AnyHeader(
        format="roboclimber-recording/1", data="data.csv", sample_rate_hz=RATE_HZ, channels={}
    )
    series = {} if position is None else {"position": position}
    return Raw("a recording", "cylinder", header, time, series, {}, {})


def ticks(count: int = 400) -> np.ndarray:
    return np.arange(count) / RATE_HZ


def found(time: np.ndarray, position: np.ndarray | None = None) -> list[Finding]:
    return list(check_clock(recorded(time, position)))


def test_rows_rise_over_every_row_before_and_not_only_the_last() -> None:
    time = np.array([0.0, 1.0, 0.5, 0.9, 1.0, 1.1, np.nan, 1.05, 1.2])
    assert rising(time).tolist() == [True, True, False, False, False, True, False, False, True]


def test_an_even_clock_is_no_finding() -> None:
    assert found(ticks()) == []


def test_a_clock_that_runs_back_is_an_error_at_its_row() -> None:
    time = ticks()
    time[100:] -= 0.1
    (finding,) = found(time)
    assert finding.what == "time runs backwards" and "row 100" in finding.evidence
    assert (finding.from_s, finding.to_s) == pytest.approx((time[99], time[100]))


@pytest.mark.filterwarnings("error")
def test_a_clock_that_stands_still_for_ten_rows_is_said_without_a_warning_of_numpy() -> None:
    time = ticks()
    time[100:110] = time[100]
    assert found(time, 0.1 * ticks())[0].what.startswith("time stands still")


def test_doubled_rows_are_counted() -> None:
    time = np.sort(np.concatenate([ticks(), ticks()[[7, 60, 90]]]))
    (finding,) = found(time)
    assert finding.what.startswith("time stands still") and finding.evidence.startswith("3 times")


def test_a_time_that_is_no_number_is_named_by_its_first_row() -> None:
    time = ticks()
    time[[30, 31]] = np.nan
    assert found(time)[0].evidence == "2 rows, first row 30"


@pytest.mark.parametrize(
    ("factor", "severity", "words"),
    [
        (1.02, None, ""),
        (1.5, "warning", "the rate is not the declared one"),
        (1e3, "error", "is hardly in the declared unit"),
    ],
)
def test_another_rate_is_a_warning_and_another_unit_an_error(
    factor: float, severity: str | None, words: str
) -> None:
    findings = found(factor * ticks())
    assert [finding.severity for finding in findings] == ([severity] if severity else [])
    assert all(finding.what == words for finding in findings)


@pytest.mark.parametrize(("missing_s", "severity"), [(0.06, "note"), (0.5, "warning")])
def test_missing_samples_are_a_note_or_a_warning_by_their_length(
    missing_s: float, severity: str
) -> None:
    time = ticks()
    kept = (time <= 1.0) | (time > 1.0 + missing_s)
    (finding,) = found(time[kept], 0.05 * time[kept])
    assert finding.severity == severity and finding.what == "samples are missing"


def test_a_clock_that_jumps_while_the_piston_goes_on_is_no_gap() -> None:
    """The position moves on by one usual step, though half a second seems to have passed."""
    time, position = ticks(), 0.05 * ticks()
    time[200:] += 0.5
    (finding,) = found(time, position)
    assert finding.what.startswith("the clock jumps")


def test_few_rows_are_refused_before_anything_else_is_asked() -> None:
    (finding,) = found(np.zeros(10))
    assert finding.what == "too few samples"


def test_the_worst_comes_first_and_an_error_makes_a_recording_unusable() -> None:
    findings = [
        Finding(severity, "time", severity, "", "") for severity in ("note", "error", "warning")
    ]
    in_order = sorted_findings(findings)
    assert [finding.severity for finding in in_order] == ["error", "warning", "note"]
    assert not Checked("one", in_order).usable and Checked("two", in_order[1:]).usable


@pytest.mark.parametrize(
    ("from_s", "to_s", "words"),
    [(None, None, ""), (1.25, None, "1.25"), (1.25, 1.25, "1.25"), (1.0, 2.5, "1 to 2.5")],
)
def test_a_stretch_of_time_in_words(from_s: float | None, to_s: float | None, words: str) -> None:
    assert Finding("note", "time", "", "", "", from_s, to_s).when() == words


def test_a_clock_of_whole_seconds_stands_still_and_its_steps_are_no_gaps() -> None:
    (finding, rate) = found(np.floor(ticks(2000)), 0.1 * ticks(2000))
    assert finding.what.startswith("time stands still") and rate.what == OTHER_UNIT


def test_of_a_clock_in_another_unit_nothing_else_is_computed(tmp_path: Path) -> None:
    """Seconds that are declared to be ns: a smoothing of 12 ms would span ten million million
    rows.
    """
    t = ticks(2000)
    columns = {"t": t, "x": 0.2 + 0.05 * np.sin(t), "p": 2e6 + 1e5 * np.sin(3.0 * t)}
    write_columns(tmp_path / "data.csv", columns)
    units = {"time": ("t", "ns"), "position": ("x", "m"), "pressure_a": ("p", "Pa")}
    header = {
        "format": "roboclimber-recording/1",
        "rig": "cylinder",
        "data": "data.csv",
        "sample_rate_hz": RATE_HZ,
        "channels": {name: {"column": c, "unit": u} for name, (c, u) in units.items()},
        "known": {"bore_m": 0.07},
        "reference_force": {"kind": "free"},
    }
    write_yaml(tmp_path / "recording.yaml", header)
    (finding,) = check_recording(tmp_path).findings
    assert (finding.severity, finding.what) == ("error", OTHER_UNIT)
