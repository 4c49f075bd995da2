"""How a user states a foot's scale, and what the table of `testbed detect` says of it."""

from __future__ import annotations

from typing import Any

import pytest

from testbed.errors import InputError
from testbed.workflows.detect import Options, scale_options, table

FOUND: dict[str, Any] = {
    "detector": "single_force",
    "force": "channel force",
    "reference": None,
    "feet": {
        "foot": {
            "called_lost": 3,
            "called_lost_share": 0.25,
            "least_share_of_nominal_load": 0.012,
        }
    },
    "scale": {
        "foot": {
            "nominal_load_n": 9810.0,
            "nominal_load_from": "declared",
            "breakaway_n": 300.0,
            "breakaway_from": "declared",
        }
    },
}
SCORED = {
    "losses": 4,
    "missed": 1,
    "false_alarms": 3,
    "delay_median_s": 0.0125,
    "delay_p95_s": 0.05,
    "touchdown_delay_median_s": None,
    "missed_s": 0.5,
    "false_flight_s": 0.125,
}


def test_one_number_is_the_nominal_load_and_three_say_what_a_loss_is() -> None:
    assert scale_options(None) == {}
    assert scale_options("9810") == {"scale_n": 9810.0}
    assert scale_options("20,0.1,0.05") == {"scale_n": 20.0, "loss_share": 0.1, "loss_s": 0.05}
    rule = Options(**scale_options("20,0.1,0.05")).rule(20.0)
    assert (rule.nominal_load_n, rule.share, rule.shortest_s) == (20.0, 0.1, 0.05)


@pytest.mark.parametrize(
    "text",
    ["", "heavy", "0", "-5", "inf", "nan", "9810,0.1", "9810,0,0.1", "9810,1,0.1", "1,0.1,11"],
)
def test_a_scale_that_cannot_be_is_refused_as_it_was_written(text: str) -> None:
    with pytest.raises(InputError, match="is out of range") as refused:
        scale_options(text)
    assert repr(text) in str(refused.value) and "--scale" in str(refused.value)


def test_without_a_reference_the_table_says_what_was_called_lost() -> None:
    title, heads, (row,) = table(FOUND)
    assert title == "Contact by single_force from channel force"
    assert len(heads) == len(row) == 6
    assert row == ["foot", "9810 (declared)", "300 (declared)", "3", "0.250", "0.01"]


def test_against_a_reference_delays_come_in_milliseconds_and_what_is_not_known_is_empty() -> None:
    feet = {"foot": FOUND["feet"]["foot"] | SCORED, "bare": FOUND["feet"]["foot"]}
    scale = {foot: FOUND["scale"]["foot"] for foot in feet}
    title, heads, (scored, bare) = table(
        FOUND | {"reference": "cell", "feet": feet, "scale": scale}
    )
    assert title.endswith(", against cell") and len(heads) == len(scored) == len(bare) == 14
    assert scored[6:] == ["4", "1", "3", "12.5", "50.0", "", "0.500", "0.125"]
    assert bare[6:] == [""] * 8
