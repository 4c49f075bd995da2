"""Pages on a phone: cards have no first row, so each of their cells says its own head."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

import testbed

ROOT = Path(testbed.__file__).parent
TEMPLATES = {
    path.relative_to(ROOT).as_posix(): path.read_text(encoding="utf-8")
    for path in sorted(ROOT.rglob("*.html.j2"))
}
CARDS = re.compile(r'<table class="cards">(.*?)</table>', re.DOTALL)


def test_the_widest_tables_are_cards() -> None:
    wide = ("report/commission.html.j2", "report/loop.html.j2", "report/diagnosis.html.j2")
    wide += ("report/robot_diagnosis.html.j2", "benchmarks/contact_loss/page.html.j2")
    assert all(CARDS.search(TEMPLATES[name]) for name in wide)


@pytest.mark.parametrize("name", [name for name in TEMPLATES if CARDS.search(TEMPLATES[name])])
def test_every_cell_of_a_card_but_its_title_says_its_head(name: str) -> None:
    for table in CARDS.findall(TEMPLATES[name]):
        _, *rows = re.split(r"<tr[^>]*>", table)[1:]
        assert rows
        for row in rows:
            _, *cells = re.findall(r"<td[^>]*>", row.replace("{{ '", "").replace("' }}", ""))
            assert cells and all("data-head=" in cell for cell in cells), row


def test_a_table_of_many_columns_becomes_cards_and_one_of_few_stays_a_table() -> None:
    from jinja2 import Environment, FileSystemLoader

    macros = Environment(loader=FileSystemLoader(ROOT / "report"), autoescape=True)
    module = macros.get_template("macros.html.j2").module
    for macro in (module.table, module.plain_table):  # type: ignore[attr-defined]
        many = str(macro({"heads": list("abcdef"), "rows": [list("123456")]}))
        assert 'class="cards"' in many
        heads = dict(re.findall(r'data-head="(\w)"[^>]*>(\d)', many))
        assert heads | {"a": "1"} == dict(zip("abcdef", "123456", strict=True))
        assert 'class="cards"' not in str(macro({"heads": list("abc"), "rows": [list("123")]}))
