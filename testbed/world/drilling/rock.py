"""What the ground looks like in pictures."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray


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
