"""Other tools' tables become recordings: separators, decimal commas, comments, Parquet, MCAP, and
one line for a fault.
"""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
import pytest

from testbed.cli import main
from testbed.errors import InputError
from testbed.formats.table import write_columns
from testbed.formats.yaml_files import read_mapping, write_yaml
from testbed.recording.axis import Recording, read_recording
from testbed.recording.foot import read_foot
from testbed.recording.importer.importer import import_file
from testbed.recording.importer.mcap_file import _aligned, _is_known

N = 400
TIME = np.arange(N) / 100.0
SPEED = 0.02 * np.cos(2.0 * np.pi * TIME)
POSITION = 0.2 + 0.02 / (2.0 * np.pi) * np.sin(2.0 * np.pi * TIME)
PRESSURE = 2e6 + 1e5 * np.sin(TIME)
LOAD = PRESSURE * 0.25 * np.pi * 0.07**2 - 100.0 * np.sign(SPEED)
MAP = """
rig: cylinder
time: {column: t, unit: ms}
position: {column: x, unit: mm, resolution: 0.01}
pressure_a: {column: p, unit: bar}
current: {column: I, unit: mA, scale: 2.0, offset: 1.0}
known: {bore_m: {value: 0.07, tolerance: 0.01}, inclination_deg: 90.0}
reference_force: {kind: load-cell, column: F, unit: kN, standard_deviation: 0.001}
"""


def columns() -> dict[str, np.ndarray]:
    return {
        "t": 1e3 * TIME,
        "x": 1e3 * POSITION,
        "p": PRESSURE / 1e5,
        "I": 10.0 + TIME,
        "F": LOAD / 1e3,
    }


def quoted(table: str, separator: str) -> str:
    """Every cell of a table in quotes, as spreadsheets write them."""
    rows = [line.split(separator) for line in table.splitlines()]
    return "\n".join(",".join(f'"{cell}"' for cell in row) for row in rows)


def text(separator: str, comma: bool = False, head: str = "", units: bool = False) -> str:
    names = list(columns())
    lines = [head + separator.join(names)]
    lines += [separator.join(["[ms]", "[mm]", "[bar]", "[mA]", "[kN]"])] if units else []
    for row in zip(*columns().values(), strict=True):
        line = separator.join(f"{v:.9g}" for v in row)
        lines.append(line.replace(".", ",") if comma else line)
    return "\n".join(lines) + "\n"


def given_map(folder: Path, said: str = MAP) -> Path:
    path = folder / "map.yaml"
    path.write_text(said)
    return path


def differing(recording: Recording) -> list[str]:
    """What of a recording is not what the log says, by name."""
    reference = recording.header.reference_force
    wanted = {
        "time": (recording.time_s, pytest.approx(TIME, abs=1e-9)),
        "position": (recording.position_m, pytest.approx(POSITION, abs=1e-9)),
        "pressure": (recording.pressure_a_pa, pytest.approx(PRESSURE, rel=1e-6)),
        "load": (recording.reference_force_n, pytest.approx(LOAD, rel=1e-6)),
        "current": (
            recording.extra["current"],
            pytest.approx((2.0 * (10.0 + TIME) + 1.0) / 1e3, rel=1e-6),
        ),
        "resolution": (recording.position_resolution_m, pytest.approx(1e-5)),
        "rate": (recording.sample_rate_hz, pytest.approx(100.0)),
        "tolerance": (recording.known.tolerance("bore_m"), 0.01),
        "deviation": (reference and reference.standard_deviation, pytest.approx(1.0)),
    }
    return [name for name, (found, value) in wanted.items() if found != value]


