"""`testbed effects`: every effect with parameters, units, bounds, places and equation; for people
and for programs.
"""

from __future__ import annotations

import json

import pytest

from testbed.cli import main
from testbed.effects import ALL, by_name
from testbed.report.effects_list import TABLE_HEADS, described, table


def test_the_table_has_a_row_for_every_effect_with_units_and_bounds() -> None:
    rows = {row[0]: dict(zip(TABLE_HEADS, row, strict=True)) for row in table()}
    assert set(rows) == {effect.name for effect in ALL}
    line = rows["sensor.line_b"]
    assert "natural_frequency 1 .. 400 Hz" in line["parameters"]
    assert line["places"] == "any cylinder" and "pressure_b" in line["shown by"]
    assert "[curvature" in rows["friction.position"]["parameters"]
    assert rows["supply.droop"]["places"] == "any cylinder, supply"


def test_an_effect_says_who_knows_it() -> None:
    known = {
        name: described(by_name(name))["known_to"] for name in ("sensor.gain_a", "sensor.delay")
    }
    assert known["sensor.gain_a"] == {"world": True, "recordings": True, "live": True}
    assert known["sensor.delay"] == {"world": True, "recordings": True, "live": False}


def test_programs_read_the_same_list(
    capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("sys.argv", ["testbed", "effects", "--json"])
    with pytest.raises(SystemExit) as ended:
        main()
    assert ended.value.code == 0
    told = {row["name"]: row for row in json.loads(capsys.readouterr().out)}
    slope = told["friction.position"]["parameters"][0]
    assert (slope["name"], slope["unit"], slope["bounds"]) == ("slope", "1", [-20.0, 20.0])
    assert "fl_radial" in told["friction.position"]["places"]
