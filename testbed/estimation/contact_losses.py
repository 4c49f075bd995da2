"""What a loss of contact is, stated once: for the benchmark, a run's summary, `testbed detect` and
the detectors.

A foot has lost its contact from the moment it bears less than a share of its nominal load, if it
goes on to do so for a minimum time; it has touched down from the moment it bears that much again,
if it goes on to do so for the same time. What is shorter, either way, is the bounce of a blow and
changes nothing. Unless stated otherwise the share is LOSS_SHARE and the time LOSS_S. A reference is
either the true load, which this cuts, or a contact channel.

How a contact state (lost or loaded, sample by sample) is scored:

    loss found         the state says lost within FOUND_S of the loss, and before it ends
    delay              from the loss to the first sample that says so; 0 where it said so already
    false alarm        the state turns to lost while the foot carries and goes on to carry for
                       EARLY_S or more; a state that stays wrong counts once more every STANDING_S,
                       and so does one that was wrong from the start
    missed seconds     the foot is lost and the state says loaded
    false flight       the foot carries and the state says lost
    touchdown found    a state that said lost says loaded within FOUND_S of the touchdown, and
                       before the next loss
"""

from __future__ import annotations

from dataclasses import asdict, dataclass
from typing import Any

import numpy as np
import numpy.typing as npt

from testbed.formats.arrays import Array, Flags
from testbed.formats.records import SET
from testbed.machine.model import Machine

LOSS_SHARE = 0.03
"""Of the nominal load; a foot that bears less has lost its contact (E)."""
LOSS_S = 0.020
"""Shorter gaps are no losses, and shorter touches no touchdowns, s (E)."""
FOUND_S = 0.5
"""A change that is not called within this time is missed, s (E)."""
EARLY_S = 0.1
"""An alarm no longer than this ahead of a loss is early, not false, s (E)."""
STANDING_S = 5.0
"""A false alarm that stands counts once more after every such time, s (E)."""
LONGEST_STEP = 10.0
"""A sample stands for the time until the next one, at most for so many usual steps: no one knows
more of a gap.
"""


@dataclass(frozen=True)
class LossRule:
    """What counts as a loss: below `share` of the nominal load (N) for `shortest_s` (s); a
    touchdown likewise.
    """

    nominal_load_n: float
    share: float = LOSS_SHARE
    shortest_s: float = LOSS_S

    @property
    def force_n(self) -> float:
        """A foot that bears less has lost its contact, N."""
        return self.share * self.nominal_load_n

    def carrying(self, load_n: Array, time_s: Array) -> Flags:
        """Whether a foot is in contact, (n,), by its true load (n,), N: everywhere but in its
        losses.
        """
        return self.settled(load_n >= self.force_n, time_s)

    def settled(self, carries: Flags, time_s: Array) -> Flags:
        """A contact (n,) without the stretches, of either kind, that are shorter than
        `shortest_s`.
        """
        stretches = [(a, stop, True) for a, stop in intervals(carries, time_s, self.shortest_s)]
        stretches += [(a, stop, False) for a, stop in intervals(~carries, time_s, self.shortest_s)]
        out = np.ones(len(carries), dtype=bool)
        for start, _, state in sorted(stretches):
            out[start:] = state
        return out


def nominal_load_n(machine: Machine) -> float:
    """Load of a standing foot of this machine, N: a quarter of its weight, rounded."""
    return machine.scale.nominal_load_n


def loss_force_n(nominal_load_n: float) -> float:
    """Load below which a foot of this nominal load has lost its contact, where nothing else is
    stated, N.
    """
    return LossRule(nominal_load_n).force_n


def intervals(flags: Flags, time_s: Array, shortest_s: float = 0.0) -> list[tuple[int, int]]:
    """Index ranges [start, end) in which `flags` (n,) holds for at least `shortest_s`."""
    edges = np.flatnonzero(np.diff(np.concatenate([[False], flags, [False]]).astype(np.int8)))
    pairs = zip(edges[::2].tolist(), edges[1::2].tolist(), strict=True)
    if shortest_s <= 0.0:
        return list(pairs)
    step = float(np.median(np.diff(time_s))) if len(time_s) > 1 else 0.0
    return [
        (start, stop)
        for start, stop in pairs
        if time_s[stop - 1] - time_s[start] + step >= shortest_s - 1e-9
    ]


@dataclass(frozen=True)
class Change:
    """A true loss or touchdown: the samples [start, end) that it lasts; `delay_s` until the word
    followed, None: missed.
    """

    start: int
    end: int
    delay_s: float | None


