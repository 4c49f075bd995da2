"""What a fit and an effect tell each other: the numbers to be fitted, and what the recordings
hold.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
import numpy.typing as npt

from testbed.effects.terms import Signals
from testbed.formats.arrays import Array
from testbed.recording.known import Known
from testbed.recording.leg_model import Friction


@dataclass(frozen=True)
class Coordinate:
    """One fitted number: its owner (`friction`, `nuisance`, `zero` or an effect's name), scale,
    bounds, and the channels of the residual that it moves.

    `log`: fitted as its logarithm.
    """

    owner: str
    name: str
    start: float
    low: float
    high: float
    scale: float
    log: bool = False
    moves: tuple[str, ...] = ("force",)
    prior: tuple[float, float] | None = None
    """(centre, standard deviation) of a weak prior in fitted units."""

    def sized(self, factor: float, low: float, high: float) -> Coordinate:
        """The same of a machine whose number is so many times larger, between `low` and `high`; the
        start stays.
        """
        if self.log:
            prior = self.prior and (self.prior[0] + math.log(factor), self.prior[1])
            low, high = max(self.low * factor, low), min(self.high * factor, high)
            return replace(self, low=low, high=high, prior=prior)
        prior = self.prior and (self.prior[0] * factor, self.prior[1] * factor)
        return replace(self, scale=self.scale * factor, prior=prior)


USUAL = (3.8e-3, 0.5, 8.5e6, 4.5e-4)
"""Area m2, stroke m, supply Pa and rated flow m3/s of the leg for which starts and priors are
written."""
GROWS_WITH: dict[str, tuple[int, int, int, int]] = {
    "N": (1, 0, 1, 0),
    "N/m": (1, -1, 1, 0),
    "N/m3": (1, -3, 1, 0),
    "N s/m": (1, -1, 1, 0),
    "kg": (1, 0, 1, 0),
    "m2": (1, 0, 0, 0),
    "m3/Pa": (1, 1, 0, 0),
    "m3/(s Pa)": (0, 0, -1, 1),
    "Pa s/m3": (0, 0, 1, -1),
}
"""Unit -> powers of the same four with which a parameter of a leg grows."""


@dataclass(frozen=True, eq=False)
class ForceResidual:
    """What a fit leaves of one recording's force balance, in bins; arrays of shape (bins,)."""

    values_n: Array
    counted: npt.NDArray[np.bool_]
    """Bins that hold a trustworthy sample."""
    noise_n: Array
    bin_s: float
    smoothing_s: float
    """Standard deviation of the smoothing that every channel went through."""


@dataclass(frozen=True, eq=False)
class Observed:
    """What an effect may look at when it is asked what these recordings can show of it."""

    kind: str
    """`vertical-leg`, `cylinder`, `drive` or `robot` (four like legs of one machine)."""
    known: Known
    friction: Friction
    """Friction (5) as fitted so far."""
    signals: tuple[Signals, ...]
    reference_n: tuple[Array | None, ...]
    """The known external force of each recording; None for a foot in the air."""
    residual: tuple[ForceResidual, ...] = ()

    def size(self, unit: str) -> float:
        """How large a number of this unit is on this leg against the usual one; 1 on other rigs."""
        known = self.known
        if self.kind != "vertical-leg" or not (known.bore_m and known.declares_flow):
            return 1.0
        own = (
            known.area_a_m2,
            known.stroke_m,
            known.supply_pressure_nominal_pa,
            known.valve_rated_flow_m3_s,
        )
        powers = GROWS_WITH.get(unit, (0, 0, 0, 0))
        return float(np.prod(np.divide(own, USUAL) ** np.array(powers)))  # type: ignore[arg-type]

    @cached_property
    def position_m(self) -> Array:
        """Positions of all recordings, one after the other."""
        return np.concatenate([signal.position_m for signal in self.signals])

    @property
    def seconds(self) -> float:
        """How long the recordings last together."""
        return sum(float(signal.time_s[-1] - signal.time_s[0]) for signal in self.signals)

    @property
    def oil_temperature_span_k(self) -> float:
        """By how much the oil's temperature changes over all recordings, single outliers aside."""
        channels = [signal.oil_temperature_degc for signal in self.signals]
        ranges = [np.percentile(values, [2, 98]) for values in channels if values is not None]
        return float(max(range_[1] for range_ in ranges) - min(range_[0] for range_ in ranges))

    @property
    def largest_load_n(self) -> float:
        """The largest external force that lasted, N; 0 where the foot was always in the air."""
        known = [force for force in self.reference_n if force is not None]
        return max((float(np.percentile(np.abs(force), 98)) for force in known), default=0.0)

    @property
    def largest_acceleration_m_s2(self) -> float:
        """The acceleration that one sample in ten of the liveliest recording exceeds, m/s2."""
        return max(
            float(np.percentile(np.abs(signal.acceleration_m_s2), 90)) for signal in self.signals
        )