@pytest.mark.parametrize(
    "table",
    [
        text(","),
        text(";", comma=True),
        text("\t", comma=True),
        text("   "),
        text("|", head="# a logger's remark\n% another\n\n"),
        text(";", comma=True, head="# Grüße\n", units=True),
        quoted(text(";", comma=True), ";"),
    ],
    ids=[
        "comma",
        "decimal comma",
        "tab",
        "spaces",
        "comments",
        "units below the names",
        "decimal commas within quotes",
    ],
)
def test_a_text_table_of_any_separator(table: str, tmp_path: Path) -> None:
    (tmp_path / "log.csv").write_text(table, encoding="latin-1")
    found = import_file(tmp_path / "log.csv", given_map(tmp_path), tmp_path / "out")
    assert found.usable
    assert not differing(read_recording(tmp_path / "out"))


def test_a_text_in_utf_16_is_read_as_such(tmp_path: Path) -> None:
    (tmp_path / "log.csv").write_text(text("\t", comma=True), encoding="utf-16")
    import_file(tmp_path / "log.csv", given_map(tmp_path), tmp_path / "out")
    assert not differing(read_recording(tmp_path / "out"))


def test_a_name_within_quotes_may_hold_the_separator(tmp_path: Path) -> None:
    (tmp_path / "log.csv").write_text(quoted(text(";"), ";").replace('"F"', '"F, of the cell"'))
    said = given_map(tmp_path, MAP.replace("column: F,", "column: 'F, of the cell',"))
    import_file(tmp_path / "log.csv", said, tmp_path / "out")
    assert not differing(read_recording(tmp_path / "out"))


def test_times_of_day_in_a_text_become_seconds_to_their_last_digit(tmp_path: Path) -> None:
    lines = text(",").splitlines()
    for row, since in enumerate(TIME, 1):
        clock = f"09:59:{58.0 + since:06.3f}" if since < 2.0 else f"10:00:{since - 2.0:06.3f}"
        lines[row] = ",".join([clock, *lines[row].split(",")[1:]])
    (tmp_path / "log.csv").write_text("\n".join(lines))
    in_s = given_map(tmp_path, MAP.replace("unit: ms", "unit: s"))
    import_file(tmp_path / "log.csv", in_s, tmp_path / "out")
    assert not differing(read_recording(tmp_path / "out"))


def test_a_cell_that_says_that_it_has_no_number_is_missing_and_another_word_is_named(
    tmp_path: Path,
) -> None:
    lines = text(",").splitlines()
    cells = lines[50].split(",")
    for number, word in enumerate(("N/A", "#N/A", "#NV", "")):
        lines[50] = ",".join([*cells[:2], word, *cells[3:]])
        (tmp_path / "log.csv").write_text("\n".join(lines))
        found = import_file(tmp_path / "log.csv", given_map(tmp_path), tmp_path / f"{number}")
        assert "is not a number" in {finding.what for finding in found.findings}
    lines[50] = ",".join([*cells[:2], "OVER", *cells[3:]])
    (tmp_path / "log.csv").write_text("\n".join(lines))
    with pytest.raises(InputError, match="'p' is not numbers: 'OVER' in row 50"):
        import_file(tmp_path / "log.csv", given_map(tmp_path), tmp_path / "out")


def test_a_table_without_names_has_numbered_columns(tmp_path: Path) -> None:
    (tmp_path / "log.txt").write_text(text(" ").split("\n", 1)[1])
    numbered = MAP
    for number, name in enumerate("txpIF", 1):
        numbered = numbered.replace(f"column: {name},", f"column: '{number}',")
    import_file(tmp_path / "log.txt", given_map(tmp_path, numbered), tmp_path / "out")
    assert not differing(read_recording(tmp_path / "out"))


def test_parquet(tmp_path: Path) -> None:
    write_columns(tmp_path / "log.parquet", columns())
    import_file(tmp_path / "log.parquet", given_map(tmp_path), tmp_path / "out")
    assert not differing(read_recording(tmp_path / "out"))


EPOCH_NS = 1_700_000_000_000_000_000
ZERO_NS = np.round(1e9 * TIME).astype(np.int64)


