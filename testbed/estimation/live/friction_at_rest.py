"""The likeliest friction of a piston at rest, a value within its set, live.

Three things are known of it beside its bounds:
- It has a memory: right after a stop it is what it was while sliding; creep and leakage let it
  drift towards the middle of the set within about half a second. (Behind load-holding valves the
  oil holds it for longer, yet a drift over 2 s makes the foot loads of a crawl worse: a wrong value
  is then remembered for longer, too.)
- While the valve is shut, the oil shows how far the seal is bent: a load that changes by dF moves
  the piston by dx; the oil responds with k_oil dx = -dFp, k_oil = beta (A_A^2 / V_A + A_B^2 / V_B),
  the seal with k_seal dx. So friction changes by -(k_seal / k_oil) dFp, and the load by more than
  the pressures show. The motion is far below one encoder count.
- While the valve is open, oil flows into a chamber and the pressures change against friction, not
  against the load: friction follows dFp by the share OPEN_SHARE (the rest moves the piston), if the
  valve pushes in that direction. A piston that is about to slide keeps its friction when the
  pressures fall again.
"""

from __future__ import annotations

import numpy as np

from testbed.compiled import njit
from testbed.formats.records import Record, quantity


class RestMemory(Record):
    """What is remembered of one piston's friction."""

    slow = quantity("N", "remembered friction")
    bent = quantity("N", "its quick part: how far the seal is bent by changes of load")
    smooth = quantity("N", "smoothed piston force")
    shut = quantity("1", "share of the last time in which the valve was shut")
    started = quantity("1", "1 once there was a sample")


DRIFT_S = 0.4
"""Within this time friction drifts to the middle of its set (E)."""
BENT_S = 0.05
"""Within this time a bent seal relaxes (E)."""
OPEN_SHARE = 0.8
"""What friction takes of a change of the piston force while the valve is open (E)."""
SMOOTH_S = 0.004
"""Smoothing of the piston force."""
SHUT_S = 0.03
"""Over this time a valve counts as shut."""
SPREAD = 0.4
"""One standard deviation at rest as a share of the set's half width: what drift and vibration leave
of it.
"""


@njit
def step(
    memory: RestMemory,
    piston: float,
    low: float,
    high: float,
    slides: float,
    push: float,
    ratio: float,
    dt: float,
) -> float:
    """The likeliest friction in [low, high], N.

    `piston` = pA A_A - pB A_B, N; `ratio` = k_seal / k_oil; `push`: the way the open valve drives
    the piston, -1 or 1, 0 while it is shut; `dt`: step, s.

    While the piston slides (slides > 0) the set is narrow and only remembered; at rest the three
    rules apply.
    """
    middle = 0.5 * (low + high)
    if not np.isfinite(piston):  # a sample is missing: nothing is learnt from it
        return float(memory.slow + memory.bent) if memory.started != 0.0 else middle
    if memory.started == 0.0:
        memory.slow, memory.smooth = middle, piston
        memory.shut = memory.started = 1.0
    change = (piston - memory.smooth) * min(dt / SMOOTH_S, 1.0)
    memory.smooth += change
    memory.shut += ((1.0 if push == 0.0 else 0.0) - memory.shut) * min(dt / SHUT_S, 1.0)
    if slides > 0.0:
        memory.slow = min(max(memory.slow + memory.bent, low), high)
        memory.bent = 0.0
        return memory.slow
    taken = push * max(push * change, 0.0) if push != 0.0 else change
    drift = (middle - memory.slow) * min(dt / DRIFT_S, 1.0)
    memory.slow += (1.0 - memory.shut) * OPEN_SHARE * taken + drift
    memory.slow = min(max(memory.slow, low), high)
    bend = -ratio * change
    room = max(0.0, 1.0 - memory.bent / high) if bend > 0.0 else max(0.0, 1.0 - memory.bent / low)
    memory.bent += memory.shut * bend * room - memory.bent * min(dt / BENT_S, 1.0)
    return min(max(memory.slow + memory.bent, low), high)
