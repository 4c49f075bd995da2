"""Where an answer may go: beside anything but in the place of a recording's own files."""

from __future__ import annotations

from pathlib import Path

import pytest

from testbed.errors import InputError
from testbed.workflows.own_files import check_answer

HEADER = "format: roboclimber-recording/1\ndata: data.csv\n"


def test_an_answer_goes_beside_folders_with_links_that_lead_elsewhere(tmp_path: Path) -> None:
    (tmp_path / "project").mkdir()
    (tmp_path / "project" / ".venv").symlink_to("/")
    assert check_answer(tmp_path / "model.yaml") == tmp_path / "model.yaml"


def test_a_recording_with_such_a_link_is_refused(tmp_path: Path) -> None:
    (tmp_path / "recording.yaml").write_text(HEADER)
    (tmp_path / "data.csv").symlink_to("/etc/hostname")
    with pytest.raises(InputError, match="outside its folder"):
        check_answer(tmp_path / "model.yaml")


@pytest.mark.parametrize("name", ["recording.yaml", "data.csv", "truth.parquet"])
def test_no_answer_takes_the_place_of_a_recording(name: str, tmp_path: Path) -> None:
    (tmp_path / "recording.yaml").write_text(HEADER)
    with pytest.raises(InputError, match="is the recording itself"):
        check_answer(tmp_path / name)
