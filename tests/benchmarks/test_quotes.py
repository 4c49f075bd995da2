"""What pages quote is what committed results say."""

from __future__ import annotations

import json
import re
from pathlib import Path

import pytest

from testbed.benchmarks.quotes import QUOTES, Quote, read_quotes, refresh
from testbed.errors import InputError

ROOT = Path(__file__).parents[2]
LISTED, WITHOUT_RESULT = read_quotes(ROOT)
PAGE = "Of 10 runs 3.5 % fell.\nOf 8 runs none fell.\n"


@pytest.mark.parametrize("quote", LISTED, ids=lambda quote: quote.text[:40])
def test_a_page_says_what_the_committed_result_says(quote: Quote) -> None:
    assert quote.wanted in quote.page.read_text()


def results_told() -> list[str]:
    """Lines with numbers of the tables of results, in the README and on the page of all results."""
    readme = (ROOT / "README.md").read_text().split("## Results")[1].split("\n## ")[0]
    pages = readme + "\n" + (ROOT / "docs" / "results" / "index.md").read_text()
    rows = re.sub(r"^\|.*\|\n\|[-|]+\|$", "", pages, flags=re.MULTILINE)  # without the heads
    return [line for line in rows.splitlines() if re.match(r"\|.*\d.*\|", line)]


def test_a_result_that_is_told_is_quoted_or_says_why_not() -> None:
    quoted = [quote.wanted for quote in LISTED]
    for line in results_told():
        listed = [begin for begin in WITHOUT_RESULT if line.startswith(f"| {begin}")]
        assert listed or any(text in line for text in quoted), line


def test_what_has_no_result_is_told_and_is_not_quoted() -> None:
    for begin in WITHOUT_RESULT:
        lines = [line for line in results_told() if line.startswith(f"| {begin}")]
        assert lines, begin
        assert not [quote for quote in LISTED for line in lines if quote.wanted in line], begin


def tree(folder: Path, text: str, *numbers: str) -> Path:
    """A page, a result and one quote."""
    (folder / "docs").mkdir()
    (folder / "page.md").write_text(PAGE)
    result = {"runs": 12, "ends": [{"kind": "fell", "share": 0.25}]}
    (folder / "result.json").write_text(json.dumps(result))
    line = {"text": text, "numbers": list(numbers)}
    listed = {"quoted": [{"page": "page.md", "result": "result.json", "lines": [line]}]}
    (folder / QUOTES).write_text(json.dumps(listed))
    return folder


def test_a_page_takes_the_numbers_of_its_result_and_keeps_its_words(tmp_path: Path) -> None:
    root = tree(tmp_path, "Of {} runs {:.1f} % fell.", "runs", "100 * ends/kind=fell/share")
    assert refresh(root) == [root / "page.md"]
    assert (root / "page.md").read_text() == PAGE.replace("10 runs 3.5", "12 runs 25.0")
    assert refresh(root) == []


def test_a_number_that_rounds_to_zero_has_no_sign() -> None:
    quoted = Quote(Path(), "{:.0f}, {:.1f}, {:.1f} of {}", (-0.3, -0.04, -0.06, "-"))
    assert quoted.wanted == "0, 0.0, -0.1 of -"


@pytest.mark.parametrize(
    ("text", "numbers", "told"),
    [
        ("Of {} cases", ["runs"], "stands 0 times"),
        ("Of {} runs", ["runs"], "stands 2 times"),
        ("Of {} runs {} %", ["runs"], "another number of sources"),
        ("Of {} runs none", ["ends/kind=slid/share"], "no such number"),
        ("Of {} runs none", ["falls"], "no such number"),
    ],
)
def test_what_cannot_be_quoted_is_refused_and_nothing_is_written(
    tmp_path: Path, text: str, numbers: list[str], told: str
) -> None:
    root = tree(tmp_path, text, *numbers)
    with pytest.raises(InputError, match=told):
        refresh(root)
    assert (root / "page.md").read_text() == PAGE
