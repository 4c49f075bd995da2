"""The page of security lists every reader that there is, and each with a test that there is."""

from __future__ import annotations

import re
from pathlib import Path

import testbed

PACKAGE = Path(testbed.__file__).parent
ROOT = Path(__file__).parents[2]
PAGE = (ROOT / "docs" / "security.md").read_text()
READING = re.compile(
    r"np\.load\(|yaml\.(?:load|parse|compose|CSafeLoader|SafeLoader)|json\.loads?\(|read_csv\(|"
    r"pq\.read_|\.parse\(path|make_reader\(|rasterio\.open|torch\.load\("
)
OWN_FILES = {
    "simulation/sweep.py": "the summaries of a sweep's own runs",
    "workflows/loop.py": "the results of its own earlier start",
    "workflows/diagnose.py": "a scenario that it has just spelt",
}
"""Files that read only what they wrote themselves."""


def test_every_file_and_every_test_that_the_page_names_is_there() -> None:
    named = re.findall(r"`([\w/]+(?:\.py|/))`", PAGE)
    assert len(named) > 12
    for name in named:
        assert (PACKAGE / name).exists() or (ROOT / name).exists(), name


def test_every_file_that_reads_a_format_is_on_the_page() -> None:
    told = re.findall(r"`([\w/]+(?:\.py|/))`", PAGE)
    readers = {
        path.relative_to(PACKAGE).as_posix()
        for path in PACKAGE.rglob("*.py")
        if path.relative_to(PACKAGE).parts[0] != "benchmarks"  # they read their own results
        and READING.search(path.read_text())
    }
    missing = {r for r in readers if not any(r.startswith(name) for name in told)}
    assert missing - set(OWN_FILES) == set()
    assert set(OWN_FILES) <= readers
