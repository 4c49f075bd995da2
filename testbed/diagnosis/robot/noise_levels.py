"""How noisy a recording is by itself: machines differ in how evenly they slide, and motions in how
they shake.

The noise of each group of balances (forces.py, oil.py ...) is that of a rough machine. What the
likeliest hypothesis leaves of a recording, divided by that noise, says by how much this one is
quieter or louder, and when. What lasts, and what a workshop's tolerances leave, stays as it is: one
recording cannot show it to be smaller. A bin of the forces that leaves far more than those about it
counts by as much less, unless a strong effect explains it.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

import numpy as np
import numpy.typing as npt

from testbed.diagnosis.robot.courses import with_likeliest_courses
from testbed.diagnosis.robot.evidence import RawGroup
from testbed.diagnosis.robot.groups import FORCES, LINE, Balances, balances_of
from testbed.diagnosis.robot.hypotheses import Hypothesis, Ledger
from testbed.diagnosis.robot.unexplained import is_unexplained
from testbed.robot.robot import Robot

Array = npt.NDArray[np.float64]
WINDOWS_S = {FORCES: 1.0, "supply": 1.0, "oil": 0.5}
"""Groups whose noise is taken over so long to either side: a walk shakes at touchdown, a valve's
flow is known worst where it switches.
"""
ROUGH_ROWS, WHOLE_ROWS = 40.0, 10.0
"""A rough machine's noise is believed as if it had been seen in so many rows, and the whole
recording's as if in so many of a window (E).
"""
STRONG, TIMES = 40.0, 2
"""Ln of the evidence from which an effect's forces are believed while the rest is looked at, and
how often at most they are found anew (E).
"""
LEAST, MOST = 0.3, 10.0
"""Variance by that of a rough machine."""
OUTLYING = 1.5
"""A bin of the forces that leaves more than so much of the variance about it is weighed by what it
leaves: where seals turn round or a foot slips, a tenth of a second misses what no noise that lasts
explains, and may have an effect's shape (B: chosen on eight sound machines and effects; over 272
runs it takes 40 to 80 % of their evidence from three of the four sound ones that had most of it in
forces, and 6 % or less from nine in ten of 82 effects).
"""


def balances_at_level(
    data: Mapping[str, Array],
    robot: Robot,
    ropes_in_world: Array,
    granted: Mapping[str, Mapping[str, float]],
    sound: Mapping[str, RawGroup] | None = None,
) -> Balances:
    """`groups.balances_of`, divided by the noise that the recording itself shows.

    What bends the forces much is looked at where it leaves them: friction by side load, which is
    made of foot forces, would else seem wrong at its neighbours.
    """
    found = with_likeliest_courses(balances_of(data, robot, ropes_in_world, granted, sound))
    for _ in range(TIMES):
        best = strongest(found)
        forces = forces_of(found, best)
        if best.log_factor < STRONG or not forces:
            break
        again = with_likeliest_courses(
            balances_of(data, robot, ropes_in_world, granted, sound, forces)
        )
        if left_of_forces(again, strongest(again)) >= left_of_forces(found, best):
            break
        found = again
    return levelled(found)


def rehearsed_balances(data: Mapping[str, Array], robot: Robot, ropes_in_world: Array) -> Balances:
    """`groups.balances_of` of a motion of the machine as it is believed, in which nothing is
    hidden, divided by its noise.
    """
    found = balances_of(data, robot, ropes_in_world, {})
    nothing = Ledger(found).hypothesis(())
    return with_likeliest_courses(_levelled_by(found, nothing, nothing))


def strongest(balances: Balances) -> Hypothesis:
    """The single named effect that explains most."""
    ledger = Ledger(balances)
    singles = (ledger.hypothesis((n,)) for n in ledger.names if not is_unexplained(n))
    return max(singles, key=lambda h: h.log_factor)


def forces_of(balances: Balances, one: Hypothesis) -> dict[int, Array]:
    """Cylinder -> (n,) N by which its believed force is too large by a hypothesis of one effect."""
    changes = balances.candidates[one.names[0]].signature.values()
    out: dict[int, Array] = {}
    for change, number in zip(changes, one.mean.tolist(), strict=True):
        for axis, force in change.force.items():
            out[axis] = out.get(axis, 0.0) + number * force
    return out


def left_of_forces(balances: Balances, one: Hypothesis) -> float:
    """Sum of squares of what a hypothesis leaves of the forces, divided by their noise."""
    left = left_by(balances, one)[FORCES]
    return float(left @ left)


def levelled(balances: Balances) -> Balances:
    """The balances divided by the noise that the recording itself shows."""
    ledger = Ledger(balances)
    best = max(ledger.best(), key=lambda h: h.log_factor)
    believed = best if best.log_factor >= STRONG else ledger.hypothesis(())
    return with_likeliest_courses(_levelled_by(balances, best, believed))


def _levelled_by(balances: Balances, best: Hypothesis, believed: Hypothesis) -> Balances:
    """The balances divided by the noise that `best` leaves; bins of the forces that lie apart by
    what `believed` leaves of them.
    """
    left = left_by(balances, best)
    level = {key: level_of(key, group, left[key]) for key, group in balances.raw.items()}
    beside = left_by(balances, believed)[FORCES] / np.sqrt(level[FORCES])
    level[FORCES] *= outlying(balances.raw[FORCES].time_s, beside)
    raw = {key: group.levelled(level[key]) for key, group in balances.raw.items()}
    groups = {
        key: group.whitened(
            {name: balances.candidates[name].signature for name in balances.groups[key].columns}
        )
        for key, group in raw.items()
    }
    return replace(balances, raw=raw, groups=groups)


def left_by(balances: Balances, hypothesis: Hypothesis) -> Mapping[str, Array]:
    """Group -> what a hypothesis leaves of its rows, divided by their noise."""
    out = {}
    for key, group in balances.groups.items():
        rest, first = group.missing.copy(), 0
        for name in hypothesis.names:
            size = len(balances.candidates[name].signature)
            if name in group.columns:
                rest -= group.columns[name] @ hypothesis.mean[first : first + size]
            first += size
        out[key] = rest
    return out


def level_of(key: str, group: RawGroup, left: Array) -> Array:
    """(rows,) variance of a group's noise by that of a rough machine."""
    if key.startswith(LINE):
        return np.ones(len(left))
    unknown = sum(len(np.unique(labels)) for labels in group.unknown)
    rows = max(len(left) - unknown, 0)
    whole = float(ROUGH_ROWS + left @ left) / (ROUGH_ROWS + rows)
    window_s = WINDOWS_S.get(key.split(" ")[0])
    if window_s is None:
        return np.full(len(left), np.clip(whole, LEAST, MOST))
    order = np.argsort(group.time_s, kind="stable")
    time, sums = group.time_s[order], np.concatenate([[0.0], np.cumsum(left[order] ** 2)])
    first = np.searchsorted(time, group.time_s - window_s)
    last = np.searchsorted(time, group.time_s + window_s)
    found = (WHOLE_ROWS * whole + sums[last] - sums[first]) / (WHOLE_ROWS + last - first)
    return np.asarray(np.clip(found, LEAST, MOST))


def outlying(time_s: Array, left: Array) -> Array:
    """(rows,) by how much the variance of a bin is larger than that of its second; 1 but where it
    is more than OUTLYING times as large. `left` (rows,): what is left, divided by that noise.
    """
    at = np.unique(time_s, return_inverse=True)[1]
    variance = np.bincount(at, left**2) / np.bincount(at)
    return np.asarray(np.maximum(variance / OUTLYING, 1.0)[at])
