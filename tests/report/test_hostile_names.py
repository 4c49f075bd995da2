"""No word of a recording, a scenario or a folder becomes markup or script in a page, whatever it
is.
"""

from __future__ import annotations

import json
import re
from collections.abc import Iterator
from html.parser import HTMLParser
from pathlib import Path
from typing import Any

import matplotlib
import numpy as np
import pytest
from matplotlib.figure import Figure
from synthetic_run import write_synthetic_run

import testbed
from testbed.benchmarks.paper.benchmark import Paper
from testbed.benchmarks.paper.experiment import Claim, Experiment, Line, Panel
from testbed.machine.names import LEGS
from testbed.report import loop_page, page
from testbed.report.page import Table
from testbed.report.style import RC, svg
from testbed.workflows.report import write_report

PACKAGE = Path(testbed.__file__).parent
HOSTILE = (
    "<script>alert(1)</script>",
    "</script><xss>",
    "</svg><xss onload=alert(1)>",
    '"><xss onload="alert(1)" id="',
    "' onload='alert(1)",
    "$\\undefined{x}$",
    "{{ 7 * 7 }}",
    "<img src=x onerror=alert(1)>",
)


class Seen(HTMLParser):
    """Tags, attributes and scripts of a page."""

    def __init__(self, text: str) -> None:
        super().__init__()
        self.tags: set[str] = set()
        self.attributes: list[tuple[str, str]] = []
        self.scripts: list[str] = []
        self.feed(text)
        self.close()

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        self.tags.add(tag)
        self.attributes += [(name, value or "") for name, value in attrs]
        if tag == "script":
            self.scripts.append("")

    def handle_data(self, data: str) -> None:
        if self.lasttag == "script" and self.scripts:
            self.scripts[-1] += data


def foreign(text: str) -> list[object]:
    """What of a page is markup or script that is not ours; empty where HOSTILE stayed text."""
    seen = Seen(text)
    tags = {"xss", "iframe", "object", "embed", "link", "base", "form"}
    found: list[object] = [*(seen.tags & tags)]
    for name, value in seen.attributes:
        points = name in ("src", "href", "xlink:href", "action")
        if name.startswith("on") or (points and not value.startswith(("#", "data:image/"))):
            found.append((name, value))
    for script in seen.scripts:
        if script.strip() not in ("", page._script().strip()) and not _is_json(script):
            found.append(script)
    if ("content", page.policy()) not in seen.attributes:
        found.append("no policy")
    return [*found, *re.findall(r">\s*(49)\s*<", text)]  # nothing is a template of its own


def _is_json(text: str) -> bool:
    try:
        return bool(json.loads(text))
    except ValueError:
        return False


@pytest.mark.slow
def test_the_report_of_a_run(tmp_path: Path) -> None:
    word = " ".join(HOSTILE)
    folder = write_synthetic_run(tmp_path / word.replace("/", "\\"), 2.0)
    path = folder / "summary.json"
    summary = json.loads(path.read_text())
    summary |= {"scenario": word, "description": word, "verdict": word}
    summary["events"] = [{"t": 1.0, "kind": word, word: word}]
    summary["undeclared"] = [{"effect": word, "at": word, "parameters": {word: 1.0}}]
    summary["expectations"] = {"met": False, "unmet": [word]}
    path.write_text(json.dumps(summary))
    text = write_report(folder).read_text()
    assert not foreign(text)
    assert not [word for word in HOSTILE if "<" in word and word in text]


@pytest.mark.parametrize("word", HOSTILE)
def test_a_figure_keeps_text_as_text_and_its_ids_as_words(word: str) -> None:
    with matplotlib.rc_context(RC):  # type: ignore[arg-type]
        figure = Figure()
        axes = figure.subplots()
        axes.plot([0, 1], [0, 1], label=word)
        axes.set_title(word)
        axes.set_yticks([0.5], [word])
        axes.legend()
    text, row = svg(figure, word), loop_row("word")
    shown = {
        "figures": dict.fromkeys(("seen", "judged", "bars"), text),
        "plan": loop_page.plan(row),
    }
    contents = {"rows": [row | shown]}
    assert not foreign(page.render("loop.html.j2", contents))
    ids = [value for name, value in Seen(text).attributes if name == "id"]
    assert ids and all(re.fullmatch(r"[\w.-]+", value) for value in ids)


