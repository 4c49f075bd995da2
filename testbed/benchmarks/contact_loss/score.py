"""A detector's scores on one scene against the truth, at many thresholds: what is counted, and by
which load.

Losses, touchdowns, delays, false alarms and wrong seconds are those of
estimation/contact_losses.py. Each is counted by the load of its foot, as a share of the nominal
load: a loss by what the foot bore before (the load that it reached in a tenth of the two seconds
before), time in contact by the lowest load within half a second. Below twice the share of a loss a
foot is `near` one; below LIGHT_SHARE, twice the break-away force of a shipped cylinder, friction
may hide as much as is there, and it is `light`.
"""

from __future__ import annotations

from dataclasses import asdict, dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from testbed.compiled import njit
from testbed.estimation.contact_losses import LOSS_SHARE, LossRule, follow, intervals
from testbed.estimation.detectors.base import Hold
from testbed.estimation.live.contact import ContactLimits, ContactState, limits_at, step
from testbed.formats.arrays import Array, Flags
from testbed.formats.records import SET, Records

Tree = dict[str, Any]
CLASSES = ("near", "light", "loaded")
NEAR_SHARE, LIGHT_SHARE = 2.0 * LOSS_SHARE, 0.16
AROUND_S, BEFORE_S, BORE_QUANTILE = 0.5, 2.0, 0.9
GRADUAL_S, SMOOTH_S = 0.1, 0.02
"""A loss is gradual if the load, smoothed, took this long for the second half of its way down."""


@dataclass(frozen=True)
class TrueLoss:
    """One true loss of a foot: what it bore before, how, and whether the control meant it."""

    foot: int
    start_s: float
    end_s: float
    bore_n: float
    load_class: int
    """Place in CLASSES."""
    fell_s: float
    """Time for the second half of the way down, s."""
    meant: bool = False

    @property
    def gradual(self) -> bool:
        """Whether it took its time."""
        return self.fell_s >= GRADUAL_S


@dataclass(frozen=True, eq=False)
class Reference:
    """What one scene's detectors are scored against: n samples of four feet, after settling."""

    time_s: Array
    carrying: Flags
    """(n, 4)."""
    load_class: NDArray[np.int8]
    """(n, 4): place in CLASSES of every sample's foot; of a lost foot that of its loss."""
    losses: tuple[TrueLoss, ...]
    """Foot by foot, by time, as `follow` finds them."""
    loaded_n: float
    """Load from which a foot is loaded, N."""

    @classmethod
    def of(cls, normal_n: Array, meant: Flags, time_s: Array, rule: LossRule) -> Reference:
        """From true normal forces (n, 4), and where the control wishes a foot to carry (n, 4)."""
        carrying = np.stack([rule.carrying(force, time_s) for force in normal_n.T], axis=1)
        around = max(round(AROUND_S / float(np.median(np.diff(time_s)))), 1)
        classes = np.empty(normal_n.shape, dtype=np.int8)
        losses: list[TrueLoss] = []
        for foot in range(normal_n.shape[1]):
            force, carries = normal_n[:, foot], carrying[:, foot]
            lowest = _lowest(np.where(carries, force, np.inf), around)
            classes[:, foot] = class_of(lowest, rule.nominal_load_n)
            for start, end in intervals(~carries, time_s):
                loss = _loss(force, foot, (start, end), time_s, rule)
                classes[start:end, foot] = loss.load_class
                if start > 0:
                    losses.append(replace(loss, meant=not meant[start - 1 : end, foot].all()))
        return cls(time_s, carrying, classes, tuple(losses), LIGHT_SHARE * rule.nominal_load_n)

    def facts(self) -> Tree:
        """Losses and foot seconds by class, for JSON."""
        step_s = float(np.median(np.diff(self.time_s)))
        return {
            "losses": [asdict(loss) | {"gradual": loss.gradual} for loss in self.losses],
            "carried_s": seconds(self.carrying, self.load_class, step_s),
            "lost_s": seconds(~self.carrying, self.load_class, step_s),
        }


def class_of(load_n: Array, nominal_n: float) -> NDArray[np.int8]:
    """Place in CLASSES of loads, N."""
    bounds = [NEAR_SHARE * nominal_n, LIGHT_SHARE * nominal_n]
    return np.searchsorted(bounds, load_n, side="right").astype(np.int8)


def _lowest(load_n: Array, around: int) -> Array:
    from scipy.ndimage import minimum_filter1d

    return np.asarray(minimum_filter1d(load_n, 2 * around + 1, mode="nearest"))


