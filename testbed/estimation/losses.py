"""What a loss of contact is, stated once: for detectors over recordings, for a run's summary and for the benchmark.

A foot has lost its contact while it bears less than LOSS_SHARE of its nominal load, if that lasts LOSS_S or longer; a
shorter gap is the bounce of a blow. A reference is either the true load, which this cuts, or a contact channel.
"""

from __future__ import annotations

from dataclasses import asdict, dataclass
from typing import Any

import numpy as np
import numpy.typing as npt

from testbed.formats.records import SET

Array = npt.NDArray[np.float64]
Flags = npt.NDArray[np.bool_]

LOSS_SHARE = 0.03
"""Of the nominal load; a foot that bears less has lost its contact (E)."""
LOSS_S = 0.020
"""Shorter gaps are none, s (E)."""
DETECTION_WINDOW_S = 0.5
"""A loss is missed when the detector has not called it this long after it began (or by its end), s (E)."""
LONGEST_STEP = 10.0
"""A sample stands for the time until the next one, at most for so many usual steps: no one knows more of a gap."""


def loss_force_n(nominal_load_n: float) -> float:
    """Load below which a foot of this nominal load has lost its contact, N."""
    return LOSS_SHARE * nominal_load_n


def intervals(flags: Flags, time_s: Array, shortest_s: float = 0.0) -> list[tuple[int, int]]:
    """Index ranges [start, end) in which `flags` (n,) holds for at least `shortest_s`."""
    edges = np.flatnonzero(np.diff(np.concatenate([[False], flags, [False]]).astype(np.int8)))
    step = float(np.median(np.diff(time_s))) if len(time_s) > 1 else 0.0
    pairs = zip(edges[::2].tolist(), edges[1::2].tolist(), strict=True)
    return [(a, b) for a, b in pairs if time_s[b - 1] - time_s[a] + step >= shortest_s - 1e-9]


def carrying_from_load(load_n: Array, time_s: Array, nominal_load_n: float) -> Flags:
    """Whether a foot is in contact, (n,), by its true load: everywhere but in its losses."""
    carrying = np.ones(len(load_n), dtype=bool)
    for start, end in intervals(load_n < loss_force_n(nominal_load_n), time_s, LOSS_S):
        carrying[start:end] = False
    return carrying


@dataclass(frozen=True)
class ContactScore:
    """How well a contact state follows a reference; a time is None where there was nothing to time."""

    losses: int
    missed: int
    delay_median_s: float | None
    delay_p95_s: float | None
    missed_s: float
    """For how long the reference is in the air and the contact state says loaded."""
    false_flight_s: float
    """For how long the reference carries and the contact state says lost."""
    touchdown_delay_median_s: float | None

    def as_dict(self) -> dict[str, Any]:
        """For JSON."""
        return asdict(self)


def score_contact(contact: Array, carrying: Flags, time_s: Array) -> ContactScore:
    """A contact state (n,), 1 loaded and 0 lost, against a reference (n,) that says whether the foot carries.

    A delay is 0 where the state was right already at the change. A touchdown is timed after a loss that was found.
    """
    lost = contact < SET
    delays: list[float] = []
    touchdowns: list[float] = []
    spans = intervals(~carrying, time_s, LOSS_S)
    for k, (start, end) in enumerate(spans):
        until = np.searchsorted(time_s[:end], time_s[start] + DETECTION_WINDOW_S, side="right")
        called = _first(lost, start, int(until))
        if called is None:
            continue
        delays.append(float(time_s[called] - time_s[start]))
        next_loss = spans[k + 1][0] if k + 1 < len(spans) else len(contact)
        loaded = _first(~lost, end, next_loss)
        if loaded is not None:
            touchdowns.append(float(time_s[loaded] - time_s[end]))
    steps = _durations_s(time_s)
    return ContactScore(
        losses=len(spans),
        missed=len(spans) - len(delays),
        delay_median_s=float(np.median(delays)) if delays else None,
        delay_p95_s=float(np.quantile(delays, 0.95)) if delays else None,
        missed_s=float(steps[~carrying & ~lost].sum()),
        false_flight_s=float(steps[carrying & lost].sum()),
        touchdown_delay_median_s=float(np.median(touchdowns)) if touchdowns else None,
    )


def _first(flags: Flags, start: int, end: int) -> int | None:
    found = np.flatnonzero(flags[start:end])
    return start + int(found[0]) if found.size else None


def _durations_s(time_s: Array) -> Array:
    """For how long each sample stands, (n,), s."""
    if len(time_s) < 2:
        return np.zeros(len(time_s))
    steps = np.diff(time_s)
    usual = float(np.median(steps))
    return np.append(np.minimum(steps, LONGEST_STEP * usual), usual)
