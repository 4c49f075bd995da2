"""Which share of the filter's standard deviation an interval reports. Compiled.

The filter of fusion.py takes friction at rest to be anywhere in its set. How uncertain it really is
depends on what the piston has been through:
- a piston that has not slid since the start may be stuck anywhere in the set (`stuck`); once its
  load has gone up and down by about the width of the set, friction is nearer to the middle (`led`);
- a piston that has come to rest keeps the friction it stopped with, which is known (`stopped`),
  until changes of its load have bent the seal back and forth (`loaded`);
- a piston that has just begun to slide still deforms its seal and compresses its oil (`begun`);
  after `begun_s` it has the friction of sliding (`sliding`).
Each is a share of the filter's standard deviation. The estimate itself does not depend on them.
"""

from __future__ import annotations

import math

from testbed.compiled import njit
from testbed.estimation.live.axis import AxisState
from testbed.formats.records import Record, quantity


class ReportedShares(Record):
    """Shares of the filter's standard deviation of a load that an interval reports: of the part
    that friction makes, where it does not say otherwise.
    """

    sliding = quantity("1", "while the vertical piston slides, once it has done so for long")
    begun = quantity("1", "when it has just begun to")
    begun_s = quantity("s", "over which one becomes the other")
    constants = quantity("1", "of what the machine's constants make, while it slides for long")
    resting = quantity("1", "the same while it does not slide")
    stopped = quantity("1", "just after it came to rest")
    loaded = quantity("1", "once its force has gone over `loaded_within` since")
    stuck = quantity("1", "while it has not slid since the start")
    led = quantity("1", "once its force has gone over `led_within` since the start")
    loaded_within = quantity("1", "range of its force, over the width of friction's set")
    led_within = quantity("1", "likewise")


class ForceRange(Record):
    """Range of a piston's force since it last slid, or since the start."""

    low = quantity("N", "lowest force of the piston, friction included")
    high = quantity("N", "highest")
    started = quantity("1", "1 once there was a force")


@njit
def follow_force(force: float, slides: float, ends: ForceRange) -> None:
    """Extend a piston's ForceRange by its force (N), or begin it anew while it slides. A missing
    force changes nothing. slides: how surely it slides, 0 to 1.
    """
    if not math.isfinite(force):
        return
    if slides > 0.0 or ends.started == 0.0:
        ends.low = ends.high = force
        ends.started = 1.0
    ends.low, ends.high = min(ends.low, force), max(ends.high, force)


@njit
def just_begun(axis: AxisState, shares: ReportedShares) -> float:
    """1 for a piston that begins to slide now, falling to 0 as it slides on."""
    return math.exp(-axis.slid / shares.begun_s)


@njit
def share_of_constants(axis: AxisState, shares: ReportedShares) -> float:
    """Reported share of the standard deviation that the machine's constants make: all of it when
    the piston has just begun to slide, less while it slides on and reveals them, more at rest,
    where nothing reveals them.
    """
    if axis.slides <= 0.0:
        return shares.resting
    return 1.0 + (shares.constants - 1.0) * (1.0 - just_begun(axis, shares))


@njit
def share_of_friction(
    axis: AxisState, ends: ForceRange, noise_n: float, shares: ReportedShares
) -> float:
    """Reported share of the standard deviation that the friction of a piston makes; ends: the range
    of its force, of which `noise_n` is noise.
    """
    if axis.slides > 0.0:
        begun = just_begun(axis, shares)
        return shares.sliding + (shares.begun - shares.sliding) * begun
    width = max(axis.high - axis.low, 1.0)
    gone = max(ends.high - ends.low - noise_n, 0.0) / width
    if axis.has_slid == 0.0:
        return shares.stuck + (shares.led - shares.stuck) * min(gone / shares.led_within, 1.0)
    loaded = min(gone / shares.loaded_within, 1.0)
    return shares.stopped + (shares.loaded - shares.stopped) * loaded
