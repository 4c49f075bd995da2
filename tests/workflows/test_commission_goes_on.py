"""A commissioning that is stopped keeps the stages that are whole, goes on with them, and leaves
nothing else behind.
"""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest

from testbed.errors import InputError
from testbed.formats.files import owned
from testbed.scenario.scenario import Scenario, load_scenario
from testbed.simulation.run import run_scenario
from testbed.workflows import commission as work
from testbed.workflows.commission import commission_any, recorded, stages_of

LEVEL = "format: roboclimber-scenario/1\nname: level\nduration_s: 0.05\nropes: {enabled: false}\n"


@pytest.fixture
def level(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A scenario of a twentieth of a second, whose stage of the ropes is no longer."""

    def on_ropes(first: Scenario) -> Scenario:
        return load_scenario("stand_slope_45", seed=first.seed, duration=0.05)

    monkeypatch.setattr(work, "_on_ropes", on_ropes)
    (tmp_path / "level.yaml").write_text(LEVEL)
    return tmp_path / "level.yaml"


class Stopped:
    """Runs scenarios, and is stopped before the run of this number; counts them by name."""

    def __init__(self, at: int | None = None) -> None:
        self.at, self.made = at, list[str]()

    def __call__(self, scenario: Scenario, folder: Path) -> Any:
        if len(self.made) == self.at:
            raise KeyboardInterrupt
        self.made.append(scenario.name)
        return run_scenario(scenario, folder)


def _made(monkeypatch: pytest.MonkeyPatch, level: Path, place: Path, at: int | None) -> list[str]:
    """Names of the stages that were run until it was stopped."""
    runs = Stopped(at)
    monkeypatch.setattr("testbed.simulation.run.run_scenario", runs)
    try:
        with recorded(str(level), place=place) as folders:
            assert all((folder / "summary.json").is_file() for folder in folders)
    except KeyboardInterrupt:
        assert place.is_dir()
    return runs.made


@pytest.mark.slow
def test_a_stage_that_is_whole_is_not_run_again(
    level: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    place = stages_of(tmp_path / "model.yaml")
    assert _made(monkeypatch, level, place, at=1) == ["level"]
    (place / "0" / "summary.json").rename(tmp_path / "aside.json")  # killed in the midst of it
    assert _made(monkeypatch, level, place, at=1) == ["level"]
    assert _made(monkeypatch, level, place, at=None) == ["stand_slope_45"]
    assert not place.exists()


@pytest.mark.slow
def test_a_stage_of_another_machine_or_seed_is_run_again(
    level: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    place = stages_of(tmp_path / "model.yaml")
    assert _made(monkeypatch, level, place, at=1) == ["level"]
    level.write_text(LEVEL + "seed: 2\n")
    assert _made(monkeypatch, level, place, at=1) == ["level"]


@pytest.mark.slow
def test_recordings_that_cannot_serve_leave_nothing_behind(level: Path, tmp_path: Path) -> None:
    with pytest.raises(InputError):
        commission_any([str(level)], tmp_path / "model.yaml")
    assert [path.name for path in tmp_path.iterdir()] == ["level.yaml"]


def test_two_commissionings_of_one_file_are_refused(level: Path, tmp_path: Path) -> None:
    out = tmp_path / "model.yaml"
    with owned(stages_of(out)), pytest.raises(InputError, match="another testbed process"):
        commission_any([str(level)], out)


def test_a_scenario_that_cannot_serve_is_named_and_not_the_folder_of_its_stage(
    level: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def refused(folders: list[Path], out: Path) -> Any:
        raise InputError("shows no foot in the air", file=folders[0] / "recording.yaml")

    monkeypatch.setattr(work, "commission", refused)
    monkeypatch.setattr(work, "_record", lambda scenario, folder: folder.mkdir())
    with pytest.raises(InputError, match="shows no foot") as told:
        commission_any([str(level)], tmp_path / "model.yaml")
    assert str(told.value.file) == str(level)
    assert not stages_of(tmp_path / "model.yaml").exists()


def test_a_recording_given_twice_or_beside_a_scenario_is_refused_by_its_name(
    tmp_path: Path,
) -> None:
    recording = tmp_path / "recording"
    recording.mkdir()
    (recording / "recording.yaml").touch()
    out = tmp_path / "model.yaml"
    with pytest.raises(InputError, match="recording: is given twice"):
        commission_any([str(recording), f"{recording}/"], out)
    with pytest.raises(InputError, match=r"^commissioning_flat: is no recording"):
        commission_any(["commissioning_flat", str(recording)], out)
