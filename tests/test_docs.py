"""The documentation site: its pages that are made from the code hold everything, and the whole
builds strictly.
"""

from __future__ import annotations

import importlib.util
import os
import re
import subprocess
import sys
from pathlib import Path
from types import ModuleType

import pytest
import typer
import yaml

import testbed
from testbed.cli import app
from testbed.effects import ALL
from testbed.recording.rows import DataRow, TruthRow
from testbed.report.page import words
from testbed.scenario.scenario import Scenario

ROOT = Path(__file__).parents[1]


@pytest.fixture(scope="module")
def hooks() -> ModuleType:
    spec = importlib.util.spec_from_file_location("hooks", ROOT / "docs" / "hooks.py")
    assert spec is not None and spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


def test_every_command_stands_with_its_options(hooks: ModuleType) -> None:
    page = hooks.command_page()
    heads = re.findall(r"^## (.+)$", page, re.MULTILINE)
    commands = typer.main.get_command(app).commands  # type: ignore[attr-defined]
    for name in commands:
        assert any(head.startswith(f"testbed {name}") for head in heads), name
    assert "`--video`" in page and "`SCENARIO`" in page


def test_every_effect_stands_with_its_parameters(hooks: ModuleType) -> None:
    page = hooks.effect_page()
    for effect in ALL:
        part = page[page.index(f"## {effect.name}\n") :].split("\n## ")[0]
        assert effect.equation in part
        assert all(f"`{p.name}`" in part for p in effect.parameters)


def test_every_section_of_a_scenario_and_every_word_stands(hooks: ModuleType) -> None:
    page = hooks.scenario_page()
    assert all(f"`{name}" in page for name in Scenario.model_fields)
    assert all(hooks.cell(word.word) in hooks.word_page() for word in words())


def test_every_column_of_a_run_stands_or_lies_between_two(hooks: ModuleType) -> None:
    for row in (DataRow, TruthRow):
        told = " ".join(names for names, _, _ in hooks._columns(row))
        groups = list(hooks._columns(row))
        assert sum(names.count("` `") + 1 for names, _, _ in groups if "…" not in names) > 5
        assert row.column_names()[0] in told and row.column_names()[-1] in told


def test_every_name_of_the_front_door_is_in_the_reference(hooks: ModuleType) -> None:
    page = hooks.api_page()
    assert all(f".{name}\n" in page for name in testbed.__all__)


def test_a_citation_names_the_version_and_the_paper() -> None:
    citation = yaml.safe_load((ROOT / "CITATION.cff").read_text())
    assert citation["version"] == testbed.__version__
    assert citation["references"][0]["doi"] == "10.1109/TIM.2009.2017650"


@pytest.mark.docs
@pytest.mark.slow
def test_the_site_builds_strictly_and_loads_nothing_from_elsewhere(tmp_path: Path) -> None:
    pytest.importorskip("material")
    pytest.importorskip("mkdocstrings")
    done = subprocess.run(
        [sys.executable, "-m", "mkdocs", "build", "--strict", "--quiet", "--site-dir", tmp_path],
        cwd=ROOT,
        env=os.environ | {"NO_MKDOCS_2_WARNING": "1", "PYTHONPATH": str(ROOT)},
        capture_output=True,
        text=True,
    )
    assert done.returncode == 0, done.stdout + done.stderr
    for page in tmp_path.rglob("*.html"):
        loaded = re.findall(
            r'<(?:script|img|link)[^>]+(?:src|href)="(https?:[^"]+)"', page.read_text()
        )
        assert not [a for a in loaded if not a.startswith("https://squidfunk")], page
    assert "<math" in (tmp_path / "concepts" / "foot_force.html").read_text()
