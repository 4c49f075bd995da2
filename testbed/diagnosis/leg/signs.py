"""The few numbers from which a verdict is made: what each set of names gains, what it leaves, what
carries over.
"""

from __future__ import annotations

from collections.abc import Mapping, Set
from dataclasses import asdict, dataclass
from typing import Any

import numpy as np

from testbed.diagnosis.leg.evidence import Evidence, Key, of_residual
from testbed.diagnosis.leg.prediction import held_out
from testbed.diagnosis.leg.search import LEAST_FALL, LEAST_GAIN, Candidate, Search
from testbed.diagnosis.leg.unexplained import Unexplained


@dataclass(frozen=True)
class SetSigns:
    """One set of names against the set before it (a single effect: the refit; a pair: the best
    single effect).

    `gain`: held-out log-likelihood over the refit; `more`: over the set before; `fall`: largest
    relative fall of a group's noise from the set before; `carried`: log-likelihood gained where
    each recording is predicted from the others; `worst`: relative growth of the noise of the
    recording that suffers most then.
    `force`, `flow`: largest noise over the floor of the sensors that the set leaves in a group of
    that kind in the air; `pressed`: in one of either kind on the load cell. `uneven`: how far the
    valve's metering edges differ, see Edges.unevenness.
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


@dataclass(frozen=True)
class Signs:
    """`refit`, `first`, `second`: no effect, the best single one, the best larger set; `gains`:
    every set that was tried with its gain. `generic_*`: what generic terms add to the best set,
    `alone_gain`: to the refit; `flow_*`: what linear terms add to the best set's flow balances.
    `memory`: correlation time of what the best set leaves of the force, bins.
    """

    refit: SetSigns
    first: SetSigns | None
    second: SetSigns | None
    gains: tuple[tuple[tuple[str, ...], float], ...]
    generic_gain: float
    generic_fall: float
    memory: float
    alone_gain: float = 0.0
    flow_gain: float = 0.0
    flow_fall: float = 0.0

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
        sets = {
            key: None if row[key] is None else _set(row[key])
            for key in ("refit", "first", "second")
        }
        gains = tuple((tuple(names), float(gain)) for names, gain in row["gains"])
        return cls(**{**row, **sets, "gains": gains})


def _set(row: dict[str, Any]) -> SetSigns:
    return SetSigns(**{**row, "names": tuple(row["names"])})


def signs(state: Search, found: Unexplained) -> Signs:
    """The signs of a finished search."""
    tried = list(state.tried.values())
    singles = [candidate for candidate in tried if len(candidate.names) == 1]
    larger = [candidate for candidate in tried if len(candidate.names) > 1]
    first = max(singles, key=state.gain, default=None)
    second = max(larger, key=state.gain, default=None) if first else None
    best = state.best or state.refit
    memory = [value for name, value in best.evidence.memory.items() if name[0] == "force"]
    return Signs(
        refit=_signs(state, state.refit, state.refit, found),
        first=_signs(state, first, state.refit, found) if first else None,
        second=_signs(state, second, first, found) if first and second else None,
        gains=tuple((candidate.names, state.gain(candidate)) for candidate in tried),
        generic_gain=found.generic_gain,
        generic_fall=found.generic_fall,
        memory=float(np.median(memory)) if memory else 1.0,
        alone_gain=found.alone_gain,
        flow_gain=found.flow_gain,
        flow_fall=found.flow_fall,
    )


def _signs(state: Search, candidate: Candidate, before: Candidate, found: Unexplained) -> SetSigns:
    carried, worst = 0.0, 0.0
    if candidate is not before:
        now, then = (_by_recording(state, c) for c in (candidate, before))
        carried = now.gain_over(then, candidate.evidence)
        worst = max(
            (now.scale[key] / then.scale[key] - 1.0 for key in now.scale if key[0] == "force"),
            default=0.0,
        )
    own = _effects_floor_n(candidate, found)
    floors = {
        name: float(np.hypot(floor, own)) if name[0] == "force" else floor
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


def _by_recording(state: Search, candidate: Candidate) -> Evidence:
    return of_residual(state.problem, held_out(state.problem, candidate.fit, by_recording=True))
