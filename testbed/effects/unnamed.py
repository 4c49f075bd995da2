"""unnamed: a generic correction for what no hypothesis explains; smooth, small, and without a claim to a cause."""

from __future__ import annotations

import numpy as np

from testbed.compiled import njit
from testbed.effects.base import Active, Effect, ParameterSpec
from testbed.effects.terms import Array, ForceTerms, Signals, Values

REST_S, SLOW_M_S = 1.0, 2e-3
"""Time in which a piston counts as rested, and the speed at which that is forgotten as fast as it is learnt."""


def basis(signals: Signals) -> dict[str, Array]:
    """Scaled generic terms of the force balance, each of shape (n,) and of order one."""
    velocity, position = signals.velocity_m_s, signals.position_m
    stroke = signals.known.stroke_m or 0.5
    xi = position / stroke - 0.5
    direction = velocity / (abs(velocity) + 2e-3)
    terms = {
        "bias": 0.0 * xi + 1.0,
        "position": xi,
        "position_2": xi**2,
        "direction_position": direction * xi,
        "velocity_2": velocity * abs(velocity) / 0.01,
        "velocity_position": velocity * xi / 0.1,
        "direction_rested": direction * rested(np.abs(velocity), 1.0 / signals.rate_hz),
    }
    for name, pressure in (("a", signals.pressure_a_pa), ("b", signals.pressure_b_pa)):
        if pressure is not None:
            p = pressure / 1e7
            terms |= {
                f"pressure_{name}": p,
                f"pressure_{name}_2": p**2,
                f"direction_pressure_{name}": direction * p,
            }
    if signals.oil_temperature_degc is not None:
        warmth = (signals.oil_temperature_degc - 30.0) / 20.0
        terms |= {"warmth": warmth, "direction_warmth": direction * warmth}
    return terms


@njit
def rested(speed_m_s: Array, period_s: float) -> Array:
    """How long ago the piston rested: 1 after a long rest, near 0 after some sliding; shape (n,)."""
    out = np.empty(speed_m_s.size)
    age = 0.0
    for k in range(speed_m_s.size):
        out[k] = age
        rate = (1.0 + speed_m_s[k] / SLOW_M_S) / REST_S
        settled = 1.0 / (1.0 + speed_m_s[k] / SLOW_M_S)
        age = settled + (age - settled) * np.exp(-rate * period_s)
    return out


NAMES = (
    "bias",
    "position",
    "position_2",
    "direction_position",
    "velocity_2",
    "velocity_position",
    "direction_rested",
    "pressure_a",
    "pressure_a_2",
    "direction_pressure_a",
    "pressure_b",
    "pressure_b_2",
    "direction_pressure_b",
    "warmth",
    "direction_warmth",
)


class Unnamed(Effect):
    """What no name covers, as a sum of generic terms."""

    kind = "unnamed"
    equation = "F = sum of generic terms in position, velocity, pressures and oil temperature"
    text = "something is missing that no name covers"
    parameters = tuple(
        ParameterSpec(n, "N", -1e6, 1e6, (-500.0, 500.0), "weight of the term", 0.0) for n in NAMES
    )

    def force(self, signals: Signals, terms: ForceTerms, values: Values) -> None:
        """The sum of the terms that are used; the others need not even have their channel."""
        used = {name: value for name, value in values.items() if value}
        terms.force_n = terms.force_n - used.pop("bias", 0.0)
        if used:
            columns = basis(signals)
            for name in (n for n in used if n in columns):
                terms.force_n = terms.force_n - used[name] * columns[name]

    def active(self) -> Active:
        """All terms there, and none of them of any weight yet."""
        return Active(self, self.complete({}))


UNNAMED = Unnamed()
