"""What the benchmarks' tests share."""

from __future__ import annotations

from collections.abc import Iterator

import pytest


@pytest.fixture(scope="session", autouse=True)
def _sources_unread() -> Iterator[None]:
    """Reading all sources takes every process seconds; the tests of marks alone do it."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr("testbed.benchmarks.harness.sources", lambda *_: "the sources")
        yield
