"""YAML of any origin is read quickly or refused in one line; what people write is read as they mean
it.
"""

from __future__ import annotations

import time
from pathlib import Path

import pytest

from testbed.errors import InputError
from testbed.formats.yaml_files import MOST_BYTES, MOST_DEPTH, parse_yaml, read_mapping, read_yaml

LAUGHS = "a0: &a0 [lol, lol, lol, lol, lol, lol, lol, lol, lol, lol]\n" + "".join(
    f"a{k}: &a{k} [{', '.join([f'*a{k - 1}'] * 10)}]\n" for k in range(1, 10)
)
CHAIN = "a0: &a0 [1]\n" + "".join(f"a{k}: &a{k} [*a{k - 1}]\n" for k in range(1, 200))


@pytest.mark.parametrize(
    ("text", "told"),
    {
        LAUGHS: "stands for more than 10000 values by aliases",
        CHAIN: f"lies deeper than {MOST_DEPTH} levels",
        "a: " + "[" * 5000 + "]" * 5000: f"lies deeper than {MOST_DEPTH} levels",
        "a: " + "{b: " * 5000: f"lies deeper than {MOST_DEPTH} levels",
        "a: &a [*a]": "holds itself",
        "a: &a {b: {c: *a}}": "holds itself",
        "[" + "1, " * 300_001 + "]": "holds more than 300000 values",
        "a: *nothing": "undefined alias",
        "a: !!python/object/apply:os.system [true]": "could not determine a constructor",
        "a: !!python/name:os.system": "could not determine a constructor",
        "a: " + "9" * 5000: "is not valid YAML",
    }.items(),
    ids=lambda value: str(value)[:24],
)
def test_what_no_person_writes_is_refused_at_once(tmp_path: Path, text: str, told: str) -> None:
    (tmp_path / "a.yaml").write_text(text)
    started = time.perf_counter()
    with pytest.raises(InputError, match=r"a\.yaml: is not valid YAML") as error:
        read_yaml(tmp_path / "a.yaml")
    assert time.perf_counter() - started < 5.0
    assert told in str(error.value) and "\n" not in str(error.value)


def test_a_file_that_is_too_large_or_never_ends_is_refused(tmp_path: Path) -> None:
    (tmp_path / "a.yaml").write_text("#" * (MOST_BYTES + 1))
    with pytest.raises(InputError, match=r"a\.yaml: is too large"):
        read_mapping(tmp_path / "a.yaml")
    with pytest.raises(InputError, match="/dev/zero: is not a file"):
        read_mapping("/dev/zero")


def test_anchors_and_aliases_as_people_use_them_are_read() -> None:
    text = "first: &leg {bore_m: 0.05, list: [1, 2]}\nsecond: *leg\nthird: [*leg, *leg]\n"
    leg = {"bore_m": 0.05, "list": [1, 2]}
    assert parse_yaml(text, "x") == {"first": leg, "second": leg, "third": [leg, leg]}


def test_depth_up_to_the_bound_is_read() -> None:
    found = parse_yaml("[" * (MOST_DEPTH - 1) + "1" + "]" * (MOST_DEPTH - 1), "x")
    for _ in range(MOST_DEPTH - 1):
        (found,) = found
    assert found == 1


def test_words_and_numbers_mean_what_they_say() -> None:
    assert parse_yaml("[1e8, off, 010, .inf, true, null, yes]", "x") == [
        *(1e8, "off", 10, float("inf"), True, None, "yes")
    ]
