"""Rendered pictures of a run, one file each, so that a report can be made from a folder at any
time.
"""

from __future__ import annotations

from pathlib import Path
from typing import Protocol

import numpy as np
import numpy.typing as npt

from testbed.errors import InputError
from testbed.formats.files import whole
from testbed.simulation.beside import Beside

LARGE = (840, 560)
SMALL = (360, 240)


class Camera(Protocol):
    """What takes a picture: (width, height) in pixels -> RGB, shape (height, width, 3), uint8."""

    def picture(self, width: int, height: int) -> npt.NDArray[np.uint8]:
        """A picture of so many pixels."""
        ...


class Album:
    """Pictures under `<run>/pictures/<time>-<large|small>.png`: small ones at even times, a large
    one at the end.

    The first is taken here, for the camera's sake, which furnishes its scene then; the others by
    copies of this process, beside the run.
    """

    def __init__(
        self, folder: Path, duration_s: float, count: int = 16, copies: bool = True
    ) -> None:
        """copies: False takes all pictures here, as a camera with a window needs it."""
        self.folder = folder / "pictures"
        self._step_s = duration_s / count
        self._next_s = 0.0
        self._first = True
        self._beside = Beside(copies)

    def take(self, camera: Camera, now_s: float) -> None:
        """A small picture, if one is due."""
        if now_s >= self._next_s:
            self._save(camera, now_s, "small", SMALL)
            self._next_s = now_s + self._step_s - 1e-9

    def take_large(self, camera: Camera, now_s: float) -> None:
        """A large picture, now."""
        self._save(camera, now_s, "large", LARGE)

    def finish(self) -> None:
        """Wait for the last picture. Raises InputError where it could not be written."""
        if not self._beside.wait():
            raise InputError("cannot be written", file=self.folder)

    def _save(self, camera: Camera, now_s: float, kind: str, size: tuple[int, int]) -> None:
        path = self.folder / f"{now_s:09.3f}-{kind}.png"
        if self._first:
            self._first = False
            self.folder.mkdir(exist_ok=True)
            self._write(camera, path, size)
        else:
            self._beside.do(lambda: self._write(camera, path, size))

    def _write(self, camera: Camera, path: Path, size: tuple[int, int]) -> None:
        from PIL import Image

        picture = Image.fromarray(np.ascontiguousarray(camera.picture(*size), dtype=np.uint8))
        with whole(path) as hidden:
            picture.save(hidden, "PNG", compress_level=4)


def pictures(folder: Path, kind: str) -> list[tuple[float, Path]]:
    """(time in s, file) of a run's `large` or `small` pictures, in order of time."""
    files = (
        sorted((folder / "pictures").glob(f"*-{kind}.png"))
        if (folder / "pictures").is_dir()
        else []
    )
    return [
        (float(file.name.partition("-")[0]), file)
        for file in files
        if not file.name.startswith(".")
    ]
