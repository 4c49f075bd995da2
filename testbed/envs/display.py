"""Whether a window can be shown."""

from __future__ import annotations

import os
import sys

import gymnasium


def has_display() -> bool:
    """Whether a window can open; without one the engine's would end the process, so the run goes on
    unseen.
    """
    if not sys.platform.startswith("linux") or os.environ.get("DISPLAY"):
        return True
    gymnasium.logger.warn("no display: render_mode 'human' runs without a window")
    return False