@pytest.mark.parametrize(
    "times",
    [
        pa.array(EPOCH_NS + ZERO_NS, pa.timestamp("ns")),
        pa.array(EPOCH_NS + ZERO_NS, pa.timestamp("ns", "Europe/Madrid")),
        pa.array(43_200_000_000_000 + ZERO_NS, pa.time64("ns")),
        pa.array(ZERO_NS, pa.duration("ns")),
    ],
    ids=["date", "date of a zone", "time of day", "duration"],
)
def test_dates_and_times_of_day_become_seconds_and_nothing_else(
    times: pa.Array, tmp_path: Path
) -> None:
    pq.write_table(pa.table(columns() | {"t": times}), tmp_path / "log.parquet")
    in_s = given_map(tmp_path, MAP.replace("unit: ms", "unit: s"))
    import_file(tmp_path / "log.parquet", in_s, tmp_path / "out")
    assert not differing(read_recording(tmp_path / "out"))
    with pytest.raises(InputError, match="unit = 'ms': column 't' holds times"):
        import_file(tmp_path / "log.parquet", given_map(tmp_path), tmp_path / "other")


def test_nanoseconds_since_1970_are_a_clock_like_any_other(tmp_path: Path) -> None:
    """More digits than a float64 keeps: what is rounded is less than a microsecond."""
    written = columns() | {"t": EPOCH_NS + ZERO_NS}
    pq.write_table(pa.table(written), tmp_path / "log.parquet")
    in_ns = given_map(tmp_path, MAP.replace("unit: ms", "unit: ns"))
    assert import_file(tmp_path / "log.parquet", in_ns, tmp_path / "out").usable
    read = read_recording(tmp_path / "out").time_s
    assert read - read[0] == pytest.approx(TIME, abs=1e-6)
    header = read_mapping(tmp_path / "out" / "recording.yaml")
    header["channels"]["time"]["unit"] = "ns"
    pq.write_table(
        pq.read_table(tmp_path / "out" / "data.parquet").set_column(
            0, "time", pa.array(written["t"])
        ),
        tmp_path / "out" / "data.parquet",
    )
    write_yaml(tmp_path / "out" / "recording.yaml", header)
    assert read_recording(tmp_path / "out").time_s == pytest.approx(read, abs=1e-6)


def test_a_clock_that_stands_still_is_one_line_whatever_the_rig_calls_it(tmp_path: Path) -> None:
    write_columns(tmp_path / "log.parquet", {"t": np.zeros(N), "x": POSITION})
    for rig, clock in (("cylinder", "time"), ("robot", "t")):
        said = f"rig: {rig}\n{clock}: {{column: t, unit: s}}\n"
        with pytest.raises(InputError, match="never rises"):
            import_file(tmp_path / "log.parquet", given_map(tmp_path, said), tmp_path / "out")


def test_mcap_of_two_topics_at_different_times(tmp_path: Path) -> None:
    writer_module = pytest.importorskip("mcap.writer")
    path = tmp_path / "log.mcap"
    with path.open("wb") as stream:
        writer = writer_module.Writer(stream)
        writer.start()
        schema = writer.register_schema(name="any", encoding="jsonschema", data=b"{}")
        axis = writer.register_channel("/axis", message_encoding="json", schema_id=schema)
        cell = writer.register_channel("/cell", message_encoding="json", schema_id=schema)
        for k in range(N):
            row = {"x": [1e3 * POSITION[k]], "oil": {"p": PRESSURE[k] / 1e5, "I": 10.0 + TIME[k]}}
            now = 10**18 + 10**7 * k
            writer.add_message(axis, now, json.dumps(row).encode(), now)
            late = now + 10**6
            force = float(np.interp((late - 10**18) * 1e-9, TIME, LOAD)) / 1e3
            writer.add_message(cell, late, json.dumps({"F": force}).encode(), late)
        writer.finish()
    said = (
        MAP.replace("column: t, unit: ms", "column: log_time, unit: ns")
        .replace("column: x,", "column: /axis.x.0,")
        .replace("column: p,", "column: /axis.oil.p,")
        .replace("column: I,", "column: /axis.oil.I,")
        .replace("column: F,", "column: /cell.F,")
    )
    import_file(path, given_map(tmp_path, said), tmp_path / "out")
    recording = read_recording(tmp_path / "out")
    # 1 ms after the first row the cell speaks first: that row is missing, nothing is made up for it
    assert recording.time_s == pytest.approx(TIME[1:], abs=1e-9)
    assert recording.position_m == pytest.approx(POSITION[1:], abs=1e-9)
    assert recording.reference_force_n is not None  # between messages at another time than the rows
    assert recording.reference_force_n[4:19] == pytest.approx(LOAD[5:20], rel=1e-3)


