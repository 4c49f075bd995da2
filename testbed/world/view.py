"""What there is to see of the engine's scene: pictures, thin lines that are only looked at, the
rock that the ground is dressed in; and how the engine is kept quiet.
"""

from __future__ import annotations

import contextlib
import ctypes
import os
import sys
import tempfile
from collections.abc import Iterator, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from testbed.formats.arrays import Array

# Keeps what a library prints from C off the console.

_MASTER = os.environ.get("TESTBED_ENGINE_MESSAGES")


@contextlib.contextmanager
def quiet() -> Iterator[None]:
    """Keep the engine's messages off the console while it loads a file (it prints from C)."""
    if _MASTER:
        yield
        return
    flush = ctypes.CDLL(None).fflush
    sys.stdout.flush()
    sys.stderr.flush()
    flush(None)
    saved, null = [os.dup(1), os.dup(2)], os.open(os.devnull, os.O_WRONLY)
    try:
        for stream in (1, 2):
            os.dup2(null, stream)
        yield
    finally:
        flush(None)
        for stream, old in zip((1, 2), saved, strict=True):
            os.dup2(old, stream)
            os.close(old)
        os.close(null)


# Rotations in the engine's form.

NEAR_Y = 0.9
"""An axis that lies as near to y as this cannot be crossed with it."""


def quaternion(rotation: Array) -> Array:
    """Quaternion xyzw of a rotation matrix (3, 3)."""
    r = rotation
    trace = float(np.trace(r))
    squares = np.maximum(np.array([*(1.0 + 2.0 * np.diag(r) - trace), 1.0 + trace]), 0.0)
    k = int(np.argmax(squares))
    products = np.array(
        [
            [squares[0], r[1, 0] + r[0, 1], r[0, 2] + r[2, 0], r[2, 1] - r[1, 2]],
            [r[1, 0] + r[0, 1], squares[1], r[2, 1] + r[1, 2], r[0, 2] - r[2, 0]],
            [r[0, 2] + r[2, 0], r[2, 1] + r[1, 2], squares[2], r[1, 0] - r[0, 1]],
            [r[2, 1] - r[1, 2], r[0, 2] - r[2, 0], r[1, 0] - r[0, 1], squares[3]],
        ]
    )
    return np.asarray(products[k] / np.linalg.norm(products[k]))


def turning_z_to(axis: Array) -> Array:
    """A rotation matrix (3, 3) whose third column is the unit vector `axis` (3)."""
    x = np.cross([0.0, 1.0, 0.0] if abs(axis[1]) < NEAR_Y else [1.0, 0.0, 0.0], axis)
    x /= np.linalg.norm(x)
    return np.column_stack([x, np.cross(axis, x), axis])


def rock_texture(size: int = 256, seed: int = 7) -> NDArray[np.uint8]:
    """A tile (size, size, 3) of weathered rock that repeats without seams."""
    rng = np.random.default_rng(seed)
    k = np.hypot(np.fft.fftfreq(size)[:, None], np.fft.fftfreq(size)[None, :])
    falling = np.where(k > 0, np.maximum(k, 1.0 / size) ** -1.2, 0.0)
    grain = np.fft.ifft2(np.fft.fft2(rng.standard_normal((size, size))) * falling).real
    grain /= grain.std()
    shade = 188.0 + 15.0 * grain + 3.0 * rng.standard_normal((size, size))
    return np.asarray(
        np.clip(shade[:, :, None] * np.array([1.0, 0.95, 0.87]), 0, 255), dtype=np.uint8
    )


def under_sky(picture: NDArray[np.uint8], nothing: NDArray[np.bool_]) -> None:
    """Put a sky into a picture (height, width, 3), in place, where `nothing` (height, width) was
    drawn.
    """
    sky = np.linspace([176.0, 203.0, 230.0], [232.0, 238.0, 243.0], len(picture)).astype(np.uint8)
    picture[nothing] = np.broadcast_to(sky[:, None, :], picture.shape)[nothing]


class View:
    """Pictures of one engine client's scene, `bullet`, with its body of the ground."""

    def __init__(self, bullet: Any, ground: int) -> None:
        self.bullet, self._ground, self._dressed = bullet, ground, False

    def picture(
        self, eye: Sequence[float], target: Sequence[float], width: int, height: int
    ) -> NDArray[np.uint8]:
        """A picture (height, width, 3) of the scene from `eye` towards `target` (world, m)."""
        self._dress_ground()
        view = self.bullet.computeViewMatrix(eye, target, [0, 0, 1])
        projection = self.bullet.computeProjectionMatrixFOV(38.0, width / height, 0.1, 200.0)
        image = self.bullet.getCameraImage(
            width,
            height,
            view,
            projection,
            lightDirection=[-4, -6, 10],
            shadow=0,  # hardly seen on rock, and it costs four times the picture
            renderer=self.bullet.ER_TINY_RENDERER,
        )
        colours = np.asarray(image[2], dtype=np.uint8).reshape(height, width, 4)[:, :, :3].copy()
        under_sky(colours, np.asarray(image[4]).reshape(height, width) < 0)
        return colours

    def _dress_ground(self) -> None:
        """Rock instead of the engine's chequered floor; once, and only where somebody looks."""
        if self._dressed:
            return
        self._dressed = True
        from PIL import Image

        with tempfile.NamedTemporaryFile(suffix=".png") as file, quiet():
            Image.fromarray(rock_texture()).save(file.name)
            texture = self.bullet.loadTexture(file.name)
        self.bullet.changeVisualShape(self._ground, -1, textureUniqueId=texture)
        self.bullet.changeVisualShape(self._ground, -1, rgbaColor=[1, 1, 1, 1])

    def add_line(self, start: Array, end: Array, radius_m: float, colour: Sequence[float]) -> int:
        """A thin cylinder to look at (a rope, a rod); no collision. Returns its id for `remove`."""
        axis = end - start
        length = float(np.linalg.norm(axis))
        shape = self.bullet.createVisualShape(
            self.bullet.GEOM_CYLINDER, radius=radius_m, length=length, rgbaColor=colour
        )
        rotation = turning_z_to(axis / length)
        return int(
            self.bullet.createMultiBody(
                0, -1, shape, ((start + end) / 2).tolist(), quaternion(rotation).tolist()
            )
        )

    def remove(self, body: int) -> None:
        """Take a body out that `add_line` put in."""
        self.bullet.removeBody(body)
