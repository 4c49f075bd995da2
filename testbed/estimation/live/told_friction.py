"""How much of what the filter does not know of friction an interval tells. Compiled.

The filter of fusion.py lets friction at rest be anywhere in its set. What is true of it depends on
what the piston has been through, and intervals tell that:
- one that has not slid since the start may be stuck anywhere (`stuck`); loads that have gone up and
  down by about the width of its set have led it towards the middle (`led`);
- one that has come to rest keeps the friction it stopped with, which is known (`stopped`), until
  changes of its load have bent the seal this way and that (`loaded`);
- one that has begun to slide still bends its seal and its oil (`begun`); after `begun_s` it has the
  friction of sliding (`sliding`).
Each is a share of the filter's standard deviation. The estimate itself does not depend on them.
"""

from __future__ import annotations

import math
from typing import Any

from testbed.compiled import njit
from testbed.formats.records import Record, quantity


class ToldShares(Record):
    """Of the filter's standard deviation of a load by friction, what an interval tells."""

    sliding = quantity("1", "while the vertical piston slides, once it has done so for long")
    begun = quantity("1", "when it has just begun to")
    begun_s = quantity("s", "over which one becomes the other")
    constants = quantity("1", "of what the machine's constants make, while it slides for long")
    resting = quantity("1", "of the same while it does not slide")
    stopped = quantity("1", "just after it came to rest")
    loaded = quantity("1", "once its force has gone over `loaded_within` since")
    stuck = quantity("1", "while it has not slid since the start")
    led = quantity("1", "once its force has gone over `led_within` since the start")
    loaded_within = quantity("1", "range of its force, over the width of friction's set")
    led_within = quantity("1", "likewise")


class ForceRange(Record):
    """Between which ends a piston's force has gone since it last slid, or since the start."""

    low = quantity("N", "lowest force of the piston, friction included")
    high = quantity("N", "highest")
    started = quantity("1", "1 once there was a force")


@njit
def follow_force(force: float, slides: float, ends: Any) -> None:
    """Take a piston's force (N) into its ForceRange; slides (0 to 1): AxisState. A missing force
    teaches nothing.
    """
    if not math.isfinite(force):
        return
    if slides > 0.0 or ends.started == 0.0:
        ends.low = ends.high = force
        ends.started = 1.0
    ends.low, ends.high = min(ends.low, force), max(ends.high, force)


@njit
def just_begun(axis: Any, shares: Any) -> float:
    """How much a piston (AxisState) that slides has only just begun to, 1 to 0."""
    return math.exp(-axis.slid / shares.begun_s)


@njit
def told_of_constants(axis: Any, shares: Any) -> float:
    """Of the filter's standard deviation of a load by the machine's constants, what an interval
    tells: all of it when the piston (AxisState) has begun to slide, less while it slides on and
    shows them, more while nothing shows them.
    """
    if axis.slides <= 0.0:
        return float(shares.resting)
    return float(1.0 + (shares.constants - 1.0) * (1.0 - just_begun(axis, shares)))


@njit
def told_of_friction(axis: Any, ends: Any, noise_n: float, shares: Any) -> float:
    """Of the filter's standard deviation of a load by the friction of a piston (AxisState), what an
    interval tells; ends: its ForceRange, of which `noise_n` is noise.
    """
    if axis.slides > 0.0:
        begun = just_begun(axis, shares)
        return float(shares.sliding + (shares.begun - shares.sliding) * begun)
    width = max(axis.high - axis.low, 1.0)
    gone = max(ends.high - ends.low - noise_n, 0.0) / width
    if axis.has_slid == 0.0:
        return float(
            shares.stuck + (shares.led - shares.stuck) * min(gone / shares.led_within, 1.0)
        )
    loaded = min(gone / shares.loaded_within, 1.0)
    return float(shares.stopped + (shares.loaded - shares.stopped) * loaded)