@pytest.mark.parametrize("word", HOSTILE)
def test_the_pages_of_the_diagnosis(word: str) -> None:
    effect = {
        "name": word,
        "place": word,
        "text": word,
        "equation": word,
        "repeated": 0.9,
        "probability": 1.0,
        "ambiguous_with": [word],
        "parameters": {word: {"value": 1.0, "interval90": [0.0, 1.0], "unit": word}},
    }
    shared: dict[str, Any] = {
        "verdict": word,
        "headline": word,
        "not_believed": word,
        "in_the_model": word,
        "effects": [effect],
        "left_out": [{"name": word, "reason": word}],
    }
    rival = {"names": word, "ahead": 1.0, "probability": 0.5, "where": word, "scale": (1.0, 2.0)}
    row = {"quantity": word, "name": word, "unit": word, "values": [word]}
    assert not foreign(
        page.render(
            "diagnosis.html.j2",
            shared
            | {
                "rig": word,
                "kind": word,
                "hypotheses": [{"names": [word], "probability": 1.0}],
                "errors": [row],
                "closed": {"force_n": 0.5},
                "evidence": word,
                "rivals": [rival],
                "stated": 1.0,
                "figures": [(word, word, word)],
                "experiments": [(word, word)],
                "excess": 1.0,
                "goes_with": {word: 0.5},
                "declared": [word],
                "runs": [(word, {"identify": 1.0, "after": 0.5})],
                "refused": [{"name": word, "reason": word}],
                "passed": [word],
            },
        )
    )
    assert not foreign(
        page.render(
            "robot_diagnosis.html.j2",
            shared
            | {
                "name": word,
                "left_out": [{"name": word, "reason": word}],
                "hypotheses": [(word, 1.0)],
                "errors": [(word, word, {"before": word, "refit": word, "after": word})],
                "learnt": 50,
                "rivals": [(word, 1.0)],
                "resembles": word,
                "beyond": word,
                "not_recalled": word,
                "force": word,
                "places": word,
            },
        )
    )


def test_the_page_of_the_loop() -> None:
    assert not foreign(loop_page.page([loop_row(" ".join(HOSTILE))]))


def loop_row(word: str) -> dict[str, Any]:
    """A row of the loop's page in which every word is `word`."""
    course = {"t": [0.0, 1.0], **{leg: [0.0, 1.0] for leg in LEGS}}
    parameters = {word: {"value": 1.0, "unit": word, "interval90": [0.0, 2.0]}}
    effect = {"name": word, "place": word, "probability": 1.0, "parameters": parameters}
    return {
        **dict.fromkeys(("scenario", "next", "hidden", "said"), word),
        **dict.fromkeys(("probability", "before_n", "after_n"), 1.0),
        "truth": [{"name": word, "place": word, "parameters": {word: 1.0}}],
        "effects": [effect | {"ambiguous_with": [word]}],
        "not_believed": word,
        "residual_n": {"before": 1.0},
        "by_leg_n": {stage: dict.fromkeys(LEGS, 1.0) for stage in ("before", "after")},
        "seen": course,
        "courses": {"before": course, "after": course},
    }


@pytest.mark.slow
@pytest.mark.parametrize("word", HOSTILE)
def test_the_page_of_the_paper(word: str) -> None:
    line = np.arange(3.0)
    experiment = Experiment(
        word,
        word,
        word,
        word,
        [Claim(word, word, 2.0, 3.0, 1.0, word)],
        [Panel(word, word, word, [Line(line, line, word)])],
        [Table(word, [word], [[word]])],
        [word],
    )
    assert not foreign(Paper().page([experiment]))


def _templates() -> Iterator[Path]:
    yield from PACKAGE.rglob("*.j2")


def test_no_template_takes_data_as_it_is_and_every_page_has_the_policy() -> None:
    pages = [p for p in _templates() if re.search("<title>|{% extends", p.read_text())]
    assert len(pages) >= 7
    for path in _templates():
        assert not re.search(r"\|\s*safe\b|autoescape", path.read_text()), path
    for path in pages:
        text = path.read_text()
        assert '{% include "head.html.j2" %}' in text or "{% extends" in text, path
        assert "<script" not in text, path


def test_no_code_builds_markup_of_its_own() -> None:
    markup = re.compile(
        r"""["'](?:\\n|\s)*</?(?:td|tr|th|table|p|div|svg|script|html|h[1-6]|li)\b"""
    )
    trusted = {"report/page.py", "report/style.py"}
    for path in PACKAGE.rglob("*.py"):
        text = path.read_text(encoding="utf-8")
        name = path.relative_to(PACKAGE).as_posix()
        if name not in trusted:
            assert not markup.search(text) and "Markup(" not in text, name


def test_a_logarithmic_axis_carries_numbers_and_no_formulas() -> None:
    with matplotlib.rc_context(RC):
        figure = Figure()
        panel = figure.subplots()
        panel.plot([1.0, 1000.0], [0.0, 100.0])
        panel.set_xscale("log")
        panel.set_yscale("symlog", linthresh=1.0)
    text = str(svg(figure, "powers"))
    assert ">1000<" in text and ">100<" in text and "$" not in text
