"""The few numbers from which a verdict is made: what each set of names gains, what it leaves, what
carries over.
"""

from __future__ import annotations

from collections.abc import Mapping, Set
from dataclasses import asdict, dataclass
from typing import Any

import numpy as np

from testbed.diagnosis.leg.evidence import Evidence, Key, of_residual
from testbed.diagnosis.leg.fading_friction import fading
from testbed.diagnosis.leg.model_form_error import form_floors
from testbed.diagnosis.leg.prediction import held_out, shown_by_one
from testbed.diagnosis.leg.search import LEAST_FALL, LEAST_GAIN, Candidate, Search
from testbed.diagnosis.leg.unexplained import Unexplained


@dataclass(frozen=True)
class SetSigns:
    """One set of names against the set before it (a single effect: the refit; a pair: the best
    single effect).

    `gain`: held-out log-likelihood over the refit; `more`: over the set before; `fall`: largest
    relative fall of a group's noise from the set before; `carried`: log-likelihood gained where
    each recording is predicted from the others, if they can, see `_by_recording`; `worst`: relative
    growth of the noise of the recording that suffers most then. `force`, `flow`: largest noise over
    the floor of the sensors, and of what no law's form is true to (model_form_error.py), that the
    set leaves in a group of that kind in the air; `pressed`: in one of either kind on the load
    cell. `uneven`: how far the valve's metering edges differ, see Edges.unevenness; `late`: samples
    by which its commands act later than the rows of the usual recorder say; `fading`: how far its
    dry friction vanishes with speed, see fading_friction.py.
    """

    names: tuple[str, ...]
    gain: float
    more: float
    fall: float
    carried: float
    worst: float
    force: float
    flow: float
    uneven: float = 0.0
    pressed: float = 1.0
    late: float = 0.0
    fading: float = 0.0


@dataclass(frozen=True)
class Signs:
    """`refit`: no effect; `singles`: every single one, the plainest first (see `_plainness`);
    `second`: the larger set of the greatest gain, against the plainest single effect; `gains`:
    every set that was tried with its gain. `generic_*`: what generic terms add to the best set,
    `alone_gain`: to the refit; `flow_*`: what linear terms add to the best set's flow balances.
    `memory`: correlation time of what the best set leaves of the force, bins.
    """

    refit: SetSigns
    singles: tuple[SetSigns, ...]
    second: SetSigns | None
    gains: tuple[tuple[tuple[str, ...], float], ...]
    generic_gain: float
    generic_fall: float
    memory: float
    alone_gain: float = 0.0
    flow_gain: float = 0.0
    flow_fall: float = 0.0

    @property
    def first(self) -> SetSigns | None:
        """The single effect that shows most plainly; None where none was tried."""
        return self.singles[0] if self.singles else None

    @property
    def best(self) -> SetSigns:
        """The largest of the three sets that still helped."""
        for found in (self.second, self.first):
            if found is not None and found.more > LEAST_GAIN and found.fall > LEAST_FALL:
                return found
        return self.refit

    def as_json(self) -> dict[str, Any]:
        """Plain dictionaries and lists."""
        return asdict(self)

    @classmethod
    def from_json(cls, row: dict[str, Any]) -> Signs:
        """The signs that `as_json` wrote."""
        sets = {key: None if row[key] is None else _set(row[key]) for key in ("refit", "second")}
        singles = tuple(_set(one) for one in row["singles"])
        gains = tuple((tuple(names), float(gain)) for names, gain in row["gains"])
        return cls(**{**row, **sets, "singles": singles, "gains": gains})


def _set(row: dict[str, Any]) -> SetSigns:
    return SetSigns(**{**row, "names": tuple(row["names"])})


