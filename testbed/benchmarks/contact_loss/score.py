"""A detector's scores against the truth: losses with the delay at every threshold, quiet time with what would alarm.

A loss begins where a foot's true normal force falls below 300 N and stays there for 20 ms although the foot is meant
to carry; a foot must have carried for 0.5 s before, so that the bounces of one loss are one loss. Its record is the
running maximum of the score from the crossing on: the delay at a threshold is where that staircase first reaches it.

Quiet time is cut into windows of 5 s, without 0.5 s before and 1 s after any stretch below 300 N; a window's record is
the score's maximum. A window counts as one false alarm at every threshold up to it, so that an alarm which never ends
counts once in 5 s. A window is known by the lowest true load in it: below 600 N it is a near loss, neither quiet nor
lost; below twice the break-away force sticking may hide as much as is there; the targets are for windows above.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray

from testbed.estimation.losses import LOSS_S, loss_force_n
from testbed.machine.scale import ROBOCLIMBER_NOMINAL_N

Array = NDArray[np.float64]
Flags = NDArray[np.bool_]

LOSS_N = loss_force_n(ROBOCLIMBER_NOMINAL_N)
CARRIED_S = 0.5
LONGEST_DELAY_S, SHORTEST_LOOK_S = 0.5, 0.1
WINDOW_S, BEFORE_S, AFTER_S, SHORTEST_WINDOW_S = 5.0, 0.5, 1.0, 1.0
NEAR_N = 600.0
LOADED_N, LOADED_BEFORE_S = 1600.0, 5.0
"""Twice the believed break-away force, 2 (620 + 180) N; what a foot bore is looked for in the last 5 s."""
GRADUAL_S = 0.1
"""A loss is gradual if its load took this long from 20 % of what it was to the crossing of 300 N."""
SHARE = 0.2


@dataclass(frozen=True)
class Loss:
    """One true loss: foot, crossing and end (s), load before (N), how long it had been below 20 % of that (s)."""

    foot: int
    start_s: float
    end_s: float
    load_before_n: float
    below_share_s: float

    @property
    def loaded(self) -> bool:
        """Whether sticking could not hide it."""
        return self.load_before_n >= LOADED_N

    @property
    def gradual(self) -> bool:
        """Whether there was time to warn."""
        return self.loaded and self.below_share_s >= GRADUAL_S


@dataclass
class Scored:
    """One scene's records; `stairs[detector][loss]` = [[delay s, score], ..], `windows[detector]` as `window_feet`."""

    losses: list[Loss]
    stairs: dict[str, list[list[list[float]]]] = field(default_factory=dict)
    window_low_n: list[float] = field(default_factory=list)
    window_s: list[float] = field(default_factory=list)
    windows: dict[str, list[float]] = field(default_factory=dict)

    def as_dict(self) -> dict[str, Any]:
        """For a scene's JSON file."""
        return {
            "losses": [vars(loss) for loss in self.losses],
            "stairs": self.stairs,
            "window_low_n": self.window_low_n,
            "window_s": self.window_s,
            "windows": self.windows,
        }


def stretches(flags: Flags) -> list[tuple[int, int]]:
    """Index ranges [start, end) in which `flags` (n,) holds."""
    edges = np.flatnonzero(np.diff(np.concatenate([[False], flags, [False]]).astype(np.int8)))
    return list(zip(edges[::2].tolist(), edges[1::2].tolist(), strict=True))


def find_losses(normal_n: Array, carrying: Flags, dt_s: float, settle_s: float) -> list[Loss]:
    """Losses of four feet, by time; normal_n and carrying are (n, 4)."""
    rest, found = round(CARRIED_S / dt_s), []
    for foot in range(normal_n.shape[1]):
        last_end = -rest
        for start, end in stretches(normal_n[:, foot] < LOSS_N):
            began, last_end_before = start * dt_s, last_end
            last_end = end
            long_enough = (end - start) * dt_s >= LOSS_S - 1e-9
            meant = bool(carrying[max(start - 1, 0) : end, foot].all())
            if long_enough and meant and start - last_end_before >= rest and began >= settle_s:
                found.append(_loss(normal_n[:, foot], foot, start, end, dt_s))
    return sorted(found, key=lambda loss: loss.start_s)


def _loss(normal_n: Array, foot: int, start: int, end: int, dt_s: float) -> Loss:
    before = normal_n[max(0, start - round(LOADED_BEFORE_S / dt_s)) : start]
    load = float(np.median(before)) if len(before) else 0.0
    high = np.flatnonzero(before >= SHARE * load)
    below = (len(before) - 1 - high[-1]) * dt_s if len(high) else len(before) * dt_s
    return Loss(foot, start * dt_s, end * dt_s, float(before.max(initial=0.0)), float(below))


def score_scene(
    normal_n: Array,
    carrying: Flags,
    scores: dict[str, NDArray[np.float32]],
    dt_s: float,
    settle_s: float,
) -> Scored:
    """All detectors' scores (n, 4) of one scene against its true normal forces (n, 4)."""
    out = Scored(find_losses(normal_n, carrying, dt_s, settle_s))
    pieces = _windows(normal_n, carrying, dt_s, settle_s)
    out.window_low_n = [_short(normal_n[rows, foot].min()) for foot, rows in pieces]
    out.window_s = [round(len(rows) * dt_s, 3) for _, rows in pieces]
    for name, score in scores.items():
        out.stairs[name] = [_stairs(score[:, loss.foot], loss, dt_s) for loss in out.losses]
        out.windows[name] = [_short(score[rows, foot].max()) for foot, rows in pieces]
    return out


def _windows(
    normal_n: Array, carrying: Flags, dt_s: float, settle_s: float
) -> list[tuple[int, NDArray[np.int64]]]:
    n, before, after = len(normal_n), round(BEFORE_S / dt_s), round(AFTER_S / dt_s)
    length, pieces = round(WINDOW_S / dt_s), []
    for foot in range(normal_n.shape[1]):
        quiet = np.ones(n, dtype=bool)
        quiet[: round(settle_s / dt_s)] = False
        for start, end in stretches((normal_n[:, foot] < LOSS_N) | ~carrying[:, foot]):
            quiet[max(0, start - before) : end + after] = False
        for k in range(0, n, length):
            rows = k + np.flatnonzero(quiet[k : k + length])
            if len(rows) * dt_s >= SHORTEST_WINDOW_S:
                pieces.append((foot, rows))
    return pieces


def _stairs(score: NDArray[np.float32], loss: Loss, dt_s: float) -> list[list[float]]:
    look_s = max(SHORTEST_LOOK_S, min(LONGEST_DELAY_S, loss.end_s - loss.start_s))
    start = round(loss.start_s / dt_s)
    rising = np.maximum.accumulate(score[start : start + round(look_s / dt_s)])
    steps = np.flatnonzero(np.diff(rising, prepend=np.float32(-np.inf)) > 0)
    return [[round(float(k) * dt_s, 6), _short(rising[k])] for k in steps]


def _short(value: Any) -> float:
    return float(f"{float(value):.5g}")


def delays_s(stairs: list[list[list[float]]], threshold: float) -> Array:
    """Delay of each loss at a threshold, s; nan where it was missed."""
    return np.array([next((t for t, s in stair if s >= threshold), np.nan) for stair in stairs])
