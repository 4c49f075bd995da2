"""Rendered pictures of a run, one file each, so that a report can be made from a folder at any
time; by a copy of this process beside the run where there is a core for it.
"""

from __future__ import annotations

from pathlib import Path
from typing import Any, Protocol

import numpy as np
import numpy.typing as npt

from testbed.errors import InputError
from testbed.formats.files import whole
from testbed.simulation.copies import Copy, can_copy

LARGE = (840, 560)
SMALL = (360, 240)


class Camera(Protocol):
    """What takes a picture: (width, height) in pixels -> RGB, shape (height, width, 3), uint8."""

    def picture(self, width: int, height: int) -> npt.NDArray[np.uint8]:
        """A picture of so many pixels."""
        ...


class Model(Camera, Protocol):
    """A camera with what stands before it, which a copy can put as it stood here."""

    def seen(self) -> Any:
        """All that there is to see now."""
        ...

    def show(self, seen: Any) -> None:
        """Put it as it was then; only pictures come after that."""
        ...


class Album:
    """Pictures under `<run>/pictures/<time>-<large|small>.png`: small ones at even times, a large
    one at the end.
    """

    def __init__(
        self, folder: Path, model: Model, duration_s: float, count: int = 16, copies: bool = True
    ) -> None:
        """copies: False takes all pictures here, as a camera with a window needs it."""
        self.folder = folder / "pictures"
        self._model = model
        self._step_s = duration_s / count
        self._next_s = 0.0
        self._copy = Copy(self._take_there) if copies and can_copy() else None

    def take(self, now_s: float) -> None:
        """A small picture, if one is due."""
        if now_s >= self._next_s:
            self._take(now_s, "small", SMALL)
            self._next_s = now_s + self._step_s - 1e-9

    def take_large(self, now_s: float) -> None:
        """A large picture, now."""
        self._take(now_s, "large", LARGE)

    def finish(self) -> None:
        """Wait for the last picture. Raises InputError where one could not be written."""
        if self._copy is None:
            return
        try:
            self._copy.results()
        except ChildProcessError as error:
            raise InputError(f"cannot be written: {error}", file=self.folder) from error
        finally:
            self._copy.close()
            self._copy = None

    def _take(self, now_s: float, kind: str, size: tuple[int, int]) -> None:
        path = self.folder / f"{now_s:09.3f}-{kind}.png"
        if self._copy is None:
            self._write(path, size)
        else:
            self._copy.begin((self._model.seen(), path, size))

    def _take_there(self, piece: tuple[Any, Path, tuple[int, int]]) -> None:
        """In the copy: of what was seen."""
        seen, path, size = piece
        self._model.show(seen)
        self._write(path, size)

    def _write(self, path: Path, size: tuple[int, int]) -> None:
        from PIL import Image

        picture = np.ascontiguousarray(self._model.picture(*size), dtype=np.uint8)
        path.parent.mkdir(exist_ok=True)
        with whole(path) as hidden:
            Image.fromarray(picture).save(hidden, "PNG", compress_level=4)


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
