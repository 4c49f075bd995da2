"""A run is filmed at an even rate in simulated time, into what its name says, or refused before it
begins.
"""

from __future__ import annotations

import sys
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

from testbed.errors import InputError
from testbed.simulation.video import SIZE, Video


class Camera:
    """Every picture is brighter than the last."""

    taken = 0

    def picture(self, width: int, height: int) -> np.ndarray:
        self.taken += 1
        return np.full((height, width, 3), 20 * self.taken, dtype=np.uint8)


@pytest.mark.parametrize("ending", [".gif", ".webp"])
def test_pictures_are_taken_five_times_a_simulated_second(tmp_path: Path, ending: str) -> None:
    video, camera = Video(tmp_path / f"run{ending}"), Camera()
    for k in range(101):
        video.take(camera, 0.01 * k)
    video.write()
    with Image.open(tmp_path / f"run{ending}") as film:
        assert camera.taken == film.n_frames == 6 and film.size == SIZE


def test_an_mp4_is_one(tmp_path: Path) -> None:
    pytest.importorskip("imageio_ffmpeg")
    video, camera = Video(tmp_path / "run.mp4"), Camera()
    for k in range(11):
        video.take(camera, 0.1 * k)
    video.write()
    assert (tmp_path / "run.mp4").read_bytes()[4:8] == b"ftyp"
    assert [p.name for p in tmp_path.iterdir()] == ["run.mp4"]


@pytest.mark.parametrize("name", ["run.avi", "run", "none/run.gif"])
def test_what_cannot_be_written_is_refused_at_once(tmp_path: Path, name: str) -> None:
    with pytest.raises(InputError, match="--video"):
        Video(tmp_path / name)


def test_without_its_encoder_an_mp4_is_refused_and_the_others_are_named(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setitem(sys.modules, "imageio_ffmpeg", None)
    with pytest.raises(InputError, match=r"extra `video`.*\.gif or \.webp"):
        Video(tmp_path / "run.mp4")
