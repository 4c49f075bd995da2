"""unnamed: a generic correction for what no hypothesis explains; smooth, small, and without a claim
to a cause.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping

import numpy as np

from testbed.compiled import njit
from testbed.effects.active import Active
from testbed.effects.base import Effect
from testbed.effects.parameter_spec import ParameterSpec
from testbed.effects.terms import ForceTerms, Signals, Values
from testbed.formats.arrays import Array

REST_S, SLOW_M_S = 1.0, 2e-3
"""Time in which a piston counts as rested, and the speed at which that is forgotten as fast as it
is learnt.
"""
SLIDING_M_S = {"2_mm_s": 2e-3, "5_mm_s": 5e-3, "10_mm_s": 1e-2, "20_mm_s": 2e-2}
"""Speeds by which friction has turned over, as hyperbolic tangents."""
STOPS_M = {"100_um": 1e-4, "300_um": 3e-4, "1_mm": 1e-3, "3_mm": 3e-3, "10_mm": 1e-2}
"""Travels after a turn in which friction has turned over, as elastic stops."""

AT_PRESSURES = {
    "friction_below": -0.5,
    "friction_at_lowest": 0.0,
    "friction_at_quarter": 0.25,
    "friction_at_half": 0.5,
    "friction_at_three_quarters": 0.75,
    "friction_at_highest": 1.0,
    "friction_above": 1.5,
}
"""Friction at pressures of A between the lowest and the highest that the correction was fitted on,
as shares of the way: straight between them, held beyond the first and the last."""

EDGES: Mapping[str, tuple[str, str]] = {
    "pressure_a_pa": ("lowest_pressure_a_pa", "highest_pressure_a_pa"),
    "pressure_b_pa": ("lowest_pressure_b_pa", "highest_pressure_b_pa"),
    "oil_temperature_degc": ("coldest_degc", "warmest_degc"),
    "position_m": ("lowest_position_m", "highest_position_m"),
    "velocity_m_s": ("fastest_back_m_s", "fastest_out_m_s"),
}
"""Channel -> parameters between which a correction knows it: beyond, its terms stay as they are at
the edge."""
NO_EDGE = 1e12
"""Farther out than any channel goes, in its unit."""
_UNITS = {"_pa": "Pa", "_degc": "degC", "_m_s": "m/s", "_m": "m"}


def edge_unit(edge: str) -> str:
    """The unit that the name of an edge ends in."""
    return next(unit for ending, unit in _UNITS.items() if edge.endswith(ending))


def edges_of(seen: Iterable[Signals]) -> dict[str, float]:
    """Parameter of an edge -> the lowest or highest value of its channel in these signals."""
    found: dict[str, float] = {}
    for signals in seen:
        for channel, (low, high) in EDGES.items():
            values = getattr(signals, channel)
            if values is not None:
                found[low] = min(found.get(low, NO_EDGE), float(np.min(values)))
                found[high] = max(found.get(high, -NO_EDGE), float(np.max(values)))
    return found


def within(signals: Signals, edges: Mapping[str, float]) -> Signals:
    """The signals with every channel held between its edges."""
    held = {}
    for channel, (low, high) in EDGES.items():
        values = getattr(signals, channel)
        if values is not None and (low in edges or high in edges):
            held[channel] = np.clip(values, edges.get(low, -NO_EDGE), edges.get(high, NO_EDGE))
    return signals.with_(**held)


def correction_terms(signals: Signals, edges: Mapping[str, float]) -> dict[str, Array]:
    """All terms, each of shape (n,) and of order one, held at the edges; how far a stop is bent is
    told by the whole travel.
    """
    held = within(signals, edges)
    return basis(held) | friction_shapes(held, signals.position_m)


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
            scaled = pressure / 1e7
            terms |= {
                f"pressure_{name}": scaled,
                f"pressure_{name}_2": scaled**2,
                f"direction_pressure_{name}": direction * scaled,
            }
    if signals.oil_temperature_degc is not None:
        warmth = (signals.oil_temperature_degc - 30.0) / 20.0
        terms |= {"warmth": warmth, "direction_warmth": direction * warmth}
    return terms


@njit
def rested(speed_m_s: Array, period_s: float) -> Array:
    """How long ago the piston rested: 1 after a long rest, near 0 after some sliding; shape
    (n,).
    """
    out = np.empty(speed_m_s.size)
    age = 0.0
    for index in range(speed_m_s.size):
        out[index] = age
        rate = (1.0 + speed_m_s[index] / SLOW_M_S) / REST_S
        settled = 1.0 / (1.0 + speed_m_s[index] / SLOW_M_S)
        age = settled + (age - settled) * np.exp(-rate * period_s)
    return out


def friction_shapes(signals: Signals, travel_m: Array) -> dict[str, Array]:
    """Scaled terms of a friction that turns over gradually, with speed or with travel (n,); each of
    shape (n,), order one.

    With a pressure each stands twice: as it is, and times the pressure of A, which presses a seal
    on.
    """
    velocity = signals.velocity_m_s
    shapes = {f"sliding_{name}": np.tanh(velocity / speed) for name, speed in SLIDING_M_S.items()}
    shapes |= {f"stop_{name}": stop(travel_m, way) for name, way in STOPS_M.items()}
    terms = shapes | {"velocity": velocity / 0.1, "speed": np.abs(velocity) / 0.1}
    if signals.pressure_a_pa is not None:
        scaled = signals.pressure_a_pa / 1e7
        terms |= {f"pressure_{name}": scaled * values for name, values in shapes.items()}
    return terms


@njit
def stop(position_m: Array, travel_m: float) -> Array:
    """Stretch of a spring that slides when it is stretched by `travel_m`, as a share of that; shape
    (n,).
    """
    out = np.empty(position_m.size)
    stretch, last = 0.0, position_m[0]
    for index in range(position_m.size):
        stretch = min(max(stretch + position_m[index] - last, -travel_m), travel_m)
        last = position_m[index]
        out[index] = stretch / travel_m
    return out


def friction_at_pressures(signals: Signals, edges: Mapping[str, float]) -> dict[str, Array]:
    """Share that each of AT_PRESSURES has of the friction at the samples' pressure, with the way
    that the piston slides; each of shape (n,), between -1 and 1; none without a pressure or its
    edges.
    """
    low, high = (edges.get(edge) for edge in EDGES["pressure_a_pa"])
    if signals.pressure_a_pa is None or low is None or high is None or high <= low:
        return {}
    way = (signals.pressure_a_pa - low) / (high - low)
    direction = np.tanh(signals.velocity_m_s / SLIDING_M_S["2_mm_s"])
    knots, each = list(AT_PRESSURES.values()), np.eye(len(AT_PRESSURES))
    return {
        name: direction * np.interp(way, knots, each[index])
        for index, name in enumerate(AT_PRESSURES)
    }


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
_SHAPES = (*(f"sliding_{name}" for name in SLIDING_M_S), *(f"stop_{name}" for name in STOPS_M))
FRICTION_SHAPES = ("velocity", "speed", *_SHAPES, *(f"pressure_{name}" for name in _SHAPES))


class Unnamed(Effect):
    """What no name covers, as a sum of generic terms."""

    kind = "unnamed"
    equation = "F = sum of generic terms in position, velocity, pressures and oil temperature"
    text = "something is missing that no name covers"
    parameters = tuple(
        ParameterSpec(shape, "N", -1e6, 1e6, (-500.0, 500.0), "weight of the term", 0.0)
        for shape in (*NAMES, *FRICTION_SHAPES, *AT_PRESSURES)
    ) + tuple(
        ParameterSpec(
            edge,
            edge_unit(edge),
            -NO_EDGE,
            NO_EDGE,
            (-NO_EDGE, NO_EDGE),
            "what the correction knows ends here",
            (-NO_EDGE, NO_EDGE)[side],
        )
        for edges in EDGES.values()
        for side, edge in enumerate(edges)
    )

    def force(self, signals: Signals, terms: ForceTerms, values: Values) -> None:
        """The sum of the terms that are used; the others need not even have their channel."""
        edges = {edge: values[edge] for pair in EDGES.values() for edge in pair if edge in values}
        used = {name: value for name, value in values.items() if value and name not in edges}
        terms.force_n = terms.force_n - used.pop("bias", 0.0)
        if used:
            columns = basis(held := within(signals, edges))
            if not used.keys() <= columns.keys():
                columns |= friction_shapes(held, signals.position_m)
                columns |= friction_at_pressures(signals, edges)
            for name in (shape for shape in used if shape in columns):
                terms.force_n = terms.force_n - used[name] * columns[name]

    def active(self) -> Active:
        """All terms there, and none of them of any weight yet."""
        return Active(self, self.complete({}))


UNNAMED = Unnamed()
