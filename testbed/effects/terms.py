"""What effects act on: the channels of one axis, and the believed balances of its forces and its
oil.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import Any

import numpy as np
import numpy.typing as npt

from testbed.formats.arrays import Array
from testbed.laws.low_pass import causal_slope, low_passed, steps_of
from testbed.machine.names import AXES, LEGS, SIDES
from testbed.recording.known import Known
from testbed.recording.leg_model import Friction

Values = Mapping[str, float]
"""Parameter -> value, SI."""


@dataclass(frozen=True, eq=False)
class Signals:
    """Channels of one axis on a uniform time grid, SI, each of shape (n,); pressures gauge.

    `velocity_m_s`, `acceleration_m_s2` come from the encoder and are smoothed like every other
    channel. In a drive `actuator_force_n` stands for the pressures.
    """

    time_s: Array
    rate_hz: float
    known: Known
    position_m: Array
    velocity_m_s: Array
    acceleration_m_s2: Array
    pressure_a_pa: Array | None = None
    pressure_b_pa: Array | None = None
    supply_pressure_pa: Array | None = None
    oil_temperature_degc: Array | None = None
    valve_command: Array | None = None
    actuator_force_n: Array | None = None
    slow_acceleration_m_s2: Array | None = None
    """Acceleration smoothed far more, given while fitting: the encoder's noise in it is no longer a
    part of the residual, so an added mass is not drawn towards cancelling that noise."""
    place: str = ""
    """Of several like axes, the one that these are the signals of: `rl_vertical`."""
    began_s: float | None = None
    """Of a stretch: when the recording that it is of began; None: with its first row."""
    causal: bool = False
    """Each sample says what was known when it came: low-passed, on the recording's own times;
    nothing may be made of it that looks ahead."""
    speed_sd_m_s: Array | None = None
    acceleration_sd_m_s2: Array | None = None
    """How well the motion is known, where that is less well than usual: so far, at the start."""

    @property
    def since_s(self) -> Array:
        """Time since the start of the recording, s, (n,)."""
        return self.time_s - (self.time_s[0] if self.began_s is None else self.began_s)

    def with_(self, **changes: Any) -> Signals:
        """A copy with some channels replaced."""
        return replace(self, **changes)

    def slope(self, values: Array, width_s: float) -> Array:
        """Slope (n,) of a channel, per second, smoothed by `width_s` first."""
        if not self.causal:
            return self.change(flat(values, width_s * self.rate_hz))
        usual_s = 1.0 / self.rate_hz
        return self.change(low_passed(values, steps_of(self.time_s, usual_s), usual_s, width_s))

    def change(self, values: Array) -> Array:
        """Change of a smooth channel (n,) from sample to sample, per second."""
        if not self.causal:
            return np.asarray(np.gradient(values) * self.rate_hz, dtype=np.float64)
        return causal_slope(values, steps_of(self.time_s, 1.0 / self.rate_hz))

    def later(self, delay_s: float) -> Signals:
        """All but pressures and forces as they were `delay_s` ago; before the start as then."""
        kept = {name: getattr(self, name) for name in MOVED_BY_A_DELAY}
        ago = self.time_s - delay_s
        return self.with_(
            **{
                name: np.interp(ago, self.time_s, values)
                for name, values in kept.items()
                if values is not None
            }
        )


MOVED_BY_A_DELAY = (
    "position_m",
    "velocity_m_s",
    "acceleration_m_s2",
    "oil_temperature_degc",
    "valve_command",
    "speed_sd_m_s",
    "acceleration_sd_m_s2",
)
"""Channels that go back in time with late pressures, where the pressures cannot be had earlier."""


def flat(values: Array, width: float) -> Array:
    """Twice the Gaussian of a width in samples less the Gaussian twice: smooth, and flat to fourth
    order.
    """
    from scipy.ndimage import gaussian_filter1d

    once = gaussian_filter1d(values, width, mode="nearest")
    return np.asarray(2.0 * once - gaussian_filter1d(once, width, mode="nearest"), dtype=np.float64)


@dataclass
class ForceTerms:
    """The believed force balance, to be changed by effects; every entry a number or an array of
    shape (n,).

    F_ext = F_p + weight_mass g cos(inclination) - (mass + added_mass) a + force - F_f,
    F_f = viscous_scale sigma v + sign(v) [coulomb_scale F_c0 + coulomb_add + F_s0 exp(-|v|/c_s)]
          + sign(v) load_coefficient F0 (max(F_ext, 0) / F0)^load_exponent, F0 = 10 kN.
    """

    mass_kg: float
    weight_mass_kg: float
    added_mass_kg: float = 0.0
    coulomb_scale: Any = 1.0
    coulomb_add_n: Any = 0.0
    viscous_scale: Any = 1.0
    load_coefficient: float = 0.0
    load_exponent: float = 1.0
    force_n: Any = 0.0
    presliding: tuple[float, float, float] | None = None
    """(stiffness N/m, damping N s/m, shape) of the bristle that replaces equation (5) by its
    dynamic form.
    """
    narrow_bands: list[tuple[float, float, int]] = field(default_factory=list)
    """(frequency Hz, amplitude N, harmonics) of forces whose phase only the recording knows."""


@dataclass
class FlowTerms:
    """The believed flow balance, to be changed by effects."""

    leakage_m3_s_pa: float
    deadband: float
    leakage_exponent: float = 1.0
    gas_fraction: float = 0.0
    gas_exponent: float = 1.0 / 1.4
    hose_capacity_m3_pa: float = 0.0
    hose_time_s: float = 1.0
    droop_pa_s_m3: float = 0.0
    droop_time_s: float = 1.0


# What a fit and an effect tell each other: the numbers to be fitted, and what the recordings hold.


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


# What a world has and its model lacks: plain numbers that effects write and the world puts where
# they belong.
#
# One object a run. Whatever nobody writes to stays as the machine has it. SI; cylinders by their
# axis (`fl_radial`), feet by their leg, ropes by their side.


@dataclass
class HiddenCylinder:
    """One cylinder with its valve and its sensors. None: as the machine has it; 0 where a number is
    added to its own.
    """

    replaced: dict[str, float] = field(default_factory=dict)
    """Path in AxisParameters (laws/axis_records.py) -> number in the place of the machine's."""
    added: dict[str, float] = field(default_factory=dict)
    """Path as in `replaced` -> number on top of the machine's."""
    mass_kg: float = 0.0
    """Added to what the cylinder moves."""
    gain_error_a: float = 0.0
    """Pressure sensor at A: it reads so much more of the pressure."""
    gain_error_b: float = 0.0
    """Pressure sensor at B: it reads so much more of the pressure."""
    zero_a_pa: float = 0.0
    """Pressure sensor at A: what it reads at no pressure."""
    zero_b_pa: float = 0.0
    """Pressure sensor at B: what it reads at no pressure."""
    hysteresis_pa: float = 0.0
    """Both sensors: half of what a reading differs by on the way up and down."""
    bow_pa: float = 0.0
    """Both sensors: what a reading is off by in the middle of the range."""
    drift_a_pa_s: float | None = None
    """Pressure sensor at A: by which its zero moves."""
    pressure_delay_s: float = 0.0
    """Both sensors read so late."""
    encoder_offset: float = 0.0
    """m, of a rotation joint rad; added to the reading."""
    play_rad: float = 0.0
    """Half of what a rotation joint moves before its encoder follows."""