@dataclass(frozen=True)
class Followed:
    """How a contact state follows a reference, change by change and sample by sample."""

    losses: tuple[Change, ...]
    touchdowns: tuple[Change, ...]
    """Of those alone before which the word said lost."""
    false_alarms: tuple[int, ...]
    """Samples at which one was counted."""
    missed: Flags
    """(n,): the foot is lost, the state says loaded."""
    false_flight: Flags
    """(n,): the foot carries, the state says lost."""


def follow(lost: Flags, carrying: Flags, time_s: Array) -> Followed:
    """A word (n,), true where it says lost, against a reference (n,) that says whether the foot
    carries.

    A loss that was on already at the first sample has no beginning, and is none; its seconds count.
    """
    spans = intervals(~carrying, time_s)
    losses = tuple(_called(lost, start, stop, time_s) for start, stop in spans if start > 0)
    ends = [*(start for start, _ in spans[1:]), len(lost)][: len(spans)]
    touchdowns = [
        _called(~lost, end, later, time_s)
        for (_, end), later in zip(spans, ends, strict=True)
        if end < len(lost) and lost[end - 1]
    ]
    starts = np.array([loss.start for loss in losses], dtype=int)
    return Followed(
        losses,
        tuple(touchdowns),
        tuple(_false_alarms(lost, carrying, starts, time_s)),
        ~carrying & ~lost,
        carrying & lost,
    )


def _called(says: Flags, start: int, end: int, time_s: Array) -> Change:
    until = int(np.searchsorted(time_s[:end], time_s[start] + FOUND_S, side="right"))
    found = np.flatnonzero(says[start:until])
    delay = float(time_s[start + found[0]] - time_s[start]) if found.size else None
    return Change(start, end, delay)


def _false_alarms(
    lost: Flags, carrying: Flags, losses: npt.NDArray[Any], time_s: Array
) -> list[int]:
    out = []
    for start, end in intervals(lost, time_s):
        if not carrying[start]:
            continue
        after = losses[losses > start]
        stop = min(end, int(after[0])) if after.size else end
        if after.size and time_s[after[0]] - time_s[start] <= EARLY_S + 1e-9:
            continue
        grace_s = 0.0 if start > 0 else STANDING_S  # before that the detector has not said anything
        again = np.arange(time_s[start] + grace_s, time_s[stop - 1] + 1e-9, STANDING_S)
        out += np.searchsorted(time_s, again).tolist()
    return out


@dataclass(frozen=True)
class ContactScore:
    """How well a contact state follows a reference; a time is None where there was nothing to
    time.
    """

    losses: int
    missed: int
    delay_median_s: float | None
    delay_p95_s: float | None
    missed_s: float
    """For how long the foot is lost and the state says loaded."""
    false_flight_s: float
    """For how long the foot carries and the state says lost."""
    touchdown_delay_median_s: float | None
    touchdowns_missed: int
    false_alarms: int

    def as_dict(self) -> dict[str, Any]:
        """For JSON."""
        return asdict(self)


def score_contact(contact: Array, carrying: Flags, time_s: Array) -> ContactScore:
    """A contact state (n,), 1 loaded and 0 lost, against a reference (n,) that says whether the
    foot carries.
    """
    found = follow(contact < SET, carrying, time_s)
    delays = [loss.delay_s for loss in found.losses if loss.delay_s is not None]
    touchdowns = [
        touchdown.delay_s for touchdown in found.touchdowns if touchdown.delay_s is not None
    ]
    steps = durations_s(time_s)
    return ContactScore(
        losses=len(found.losses),
        missed=len(found.losses) - len(delays),
        delay_median_s=float(np.median(delays)) if delays else None,
        delay_p95_s=float(np.quantile(delays, 0.95)) if delays else None,
        missed_s=float(steps[found.missed].sum()),
        false_flight_s=float(steps[found.false_flight].sum()),
        touchdown_delay_median_s=float(np.median(touchdowns)) if touchdowns else None,
        touchdowns_missed=len(found.touchdowns) - len(touchdowns),
        false_alarms=len(found.false_alarms),
    )


def durations_s(time_s: Array) -> Array:
    """For how long each sample stands, (n,), s."""
    if len(time_s) < 2:
        return np.zeros(len(time_s))
    steps = np.diff(time_s)
    usual = float(np.median(steps))
    return np.append(np.minimum(steps, LONGEST_STEP * usual), usual)
