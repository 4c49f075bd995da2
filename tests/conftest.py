"""What is begun once for all tests."""

from __future__ import annotations

from collections.abc import Iterator

import pytest
from hypothesis import settings
from scenario_runs import Job, Runs, made_beside

from testbed.simulation import pictures

settings.register_profile(
    "testbed", deadline=None
)  # the first example loads or compiles its kernels
settings.load_profile("testbed")


@pytest.fixture(scope="session", autouse=True)
def _small_pictures() -> Iterator[None]:
    """Rendering takes most of a short run's time: pictures of runs made in this process have few
    pixels.
    """
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(pictures, "LARGE", (60, 40))
        patch.setattr(pictures, "SMALL", (36, 24))
        yield


@pytest.fixture(scope="session", autouse=True)
def scenario_runs(
    request: pytest.FixtureRequest, tmp_path_factory: pytest.TempPathFactory
) -> Iterator[Runs]:
    """The scenario runs that the tests of this session ask for, begun before the first test."""
    asked = [item.callspec.params for item in request.session.items if hasattr(item, "callspec")]
    jobs: set[Job] = {(p["name"], p["mutated"]) for p in asked if {"name", "mutated"} <= set(p)}
    with made_beside(jobs, tmp_path_factory.mktemp("runs")) as runs:
        yield runs
