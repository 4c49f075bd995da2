"""The contact states of any number of feet from their forces alone, sample by sample or over a
recording.

From a real controller:

    feet = Feet(SingleForce(), nominal_load_n=np.array([20.0]), breakaway_n=np.array([1.0]))
    states = feet.update(t, force_n)      # (k,): 1 loaded, 0 contact lost

Samples may come late, twice, with gaps or with forces that are no number: a sample no later than
the one before is left out, a force that is no number leaves its foot as it is. The state then
holds; `known` says whether it still rests on something.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from testbed.errors import InputError
from testbed.estimation.detectors.base import Detector
from testbed.estimation.detectors.single_force import ForceSample, SingleForce
from testbed.estimation.live.contact import ContactState, step
from testbed.estimation.live.judged import limits_of
from testbed.estimation.losses import LOSS_SHARE
from testbed.formats.arrays import Array, Flags
from testbed.formats.sockets import FORM, is_user_class, load_object

KNOWN_S = 0.1
"""A state rests on nothing any more when its foot had no good sample for so long, s (E)."""


class Feet:
    """A detector of forces at work on k feet of their own scales, N, each (k,).

    Raises InputError for a detector without a threshold.
    """

    def __init__(self, detector: Any, nominal_load_n: Array, breakaway_n: Array) -> None:
        self._detector, self._scale = detector, (nominal_load_n, breakaway_n)
        self._limits = limits_of(detector, "--detector")
        feet = len(nominal_load_n)
        self._hysteresis = ContactState.zeros(feet)
        self._hysteresis["contact"] = 1.0
        self._t, self._seen_s = -np.inf, np.full(feet, -np.inf)
        self._states = np.ones(feet)

    @property
    def known(self) -> Flags:
        """Whether each foot had a good sample lately, (k,)."""
        return np.asarray(self._t - self._seen_s <= KNOWN_S, dtype=bool)

    def update(self, t: float, force_n: Array) -> Array:
        """Contact states (k,) after a sample: forces (k,) at time t, s."""
        states, _ = self.over(np.array([t]), np.asarray(force_n, dtype=np.float64)[None, :])
        return np.asarray(states[0])

    def over(self, time_s: Array, force_n: Array) -> tuple[Array, Flags]:
        """`update` over the next samples, times (n,), forces (n, k): states, and whether they are
        known, (n, k).
        """
        latest = np.maximum.accumulate(np.append(self._t, time_s))
        force_n = np.where((time_s > latest[:-1])[:, None], force_n, np.nan)
        seen = np.where(np.isfinite(force_n), time_s[:, None], -np.inf)
        seen = np.maximum.accumulate(np.vstack([self._seen_s, seen]))
        states = self._judged(time_s, force_n, np.diff(latest))
        self._t, self._seen_s, self._states = latest[-1], seen[-1], states[-1].copy()
        return states, latest[1:, None] - seen[1:] <= KNOWN_S

    def _judged(self, time_s: Array, force_n: Array, step_s: Array) -> Array:
        if isinstance(self._detector, SingleForce):  # has its own hysteresis
            scores = self._detector.over(time_s, force_n, *self._scale)
            return np.where(np.isnan(scores), 1.0, scores < self._detector.threshold)
        states = np.empty(force_n.shape)
        now = self._states
        for row, (t, force, dt) in enumerate(zip(time_s, force_n, step_s, strict=True)):
            finite = np.isfinite(force)
            if finite.any():
                scores = np.asarray(self._detector.update(ForceSample(t, force, *self._scale)))
                dt = dt if np.isfinite(dt) else 0.0
                for foot in np.flatnonzero(finite):
                    load = -float(scores[foot])
                    now[foot] = step(self._hysteresis[foot], load, dt, self._limits)
            states[row] = now
        return states


def force_detector(name: str, loss_share: float = LOSS_SHARE) -> Any:
    """A detector of forces by name or as `FILE.py:Class`; the shipped one calls feet below this
    share of their load lost.

    Raises InputError for any other name.
    """
    if is_user_class(name):
        return load_object(name, Detector, field="--detector")
    if name == SingleForce.name:
        return SingleForce(loss_share)
    raise InputError(
        "does not work on forces alone",
        field="--detector",
        value=name,
        allowed=f"{SingleForce.name}, {FORM}; the others on a robot's recording without --force",
    )
