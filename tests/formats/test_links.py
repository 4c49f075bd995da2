"""A folder of unknown origin is read by itself: a link that leads out of it is refused by every
reader of folders.
"""

from __future__ import annotations

import shutil
from collections.abc import Callable
from pathlib import Path

import pytest
from synthetic_run import write_synthetic_run

from testbed.errors import InputError
from testbed.formats.files import check_links
from testbed.machine.folder import machine_folder
from testbed.recording.axis import read_recording
from testbed.recording.checker.check import check_recording
from testbed.recording.foot import read_foot
from testbed.recording.robot import read_robot
from testbed.simulation.runs import read_run
from testbed.workflows.estimate import header_of
from testbed.workflows.machines import check_machine


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    made = tmp_path / "given"
    (made / "inner").mkdir(parents=True)
    (made / "own.txt").write_text("mine")
    (tmp_path / "secret.txt").write_text("not theirs")
    return made


def test_links_within_a_folder_are_followed(folder: Path) -> None:
    (folder / "inner" / "link").symlink_to(folder / "own.txt")
    (folder / "other").symlink_to("inner")
    assert check_links(folder) == folder


@pytest.mark.parametrize(
    "target", ["../../secret.txt", "/etc/passwd", "../..", "../no/../../x", "round"]
)
def test_links_out_of_it_and_in_circles_are_refused(folder: Path, target: str) -> None:
    (folder / "inner" / "round").symlink_to(target)
    with pytest.raises(InputError, match="inner/round: is a link to a place outside its folder"):
        check_links(folder)


def test_a_folder_that_is_itself_a_link_is_read(folder: Path, tmp_path: Path) -> None:
    (tmp_path / "given2").symlink_to(folder)
    assert check_links(tmp_path / "given2")
    (folder / "out").symlink_to("../secret.txt")
    with pytest.raises(InputError, match="given2/out: is a link"):
        check_links(tmp_path / "given2")


READERS: list[Callable[[Path], object]] = [
    *(read_run, read_robot, read_recording, read_foot, header_of)
]


@pytest.mark.parametrize("read", READERS, ids=lambda reader: reader.__name__)
@pytest.mark.parametrize("name", ["data.parquet", "recording.yaml", "scenario.yaml"])
def test_no_reader_of_recordings_follows_one(
    tmp_path: Path, read: Callable[[Path], object], name: str
) -> None:
    run = write_synthetic_run(tmp_path / "run", 0.2)
    aside = tmp_path / "aside"
    if (run / name).exists():
        shutil.move(run / name, aside)
    else:
        aside.write_text("a: 1")
    (run / name).symlink_to(aside)
    with pytest.raises(InputError, match=f"{name}: is a link to a place outside"):
        read(run)
    found = check_recording(run)
    assert not found.usable and "is a link" in str(found.findings[0])


def test_no_reader_of_machines_follows_one(tmp_path: Path) -> None:
    made = Path(shutil.copytree(machine_folder("quarter_model"), tmp_path / "mine"))
    shutil.move(made / "robot.urdf", tmp_path / "aside.urdf")
    (made / "robot.urdf").symlink_to("../aside.urdf")
    with pytest.raises(InputError, match=r"robot\.urdf: is a link to a place outside"):
        check_machine(str(made))
