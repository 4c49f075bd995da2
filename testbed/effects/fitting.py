"""What a fit and an effect tell each other: the numbers to be fitted, and what the recordings
hold.
"""

from __future__ import annotations

from dataclasses import dataclass
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
