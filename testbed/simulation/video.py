"""A run as a moving picture: pictures at an even rate, written as .mp4, .gif or .webp."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from testbed.errors import extra
from testbed.formats.files import check_file, whole
from testbed.simulation.pictures import Camera

ENDINGS = (".mp4", ".gif", ".webp")
SIZE = (640, 432)
"""Width and height, pixels; an encoder wants multiples of 16."""
PICTURES_HZ = {".mp4": 10.0, ".gif": 5.0, ".webp": 5.0}
"""Pictures a simulated second: a .gif of more would be too large to send."""
COLOURS = 64


class Video:
    """Takes a picture whenever one is due, and writes the file at the end.

    Raises InputError where the file cannot be made, or where .mp4 lacks its encoder, before any
    work is done.
    """

    def __init__(self, path: str | Path) -> None:
        self.path = check_file(path, ENDINGS, "--video")
        self.rate_hz = PICTURES_HZ[self.path.suffix]
        self._pictures: list[npt.NDArray[np.uint8]] = []
        if self.path.suffix == ".mp4":
            _encoder()

    def take(self, camera: Camera, now_s: float) -> None:
        """A picture, if one is due."""
        if self.due(now_s):
            self.add(camera.picture(*SIZE))

    def due(self, now_s: float) -> bool:
        """Whether the next picture is one of now."""
        return now_s >= len(self._pictures) / self.rate_hz - 1e-9

    def add(self, picture: npt.NDArray[np.uint8]) -> None:
        """The next picture (height, width, 3)."""
        self._pictures.append(np.ascontiguousarray(picture, dtype=np.uint8))

    def write(self) -> None:
        """Write the file, whole or not at all."""
        with whole(self.path) as hidden:
            if self.path.suffix == ".mp4":
                self._write_mp4(hidden)
            else:
                self._write_frames(hidden)

    def _write_mp4(self, path: Path) -> None:
        height, width = self._pictures[0].shape[:2]
        writer = _encoder().write_frames(
            str(path),
            (width, height),
            fps=self.rate_hz,
            macro_block_size=8,
            output_params=["-f", "mp4"],
        )
        writer.send(None)
        for picture in self._pictures:
            writer.send(picture)
        writer.close()

    def _write_frames(self, path: Path) -> None:
        from PIL import Image

        kind = self.path.suffix.removeprefix(".").upper()
        frames = [Image.fromarray(picture) for picture in self._pictures]
        if kind == "GIF":
            frames = [frame.quantize(COLOURS) for frame in frames]
        frames[0].save(
            path,
            kind,
            save_all=True,
            append_images=frames[1:],
            duration=round(1000.0 / self.rate_hz),
            loop=0,
        )


def _encoder() -> Any:
    """The module that encodes .mp4."""
    return extra("imageio_ffmpeg", "video", ", or a name in .gif or .webp", field="--video")
