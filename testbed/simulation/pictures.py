"""Rendered pictures of a run, one file each, so that a report can be made from a folder at any
time; all but the first by a copy of this process on another core.

A copy sees everything as it is now, costs a few milliseconds, and what it leaves are files. Where
the system makes none, or there is one core, the work is done here.
"""

from __future__ import annotations

import os
import signal
import sys
from collections.abc import Callable
from multiprocessing import parent_process
from pathlib import Path
from typing import Protocol

import numpy as np
import numpy.typing as npt

from testbed.errors import InputError
from testbed.formats.files import whole


def can_copy() -> bool:
    """Whether this system copies processes, and has a core for the copy: beside one of several
    workers there is none.
    """
    alone = parent_process() is None
    return alone and sys.platform == "linux" and len(os.sched_getaffinity(0)) > 1


class Beside:
    """One piece of work at a time, in a copy of this process."""

    def __init__(self, copies: bool = True) -> None:
        """copies: False does all work here."""
        self._copies = copies and can_copy()
        self._busy: int | None = None

    def do(self, work: Callable[[], object]) -> None:
        """Begin it once the last is done. After a piece that a copy could not do all work is done
        here, where its errors are seen.
        """
        self._copies = self.wait() and self._copies
        if not self._copies:
            work()
            return
        self._busy = os.fork()
        if self._busy == 0:
            _work_and_end(work)

    def wait(self) -> bool:
        """Wait for the last piece of work; returns whether it was done."""
        busy, self._busy = self._busy, None
        if busy is None:
            return True
        try:
            return os.waitpid(busy, 0)[1] == 0
        except ChildProcessError:  # ended, and this process was started with SIGCHLD ignored
            return True


def _work_and_end(work: Callable[[], object]) -> None:
    """In the copy: the work, and an end that leaves everything that belongs to both alone."""
    failed = 1
    try:
        signal.signal(signal.SIGINT, signal.SIG_IGN)  # Ctrl-C is the run's
        work()
        failed = 0
    finally:
        os._exit(failed)


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
