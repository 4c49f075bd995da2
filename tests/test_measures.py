"""CONTRIBUTING's table "Measures" is what `make house` counts."""

from __future__ import annotations

import importlib.util
import re
import sys
from pathlib import Path
from types import ModuleType

import pytest

ROOT = Path(__file__).parents[1]
MAY_DIFFER = 0.05
"""Share by which a figure on the page may lag behind the sources."""


@pytest.fixture(scope="module")
def measures() -> ModuleType:
    """docs/measures.py, which is no part of the package."""
    spec = importlib.util.spec_from_file_location("measures", ROOT / "docs" / "measures.py")
    assert spec is not None
    assert spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    sys.modules["measures"] = module
    spec.loader.exec_module(module)
    return module


def numbers(cell: str) -> list[float]:
    """The numbers of a cell; thousands are apart by a space."""
    return [float(part.replace(" ", "")) for part in re.findall(r"\d[\d .]*", cell)]


@pytest.mark.slow
def test_the_table_is_what_is_counted(measures: ModuleType) -> None:
    lines = (ROOT / "CONTRIBUTING.md").read_text(encoding="utf-8").splitlines()
    for first, counted in measures.tabled(ROOT).items():
        (line,) = [line for line in lines if line.startswith(f"| {first} |")]
        stated = numbers(line.split("|")[3])
        assert stated == pytest.approx(numbers(counted), rel=MAY_DIFFER), "run make house"


def test_rows_are_filled_by_their_first_cell(measures: ModuleType) -> None:
    page = "| a | before | now |\n| lines | 1 | 2 |\n"
    assert measures.filled(page, {"lines": "3"}) == "| a | before | now |\n| lines | 1 | 3 |\n"
    with pytest.raises(ValueError, match="no row 'words'"):
        measures.filled(page, {"words": "3"})


def test_parameters_are_all_but_the_own_object(measures: ModuleType) -> None:
    (function,) = measures.ast.parse("def f(self, a, /, b, *c, d, **e): ...").body
    assert measures.parameters(function) == ["a", "b", "d", "c", "e"]
