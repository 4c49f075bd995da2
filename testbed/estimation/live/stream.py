"""Estimates and contact states for a real controller, sample by sample, even where samples come
late or not at all: of the whole robot (`Stream`), or of feet whose force is known (`Feet`).

    stream = Stream(believed)          # the estimators' belief, as `testbed estimate` builds it
    row = DataRow.zeros()              # fill in what was measured, by name
    row["t"], row["pressure_a"][:] = ...
    told = stream.update(row)          # with estimates: told["estimate"]["own"], told["contact"]

The same code serves runs and recordings, and gives the same numbers; joined.py says what becomes of
late and missing samples. `known` says which feet's states still rest on a recent sample. After a
clock was set back every sample is too late: make a new stream then.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from testbed.errors import InputError
from testbed.estimation.contact_losses import LOSS_SHARE
from testbed.estimation.detectors.base import Detector
from testbed.estimation.detectors.single_force import ForceSample, SingleForce
from testbed.estimation.live.believed import Believed
from testbed.estimation.live.chain import EstimatorChain
from testbed.estimation.live.contact import ContactState, step
from testbed.estimation.live.joined import COLUMNS, MEASURED, TIME, arrived
from testbed.estimation.live.selected import SelectedDetector, limits_of
from testbed.formats.arrays import Array, Flags
from testbed.formats.sockets import FORM, is_user_class, load_object, numbers_of
from testbed.machine.names import LEGS
from testbed.recording.rows import DataRow

KNOWN_S = 0.1
"""A state rests on nothing any more when its foot had no good sample for so long, s (E)."""


class Feet:
    """The contact states of any number of feet from their forces alone, sample by sample or
    over a recording.

    From a real controller:

        feet = Feet(SingleForce(), nominal_load_n=np.array([20.0]), breakaway_n=np.array([1.0]))
        states = feet.update(t, force_n)      # (k,): 1 loaded, 0 contact lost

    Samples may come late, twice, with gaps or with forces that are no number: a sample no
    later than the one before, or whose time is no finite number, is left out, a force that is no
    number leaves its foot as it is. The state then holds; `known` says whether it still rests on
    something. Behind a clock that was set back everything is too late: make new ones then.

    A detector of forces at work on k feet of their own scales, N, each (k,). Raises InputError
    for a detector without a threshold.
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
        """Whether each foot had a good sample within KNOWN_S of the last one that came in time,
        (k,).
        """
        return np.asarray(self._t - self._seen_s <= KNOWN_S, dtype=bool)

    def update(self, t: float, force_n: Array) -> Array:
        """Contact states (k,) after a sample: forces (k,) at time t, s.

        Raises InputError for another number of forces.
        """
        force_n = np.asarray(force_n, dtype=np.float64)
        if force_n.shape != self._states.shape:
            raise InputError(
                "has another shape than the feet",
                field="force_n",
                value=force_n.shape,
                allowed=f"{self._states.shape}: a number for each foot",
            )
        states, _ = self.over(np.array([t], dtype=np.float64), force_n[None, :])
        return np.asarray(states[0])

    def over(self, time_s: Array, force_n: Array) -> tuple[Array, Flags]:
        """`update` over the next samples, times (n,), forces (n, k): states, and whether they are
        known, (n, k).
        """
        if len(time_s) == 0:
            return np.empty(force_n.shape), np.empty(force_n.shape, dtype=bool)
        time_s = np.where(np.isfinite(time_s), time_s, -np.inf)
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
                scores = self._scores(t, force, finite)
                dt = dt if np.isfinite(dt) else 0.0
                for foot in np.flatnonzero(finite):
                    load = -float(scores[foot])
                    now[foot] = step(self._hysteresis[foot], load, dt, self._limits)
            states[row] = now
        return states

    def _scores(self, t: float, force: Array, finite: Flags) -> Array:
        """What the detector, handed copies of its own, says of one sample: scores (k,), numbers
        where a force is `finite`. Raises InputError for any other answer.
        """
        nominal_load, breakaway = (scale.copy() for scale in self._scale)
        answer = self._detector.update(ForceSample(t, force.copy(), nominal_load, breakaway))
        scores: Array = numbers_of(answer, force.shape, self._detector, "scores")
        if np.isnan(scores[finite]).any():
            raise InputError(
                f"a score is no number at t = {t:.3f} s",
                field="--detector",
                value=type(self._detector).__name__,
                allowed="numbers, where a force is one",
            )
        return scores


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


OF_LEG = {
    leg: [
        COLUMNS.index(f"{stem}_{leg}_vertical") for stem in ("position", "pressure_a", "pressure_b")
    ]
    for leg in LEGS
}
"""Without these nothing can be said of a foot."""


class Stream:
    """See the module. `detector`: another one than the chain's own, by name or FILE.py:Class.

    Raises InputError for a detector that is not there.
    """

    def __init__(self, believed: Believed, detector: str | None = None) -> None:
        self._chain, self._dt_s, self._named = EstimatorChain(believed), believed.dt_s, detector
        self._detector = self._fresh_detector()
        self._row = DataRow.zeros()
        self._last: Array | None = None
        self._seen_s = np.full(len(LEGS), -np.inf)

    def _fresh_detector(self) -> SelectedDetector | None:
        return None if self._named is None else SelectedDetector(self._named, self._chain.belief)

    @property
    def known(self) -> NDArray[np.bool_]:
        """Whether each foot had a whole sample within KNOWN_S of the last one that came in time,
        (4,).
        """
        return np.asarray(self._row["t"][0] - self._seen_s <= KNOWN_S, dtype=bool)

    def update(self, row: NDArray[Any]) -> NDArray[Any]:
        """One sample: DataRow (1,) -> DataRow (1,) with its estimates; the last one where it comes
        too late.
        """
        sample = DataRow.as_table(row)[0]
        found = arrived(self._last, sample, self._dt_s)
        if found is None:
            return self._row.copy()
        if found.anew:
            self._chain.forget()
            self._detector = self._fresh_detector()
        for index, leg in enumerate(LEGS):
            if np.isfinite(sample[OF_LEG[leg]]).all():
                self._seen_s[index] = sample[TIME]
        for measured in found.rows:
            self._step(measured)
        self._last = found.rows[-1]
        return self._row.copy()

    def _step(self, measured: Array) -> None:
        DataRow.as_table(self._row)[0, MEASURED] = measured[MEASURED]
        self._chain.step(self._row)
        if self._detector is not None:
            self._detector.fill(self._row)
