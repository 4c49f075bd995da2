"""What effects act on: the channels of one axis, and the believed balances of its forces and its
oil.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from typing import Any

from testbed.formats.arrays import Array
from testbed.recording.known import Known

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

    def with_(self, **changes: Any) -> Signals:
        """A copy with some channels replaced."""
        return replace(self, **changes)


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