def _loss(
    force_n: Array, foot: int, span: tuple[int, int], time_s: Array, rule: LossRule
) -> TrueLoss:
    start, end = span
    step_s = float(np.median(np.diff(time_s)))
    before = force_n[max(0, start - round(BEFORE_S / step_s)) : start]
    bore = float(np.quantile(before, BORE_QUANTILE)) if len(before) else 0.0
    smooth = max(round(SMOOTH_S / step_s), 1)
    slow = np.convolve(before, np.full(smooth, 1.0 / smooth), "same") if len(before) else before
    half = 0.5 * (bore + rule.force_n)
    above = np.flatnonzero(slow >= half)
    fell = len(before) - 1 - above[-1] if len(above) else len(before)
    return TrueLoss(
        foot,
        round(float(time_s[start]), 4),
        round(float(time_s[end - 1] + step_s), 4),
        round(bore, 1),
        int(class_of(np.array([bore]), rule.nominal_load_n)[0]),
        round(float(fell * step_s), 4),
    )


def seconds(where: Flags, load_class: NDArray[np.int8], step_s: float) -> list[float]:
    """Seconds by class in which `where` (n, 4) holds."""
    counts = np.bincount(load_class[where], minlength=len(CLASSES))
    return [round(float(count) * step_s, 4) for count in counts]


def squares(error_n: Array, reference: Reference) -> list[list[float]]:
    """Sum of the squares (N2) of a load's error (n, 4) while the feet carry, and over how many
    samples, by class.
    """
    where = reference.carrying
    sums = [
        np.bincount(reference.load_class[where], weights, minlength=len(CLASSES))
        for weights in (error_n[where] ** 2, None)
    ]
    return [list(map(float, part)) for part in sums]


def scored(
    score: Array, thresholds: Array, reference: Reference, hold: Hold, from_first: bool = False
) -> list[Tree]:
    """A detector's scores (n, 4) at each threshold (m,): see `_counted`. `from_first`: the hold
    belongs to the first threshold, see `raised`.
    """
    step_s = float(np.median(np.diff(reference.time_s)))
    words = np.empty((len(thresholds), *score.shape), dtype=np.bool_)
    higher = (thresholds - thresholds[0]) * from_first
    limits = np.concatenate(
        [
            limits_at(float(t), raised(hold, float(h)))
            for t, h in zip(thresholds, higher, strict=True)
        ]
    )
    states = ContactState.zeros(len(thresholds), score.shape[1])
    states["contact"] = 1.0
    _words(np.ascontiguousarray(score), step_s, limits, states, words)
    return [_counted(word, reference, step_s) for word in words]


def raised(hold: Hold, higher: float) -> Hold:
    """The hold at a threshold so much higher: the levels from which a foot counts as loaded again
    stay where they are. One without a margin has a single level, which moves.
    """
    if hold.margin <= 0.0:
        return hold
    margin, sure, slow = (
        max(level + higher, 0.0) for level in (hold.margin, hold.sure_margin, hold.slow_margin)
    )
    return replace(hold, margin=margin, sure_margin=sure, slow_margin=slow)


@njit
def _words(
    score: Array, step_s: float, limits: Records[ContactLimits], states: Any, words: Flags
) -> None:
    """Where the word says lost: scores (n, feet), ContactLimits (m,), ContactState (m, feet) -> (m,
    n, feet).
    """
    for k in range(len(limits)):
        for n in range(score.shape[0]):
            for foot in range(score.shape[1]):
                word = step(states[k, foot], -score[n, foot], step_s, limits[k])
                words[k, n, foot] = word < SET


def _counted(lost: Flags, reference: Reference, step_s: float) -> Tree:
    """One word (n, 4): delays of losses (as Reference lists them) and touchdowns, s, None: missed;
    false alarms and wrong seconds by class.
    """
    delays: list[float | None] = []
    touchdowns: list[float | None] = []
    alarms = np.zeros(len(CLASSES), dtype=int)
    missed, false = np.zeros(lost.shape, dtype=bool), np.zeros(lost.shape, dtype=bool)
    for foot in range(lost.shape[1]):
        found = follow(lost[:, foot], reference.carrying[:, foot], reference.time_s)
        delays += [loss.delay_s for loss in found.losses]
        touchdowns += [touchdown.delay_s for touchdown in found.touchdowns]
        for at in found.false_alarms:
            alarms[reference.load_class[at, foot]] += 1
        missed[:, foot], false[:, foot] = found.missed, found.false_flight
    return {
        "delays_s": [None if d is None else round(d, 4) for d in delays],
        "touchdowns_s": [None if d is None else round(d, 4) for d in touchdowns],
        "false_alarms": alarms.tolist(),
        "missed_s": seconds(missed, reference.load_class, step_s),
        "false_flight_s": seconds(false, reference.load_class, step_s),
    }