def signs(state: Search, found: Unexplained) -> Signs:
    """The signs of a finished search."""
    tried = list(state.tried.values())
    singles = sorted(
        (candidate for candidate in tried if len(candidate.names) == 1),
        key=lambda candidate: _plainness(state, candidate),
        reverse=True,
    )
    larger = [candidate for candidate in tried if len(candidate.names) > 1]
    second = max(larger, key=state.gain, default=None) if singles else None
    best = state.best or state.refit
    memory = [value for name, value in best.evidence.memory.items() if name[0] == "force"]
    return Signs(
        refit=_signs(state, state.refit, state.refit, found),
        singles=tuple(_signs(state, single, state.refit, found) for single in singles),
        second=_signs(state, second, singles[0], found) if second else None,
        gains=tuple((candidate.names, state.gain(candidate)) for candidate in tried),
        generic_gain=found.generic_gain,
        generic_fall=found.generic_fall,
        memory=float(np.median(memory)) if memory else 1.0,
        alone_gain=found.alone_gain,
        flow_gain=found.flow_gain,
        flow_fall=found.flow_fall,
    )


def _plainness(state: Search, candidate: Candidate) -> tuple[float, float]:
    """How plainly a single effect shows: what it gains, times the share by which it lowers some
    group's noise. What trims a long recording by a hundredth gains more than what takes half of a
    short one away, and is no sign of an effect.
    """
    gain = state.gain(candidate)
    return max(gain, 0.0) * max(state.fall(candidate, state.refit), 0.0), gain


def _signs(state: Search, candidate: Candidate, before: Candidate, found: Unexplained) -> SetSigns:
    carried, worst = 0.0, 0.0
    if candidate is not before:
        new = set(candidate.names) - set(before.names)
        alone = shown_by_one(state.problem, candidate.fit, new)
        now, then = (_by_recording(state, c, alone) for c in (candidate, before))
        carried = now.gain_over(then, candidate.evidence)
        worst = max(
            (now.scale[key] / then.scale[key] - 1.0 for key in now.scale if key[0] == "force"),
            default=0.0,
        )
    own = _effects_floor_n(candidate, found)
    form = form_floors(state.problem, candidate.fit)
    floors = {
        name: float(np.hypot(np.hypot(floor, own if name[0] == "force" else 0.0), form[name]))
        for name, floor in found.floors.items()
    }
    excess = {
        name: candidate.evidence.scale[name] / floor
        for name, floor in floors.items()
        if name in candidate.evidence.scale
    }
    in_air, pressed = by_contact(excess, {one.name for one in state.problem.series if one.free})
    return SetSigns(
        names=candidate.names,
        gain=state.gain(candidate),
        more=state.gain(candidate) - state.gain(before),
        fall=state.fall(candidate, before),
        carried=carried,
        worst=worst,
        force=max((value for name, value in in_air.items() if name[0] == "force"), default=1.0),
        flow=max((value for name, value in in_air.items() if name[0] != "force"), default=1.0),
        uneven=candidate.fit.at.edges.unevenness(),
        pressed=max(pressed.values(), default=1.0),
        late=candidate.fit.at.edges.late_s * min(one.full_rate_hz for one in state.problem.series),
        fading=fading(state.problem, candidate.fit, candidate.evidence),
    )


def by_contact(
    excess: Mapping[Key, float], free: Set[str]
) -> tuple[dict[Key, float], dict[Key, float]]:
    """(what is left in the air, what is left on the load cell); a rig that never moves in the air
    has nothing better than its presses. `free`: the recordings in the air.
    """
    in_air = {key: value for key, value in excess.items() if key[1] in free}
    if not in_air:
        return dict(excess), {}
    return in_air, {key: value for key, value in excess.items() if key not in in_air}


def _effects_floor_n(candidate: Candidate, found: Unexplained) -> float:
    """What the encoder's rounding does to the force of the effects that are believed in, N: a part
    of the floor.
    """
    at = candidate.fit.at
    return sum(
        effect.effect.floor_n(effect.values, at.friction, found.encoder_m) for effect in at.effects
    )


def _by_recording(state: Search, candidate: Candidate, alone: Set[str]) -> Evidence:
    """Evidence of recordings that are each predicted from the others. `alone`: recordings that
    alone show what is judged, of which the others predict nothing; they are predicted from their
    own other blocks.
    """
    problem, fit = state.problem, candidate.fit
    left = held_out(problem, fit, by_recording=True)
    if alone:
        by_blocks = held_out(problem, fit)
        for channel, values in left.items():
            layout = problem.layout[channel]
            own = np.array([recording in alone for _, recording in layout.names])[layout.group]
            left[channel] = np.where(own, by_blocks[channel], values)
    return of_residual(problem, left)