def test_what_switches_and_what_is_held_keeps_its_value_until_the_next_message(
    tmp_path: Path,
) -> None:
    """A contact and a valve's command at a half and a fifth of the force's rate."""
    writer_module = pytest.importorskip("mcap.writer")
    path = tmp_path / "log.mcap"
    carries, command = TIME % 1.0 < 0.6, np.round(np.sin(TIME), 2)
    with path.open("wb") as stream:
        writer = writer_module.Writer(stream)
        writer.start()
        schema = writer.register_schema(name="any", encoding="jsonschema", data=b"{}")
        topics = [
            writer.register_channel(name, message_encoding="json", schema_id=schema)
            for name in ("/axis", "/foot", "/valve")
        ]
        for k in range(N):
            rows = [
                {"x": POSITION[k], "p": PRESSURE[k]},
                {"on": bool(carries[k])},
                {"u": command[k]},
            ]
            for topic, row, every in zip(topics, rows, (1, 2, 5), strict=True):
                if k % every == 0:
                    writer.add_message(topic, 10**7 * k, json.dumps(row).encode(), 10**7 * k)
        writer.finish()
    said = (
        "rig: cylinder\ntime: {column: log_time, unit: ns}\nknown: {bore_m: 0.07}\n"
        "position: {column: /axis.x, unit: m}\npressure_a: {column: /axis.p, unit: Pa}\n"
        "valve_command: {column: /valve.u, unit: '1'}\nfoot_on: {column: /foot.on, unit: '1'}\n"
    )
    import_file(path, given_map(tmp_path, said), tmp_path / "out")
    recording = read_recording(tmp_path / "out")
    row = np.round(100.0 * recording.time_s).astype(int)
    np.testing.assert_array_equal(recording.valve_command, command[5 * (row // 5)])
    np.testing.assert_array_equal(recording.extra["foot_on"] > 0.5, carries[2 * (row // 2)])
    assert set(np.unique(recording.extra["foot_on"])) == {0.0, 1.0}


@pytest.mark.parametrize(
    ("messages", "rows"),
    [
        ([10.0, 20.0, 30.0], [10, 15, 20, 25, 30]),  # nothing before the first and behind the last
        ([0.0, 10.0, 20.0, 90.0, 100.0], [0, 5, 10, 15, 20, 90, 95, 100]),  # nothing in a gap
        ([2.0, 12.0, 27.0, 42.0], [5, 10, 15, 20, 25, 30, 35, 40]),  # 15 ms is no gap
        ([50.0], [50]),
        ([101.0, 111.0], []),
    ],
)
def test_rows_at_which_a_topic_is_silent_are_missing(
    messages: list[float], rows: list[int]
) -> None:
    stamps = np.arange(0.0, 101.0, 5.0)
    known = _is_known(1e6 * stamps, 1e6 * np.array(messages))
    assert stamps[known].tolist() == rows


def test_topics_that_never_speak_side_by_side_are_refused(tmp_path: Path) -> None:
    owner, times = {"/a.x": "/a", "/a.y": "/a", "/b.z": "/b"}, {"/a": [0, 1, 2], "/b": [5, 6]}
    found = {"/a.x": [0.0] * 3, "/a.y": [0.0] * 3, "/b.z": [0.0] * 2}
    with pytest.raises(InputError, match="'/a' and '/b' have no time in common"):
        _aligned(found, owner, times, times, (), tmp_path)


def test_a_foot(tmp_path: Path) -> None:
    (tmp_path / "log.csv").write_text(text(","))
    said = "rig: foot\ntime: {column: t, unit: ms}\nforce: {column: F, unit: kN}\n"
    import_file(tmp_path / "log.csv", given_map(tmp_path, said), tmp_path / "out")
    assert read_foot(tmp_path / "out").force_n == pytest.approx(LOAD, rel=1e-6)


def test_what_is_wrong_with_an_imported_table_is_said(tmp_path: Path) -> None:
    (tmp_path / "log.csv").write_text(text(","))
    turned = MAP.replace("column: F, unit: kN", "column: F, unit: kN, scale: -1.0")
    found = import_file(tmp_path / "log.csv", given_map(tmp_path, turned), tmp_path / "out")
    assert [f.channel for f in found.findings if f.severity == "error"] == ["reference_force"]


@pytest.mark.parametrize(
    ("old", "new", "said"),
    [
        ("column: x,", "column: y,", "has no column 'y' (allowed: t, x, p, I, F)"),
        ("unit: mm,", "unit: furlong,", "position.unit = 'furlong': unknown unit"),
        ("unit: bar", "unit: mm", "channels.pressure_a.unit = 'm': wrong unit"),
        ("pressure_a:", "presure_a:", "did you mean 'pressure_a'"),
        ("scale: 2.0", "scale: two", "current.scale = 'two'"),
        ("column: I,", "columm: I,", "current.columm: unknown key, did you mean 'column'"),
        ("rig: cylinder", "rig: table", "rig = 'table'"),
        ("bore_m: {", "boar_m: {", "did you mean 'bore_m'"),
        ("time: {", "clock: {", "time: is missing"),
    ],
)
def test_a_map_that_does_not_fit_is_one_line_and_leaves_nothing(
    old: str,
    new: str,
    said: str,
    tmp_path: Path,
    capsys: pytest.CaptureFixture[str],
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    (tmp_path / "log.csv").write_text(text(","))
    wrong = given_map(tmp_path, MAP.replace(old, new))
    before = sorted(tmp_path.iterdir())
    command = [
        "import",
        str(tmp_path / "log.csv"),
        "--map",
        str(wrong),
        "--out",
        str(tmp_path / "o"),
    ]
    monkeypatch.setattr("sys.argv", ["testbed", *command])
    with pytest.raises(SystemExit) as end:
        main()
    line = capsys.readouterr().err
    assert end.value.code == 2 and line.count("\n") == 1 and said in line
    assert sorted(tmp_path.iterdir()) == before


def test_a_folder_that_is_there_is_left_alone(tmp_path: Path) -> None:
    (tmp_path / "log.csv").write_text(text(","))
    (tmp_path / "out").mkdir()
    (tmp_path / "out" / "mine.txt").write_text("mine")
    with pytest.raises(InputError, match="is there already"):
        import_file(tmp_path / "log.csv", given_map(tmp_path), tmp_path / "out")
    assert [p.name for p in (tmp_path / "out").iterdir()] == ["mine.txt"]


@pytest.mark.parametrize(
    ("table", "said"),
    [
        ("t;x\n1;2\n3\n", "do not have equally many cells"),
        ("", "holds no table"),
        ("t,x,p,I,F\n0,a,1,1,1\n1,b,1,1,1\n", "column 'x' is not numbers"),
        ("t,t,p,I,F\n0,1,1,1,1\n1,1,1,1,1\n", "two columns 't'"),
    ],
)
def test_a_table_that_is_none_is_one_line(table: str, said: str, tmp_path: Path) -> None:
    (tmp_path / "log.csv").write_text(table)
    with pytest.raises(InputError, match=said):
        import_file(tmp_path / "log.csv", given_map(tmp_path), tmp_path / "out")
