"""A named effect: parameters with bounds and prior, its equation, and what it does to the believed balances."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from testbed.errors import InputError
from testbed.recording.known import Known

Array = npt.NDArray[np.float64]
Values = Mapping[str, float]


@dataclass(frozen=True, eq=False)
class Signals:
    """Channels of one axis on a uniform time grid, SI, each of shape (n,); pressures gauge.

    `velocity_m_s`, `acceleration_m_s2` come from the encoder and are smoothed like every other channel.
    In a drive `actuator_force_n` stands for the pressures.
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
    """Acceleration smoothed far more, given while fitting: the encoder's noise in it is no longer a part of the
    residual, so an added mass is not drawn towards cancelling that noise."""
    place: str = ""
    """Of several like axes, the one that these are the signals of: `rl_vertical`."""

    def with_(self, **changes: Any) -> Signals:
        """A copy with some channels replaced."""
        return replace(self, **changes)


@dataclass
class ForceTerms:
    """The believed force balance, to be changed by effects; every entry a number or an array of shape (n,).

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
    """(stiffness N/m, damping N s/m, shape) of the bristle that replaces equation (5) by its dynamic form."""
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


@dataclass(frozen=True)
class ParameterSpec:
    """A parameter: hard bounds of what is physical, and the range in which 90 % of cases are expected."""

    name: str
    unit: str
    low: float
    high: float
    prior: tuple[float, float]
    text: str
    default: float | None = None
    """Where given, the parameter is a further shape beyond the contract's formula and may be left out."""


SensorLaw = Callable[[Signals, Values], Signals]
ForceLaw = Callable[[Signals, ForceTerms, Values], None]
FlowLaw = Callable[[Signals, FlowTerms, Values], None]


@dataclass(frozen=True)
class Effect:
    """A named effect.

    `correct`: measured signals -> what the sensors should have read (sensor effects only).
    `force`, `flow`: how it changes the believed balances. `law`: the plain scalar function that a world applies
    (None where the name of the parameter is the law itself, such as an added mass).
    """

    name: str
    equation: str
    text: str
    parameters: tuple[ParameterSpec, ...]
    needs: tuple[str, ...] = ("position",)
    kinds: tuple[str, ...] = ("vertical-leg", "cylinder", "drive")
    correct: SensorLaw | None = None
    force: ForceLaw | None = None
    flow: FlowLaw | None = None
    law: Callable[..., Any] | None = None
    seen_in: tuple[str, ...] = ("force",)

    def spec(self, parameter: str) -> ParameterSpec:
        """The specification of a parameter. Raises InputError for an unknown one."""
        for spec in self.parameters:
            if spec.name == parameter:
                return spec
        raise InputError(
            f"effect {self.name} has no such parameter",
            field=parameter,
            allowed=", ".join(p.name for p in self.parameters),
        )

    @property
    def required(self) -> tuple[str, ...]:
        """Names of the parameters of the contract's formula."""
        return tuple(p.name for p in self.parameters if p.default is None)

    def complete(
        self, values: Mapping[str, Any], file: str | Path | None = None, field: str | None = None
    ) -> dict[str, float]:
        """`values` checked against the bounds, with defaults for further shapes.

        Raises InputError; `field` is where in `file` the values are.
        """
        group = self.name if field is None else field
        for name in values:
            if name not in {p.name for p in self.parameters}:
                raise InputError(
                    "unknown parameter",
                    file=file,
                    field=f"{group}.{name}",
                    allowed=", ".join(p.name for p in self.parameters),
                )
        out: dict[str, float] = {}
        for spec in self.parameters:
            value = values.get(spec.name, spec.default)
            if value is None:
                raise InputError(
                    f"effect {self.name} lacks parameter {spec.name!r}",
                    file=file,
                    field=field,
                    allowed=spec.text,
                )
            if (
                isinstance(value, bool)
                or not isinstance(value, (int, float))
                or not spec.low <= value <= spec.high
            ):
                raise InputError(
                    "out of bounds",
                    file=file,
                    field=f"{group}.{spec.name}",
                    value=value,
                    allowed=f"{spec.low:g} to {spec.high:g} {spec.unit}",
                )
            out[spec.name] = float(value)
        return out