@dataclass
class HiddenRope:
    """One rope: what its load pin adds, and where its anchor is."""

    tension_gain_error: float = 0.0
    """The load pin reads so much more of the tension."""
    tension_zero_n: float = 0.0
    """What the load pin of a slack rope reads."""
    azimuth_rad: float = 0.0
    """The anchor, seen from the robot, is turned to the left in the slope's plane."""
    elevation_rad: float = 0.0
    """... and raised off the slope."""
    attachment_height_m: float = 0.0
    """Added to the height at which it pulls, body frame."""


@dataclass
class HiddenFoot:
    """The ground under one foot."""

    settling_m_s: float = 0.0
    """How fast it gives way under a loaded foot,"""
    settling_depth_m: float = 0.0
    """and how far."""
    friction: float | None = None
    """Coefficient; None: as the ground has it."""


@dataclass
class HiddenMass:
    """A mass fixed to the body at a point (3) of its frame, m."""

    mass_kg: float
    position_m: tuple[float, float, float]


@dataclass
class Hidden:
    """Everything that effects may change in a world."""

    cylinders: dict[str, HiddenCylinder] = field(
        default_factory=lambda: {axis: HiddenCylinder() for axis in AXES}
    )
    ropes: dict[str, HiddenRope] = field(
        default_factory=lambda: {f"rope_{side}": HiddenRope() for side in SIDES}
    )
    feet: dict[str, HiddenFoot] = field(
        default_factory=lambda: {f"foot_{leg}": HiddenFoot() for leg in LEGS}
    )
    body_masses: list[HiddenMass] = field(default_factory=list)
    centre_of_mass_m: tuple[float, float, float] = (0.0, 0.0, 0.0)
    """Shift of the body's centre of mass, body frame."""
    hinges_m: dict[str, tuple[float, float, float]] = field(default_factory=dict)
    """Leg -> shift of its rotation joint, body frame."""
    unit_roll_rad: float = 0.0
    unit_pitch_rad: float = 0.0
    """How the inertial unit is mounted: added to what it reads."""
    rope_stiffness_factor: float = 1.0
    thrust_factor: float = 1.0
    pump_flow_factor: float = 1.0
    pump_pressure_factor: float = 1.0
    droop_pa_s_m3: float | None = None
    droop_s: float = 1.0

    def at(self, place: str) -> Any:
        """What is hidden at a place: of a cylinder, a rope or a foot; elsewhere, all else."""
        return {**self.cylinders, **self.ropes, **self.feet}.get(place, self)
