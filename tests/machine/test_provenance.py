"""A parameter file's numbers: each with unit, mark and source, or refused by its place."""

from __future__ import annotations

from pathlib import Path

import pytest

from testbed.errors import InputError
from testbed.machine.provenance import MARKS, nearest, read_quantities

SOUND = "body: {mass_kg: {value: 3.5, unit: kg, mark: B, source: scales}}\n"


def read(folder: Path, text: str) -> object:
    path = folder / "machine.yaml"
    path.write_text(text)
    return read_quantities(path)


def test_numbers_go_by_their_dotted_path_in_the_files_order(tmp_path: Path) -> None:
    more = "oil: {edges: {value: [1, 2], unit: '1', mark: E, source: guess}}\n"
    found = read(tmp_path, SOUND + more)
    assert list(found) == ["body.mass_kg", "oil.edges"]
    assert found["body.mass_kg"].value == 3.5 and found["oil.edges"].value == (1, 2)
    assert (found["body.mass_kg"].unit, found["body.mass_kg"].source) == ("kg", "scales")


@pytest.mark.parametrize(
    ("old", "new", "said"),
    [
        ("mark: B", "mark: Z", "machine.yaml: body.mass_kg.mark = 'Z': no such mark"),
        ("mark: B", "mark: {B: B}", "body.mass_kg.mark = {'B': 'B'}: no such mark"),
        ("unit: kg, ", "", "body.mass_kg: has no unit"),
        ("unit: kg", "unit: [kg]", "body.mass_kg = ['kg']: has no unit"),
        ("source: scales", "source: ''", "body.mass_kg: has no source"),
        ("source: scales", "source: scales, note: x", "unknown key 'note'"),
        ("value: 3.5", "value: .nan", "is not a finite number"),
        ("value: 3.5", "value: true", "is not a finite number"),
        ("value: 3.5", f"value: 1{'0' * 400}", "is not a finite number"),
        ("{value: 3.5, unit: kg, mark: B, source: scales}", "3.5", "must carry value"),
        (SOUND.strip(), "- 1", "must be a mapping"),
    ],
)
def test_a_number_without_its_origin_is_refused(
    tmp_path: Path, old: str, new: str, said: str
) -> None:
    with pytest.raises(InputError, match=r"machine\.yaml") as caught:
        read(tmp_path, SOUND.replace(old, new))
    assert said in str(caught.value) and str(tmp_path) in str(caught.value)


def test_marks_and_near_names_are_told() -> None:
    assert list(MARKS) == list("ABCDE")
    assert nearest("oil.buk_modulus", ["oil.bulk_modulus_pa", "seal.stiffness"]).startswith(
        "a parameter such as oil.bulk_modulus_pa"
    )
