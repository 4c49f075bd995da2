"""The residuals of four like legs that stand on one machine.

Where a piston slides, its force residual is estimate less expected load, as on a bench. Where it rests, friction is a
set, and the residual is what no friction within the set explains (with a weak pull towards the set's middle).

Four feet and six equations: the load between one diagonal and the other, d = (1, -1, -1, 1) / 2, is open, and a
sticking cylinder or a tenth of a millimetre under a foot shifts it. So of the four residuals r only r - d (d . r),
which equilibrium fixes, is compared with anything.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from testbed.diagnosis.leg.plain_balance import Balance
from testbed.diagnosis.leg.problem import Layout, Problem
from testbed.diagnosis.leg.series import BIN, Series
from testbed.effects.base import Active
from testbed.estimation.leg.balance import external_n
from testbed.estimation.leg.flow import Edge
from testbed.estimation.leg.friction import breakaway_n, friction_n
from testbed.estimation.leg.motion import smooth
from testbed.recording.leg_model import LegModel

Array = npt.NDArray[np.float64]
DIAGONAL = np.array([0.5, -0.5, -0.5, 0.5])
"""LEGS order: fl, fr, rl, rr."""
FLOW_S = 0.15
"""Standard deviation of the Gaussian mean over the flow residuals."""
UNSURE = {"force": 80.0, "force_held": 80.0, "flow_a": 3e-7, "flow_b": 3e-7}
"""E: expected loads are within 0.8 % of 10 kN, flows within 0.3 % of 6 L/min."""
PULL = 0.1
"""Share of the way from the middle of the set that counts as residual while friction could explain it."""


@dataclass(eq=False)
class RobotProblem(Problem):
    """`window_s`: (from, to), what counts of the run; the rest is for judging."""

    window_s: tuple[float, float] = (0.0, np.inf)

    @property
    def kind(self) -> str:
        """`robot`."""
        return "robot"

    @property
    def unsure(self) -> Mapping[str, float]:
        """What expected loads and a real valve's flow are believed to, N and m3/s."""
        return UNSURE

    def channels(self) -> tuple[str, ...]:
        """Force and flow; the supply is common to all legs and measured."""
        return ("force", "flow")

    def force(self, model: LegModel, effects: Sequence[Active]) -> Array:
        """Stacked binned residuals of the four legs without the open diagonal, N."""
        rows = zip(self.series, self._balances(model, effects), strict=True)
        legs = np.stack([_one(s, balance, model) for s, balance in rows])
        return np.asarray((legs - np.outer(DIAGONAL, DIAGONAL @ legs)).reshape(-1))

    def straight_columns(self, model: LegModel, effects: Sequence[Active]) -> None:
        """None: a piston that rests leaves a set, and the open diagonal mixes the legs."""

    def flow(self, model: LegModel, effects: Sequence[Active], edge: Edge) -> dict[str, Array]:
        """Stacked binned flow residuals, slowed down: the encoder's error is bounded, so in the mean over FLOW_S it
        falls much faster than chance, while a leak stays.
        """
        found = super().flow(model, effects, edge)["flow"]
        first, parts = 0, []
        for s in self.series:
            width = FLOW_S * s.signals.rate_hz / BIN
            for _ in "ab":
                parts.append(smooth(found[first : first + s.bins], width))
                first += s.bins
        return {"flow": np.concatenate(parts)}

    def slides(self) -> int:
        """Bins within the window in which every piston slides."""
        layout = self.layout["force"]
        moving = [layout.names[g][0] == "force" for g in range(len(layout.names))]
        return int(sum(np.array(moving)[layout.group] & (layout.count > 0))) // len(self.series)

    def _layout(self, channel: str) -> Layout:
        layout = super()._layout(channel)
        group, names, count = layout.group, layout.names, layout.count.copy()
        first = 0
        if channel == "force":
            sliding = (
                np.min(
                    [s.binned(np.ones(len(s.trusted)), s.trusted)[1] for s in self.series], axis=0
                )
                > 0
            )
            names = tuple(n for _, leg in names for n in (("force", leg), ("force_held", leg)))
            group = np.concatenate(
                [2 * k + (~sliding).astype(np.int64) for k in range(len(self.series))]
            )
            clear = np.min(
                [s.binned(np.ones(len(s.clear)), s.clear)[1] for s in self.series], axis=0
            )
            count = np.tile(clear, len(self.series))
        for s in self.series:
            time = s.signals.time_s[1::BIN][: s.bins]
            for _ in range(2 if channel == "flow" else 1):
                inside = (time >= self.window_s[0]) & (time < self.window_s[1])
                count[first : first + s.bins] *= inside
                first += s.bins
        relative = np.ones(len(count)) if channel == "force" else layout.relative
        return Layout((channel,), group, layout.block, count, relative, names)


def _one(s: Series, balance: Balance, model: LegModel) -> Array:
    """Binned residual of one leg, the open diagonal still in it, N."""
    signals, terms, total = balance
    reference = s.reference_n if s.reference_n is not None else np.zeros_like(total)
    rest = total - friction_n(model.friction, signals, terms)
    sliding = external_n(rest, np.sign(signals.velocity_m_s), terms) - reference
    low, high = breakaway_n(model.friction, signals, terms)
    needed = total - reference
    beyond = np.maximum(needed - high, 0.0) + np.minimum(needed - low, 0.0)
    held = beyond + PULL * (np.clip(needed, low, high) - 0.5 * (low + high))
    return s.binned(np.where(s.trusted, sliding, held), s.clear)[0]
