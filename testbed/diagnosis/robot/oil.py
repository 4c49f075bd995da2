"""The oil of twelve cylinders: what the flow balance of each chamber misses, as means over bins.

    Q + (leaks) -+ A v - (V / beta + hose) dp/dt = 0,   Q of the declared valve, its edges and its
    load-holding valve

Volumes and compressed oil are differences over a bin, so no derivative is taken; the valve's flow
is a mean of samples. What a sound cylinder's balance may miss: oil_evidence.py.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from testbed.diagnosis.robot.believed_valve import Asks, BelievedValve, Flow, edge_leaks
from testbed.diagnosis.robot.bin_edge_noise import flicker_pa, told_share
from testbed.diagnosis.robot.bins import Bins, Frame
from testbed.diagnosis.robot.piston_positions import play, rounding
from testbed.effects.hydraulics_air import free_share
from testbed.effects.hydraulics_hose import HOSE_TIMES_S, hose_flow_m3_s
from testbed.formats.arrays import Array, Flags
from testbed.laws.holding import NO_HOLDING
from testbed.machine.groups import Valve
from testbed.machine.model import Axis
from testbed.machine.names import AXES
from testbed.robot.robot import Robot

VOID_PA, FULL_PA = 0.7e5, 1.5e5
"""Below the first a chamber may hold a void, that much higher it surely does not (E)."""
PRESSURE_OFF_PA = 1.5e5
"""A pressure drop across an edge is known to this: sensors, lines, a swing within a bin (E)."""
TURNED_PA = 5.0e5
"""So much may a pressure be off that reads more than the supply behind an open edge (E)."""
HYSTERESIS_SDS = 1.5
"""By so many standard deviations of its hysteresis a valve is tried (E)."""
STEP, READING_STEP_PA = 1e-3, 2.0e4
"""Steps of the spool (1: its travel) and of pressures by which derivatives are taken."""
WRONG_PA = 3.0e5
"""A sensor that reads wrong, beside the declared one: by as much as is looked for."""
WIDE = 0.05
"""A wide overlap, beside the declared one: of the size that is looked for."""


@dataclass(frozen=True, eq=False)
class Oil:
    """One cylinder's oil in n bins. Arrays are (n, 2), chambers A and B, and m3/s into the chamber
    unless they say otherwise.

    `by_...` is what the balance misses where the model lacks one unit of something: what is missing
    is then the sum of these, each times its size, and noise.
    """

    pressure_pa: Array
    missing: Array
    """Believed inflow less what the chamber took up: + where more is believed to enter than it
    got.
    """
    from_supply: Array
    """Believed flow from the supply."""
    to_tank: Array
    """Believed flow to the tank, negative."""
    asks: Asks
    by_spool: Array
    """By a spool that is one whole travel less far out than believed."""
    by_pressure: Array
    """By pressures that are off by PRESSURE_OFF_PA, or by TURNED_PA where they are above the
    supply's; a size, without sign.
    """
    by_reading: Array
    """By sensors that read 1 Pa too much."""
    by_wrong_reading: Array
    """The same, were they as ones that read WRONG_PA too much or too little: flows go with the root
    of a drop, which near no drop is far from straight.
    """
    void: Array
    """How surely a chamber is not full of oil, 0 to 1: nobody knows what flows then."""
    compressed: Array
    """Size of what goes into compressed oil."""
    by_deadband: Array
    """By an overlap that is wider by the spool's whole travel, were that as one that is slightly
    wider.
    """
    by_wide_deadband: Array
    """The same, were it as one that is WIDE: what the valve still lets through is cut off, not
    turned round.
    """
    by_hysteresis: Array
    """By one standard deviation more of the valve's hysteresis than is expected."""
    by_leak: Array
    """Flow by 1 m3/(s Pa) of leakage across the piston."""
    by_air: Array
    """By a share 1 of free air, where the pressure's change is no noise."""
    by_softness: Array
    """By 1 / bulk modulus, 1/Pa, likewise."""
    by_hose: Array
    """(n, hoses, 2) by 1 m3/Pa of each hose of hydraulics.hose at A."""
    swept_m2: Array
    """(2,) by a metre of the piston, into chambers A and B."""
    rounding_m: Array
    """(n + 1,) standard deviation of the encoder's rounding at the bins' edges."""
    play_m: Array
    """(3, n + 1) standard deviation of where the joint is within its play, likewise; see `play`."""
    by_lateness: Array
    """By sensors that read 1 s late, were pressures to go on as they do."""
    by_edge_leak: Array
    """(n, 2, 2) by 1 m3/(s Pa) of the edge from the supply and of that to the tank."""
    flickers: Array
    """(n, 2) standard deviation by what the pressures at a bin's edges have of ripple and noise:
    little where samples come often.
    """


def oil_of(data: Mapping[str, Array], bins: Bins, frame: Frame, robot: Robot) -> tuple[Oil, ...]:
    """Every cylinder's oil, AXES order."""
    return tuple(_of_axis(i, data, bins, frame, robot) for i in range(len(AXES)))


def _of_axis(i: int, data: Mapping[str, Array], bins: Bins, frame: Frame, robot: Robot) -> Oil:
    machine, axis = robot.machine, robot.machine.axes[AXES[i]]
    time_s, command, supply_pa, a_pa, b_pa = (
        np.asarray(data[name], dtype=float)
        for name in ("t", f"valve_{AXES[i]}", "supply_pressure", *_pressures_of(AXES[i]))
    )
    tank_pa = machine.power_unit.tank_pressure_pa
    valve = BelievedValve(axis, command, time_s, (a_pa, b_pa, supply_pa), tank_pa, frame)
    flow = valve.flow()
    oil = _Chambers.of(axis, bins, i, robot.linkages.stroke_m[i])
    leak, edge_leak = _leaks(axis, bins, oil, flow, tank_pa)
    air = _by_air((a_pa, b_pa), oil, frame)
    compressed = oil.squeezed / axis.oil.bulk_modulus_pa + axis.oil.entrained_air * air
    by_reading = valve.flow(more_pa=READING_STEP_PA).less(flow) / READING_STEP_PA
    flicker = [flicker_pa(axis, one, frame) for one in (a_pa, b_pa)]
    edges = [frame.at_edges(one) for one in (a_pa, b_pa)]
    told = np.column_stack([told_share(*pair) for pair in zip(edges, flicker, strict=True)])
    return Oil(
        pressure_pa=oil.pressure_pa,
        missing=_missing(axis, flow, oil, compressed, leak, edge_leak),
        from_supply=flow.from_supply,
        to_tank=flow.to_tank,
        asks=valve.asks(),
        by_spool=-valve.flow(spool=STEP).less(flow) / STEP,
        by_pressure=_by_pressure(valve, oil.pressure_pa > bins.supply_pa[:, None]),
        by_reading=by_reading,
        by_wrong_reading=valve.flow(more_pa=WRONG_PA).less(valve.flow(more_pa=-WRONG_PA))
        / (2.0 * WRONG_PA),
        by_lateness=oil.takes_up_m3_pa * oil.quickens - by_reading * oil.rise_pa_s,
        compressed=np.abs(compressed),
        void=np.clip(1.0 - (oil.pressure_pa - VOID_PA) / FULL_PA, 0.0, 1.0),
        by_deadband=-valve.flow(overlap=STEP).less(flow) / STEP,
        by_wide_deadband=-valve.flow(overlap=WIDE).less(flow) / WIDE,
        by_hysteresis=-valve.flow(hysteresis_sds=HYSTERESIS_SDS).less(flow) / HYSTERESIS_SDS,
        by_leak=-leak,
        by_edge_leak=-edge_leak,
        by_air=told * air,
        by_softness=told * oil.squeezed,
        by_hose=_by_hoses(a_pa, frame),
        swept_m2=oil.swept_m2,
        rounding_m=rounding(bins, i, axis),
        play_m=play(bins, i, axis),
        flickers=oil.takes_up_m3_pa * np.column_stack(flicker) / (frame.width * frame.period_s),
    )


def _pressures_of(axis: str) -> tuple[str, str]:
    """Columns of its chambers' pressures."""
    return f"pressure_a_{axis}", f"pressure_b_{axis}"


@dataclass(frozen=True, eq=False)
class _Chambers:
    """Chambers A and B of one cylinder in n bins, (n, 2) each."""

    pressure_pa: Array
    rise_pa_s: Array
    """How fast the pressure rises."""
    quickens: Array
    """How fast that grows, Pa/s2."""
    volume_m3: Array
    takes_up_m3_pa: Array
    """What a chamber and its hose take up by 1 Pa more."""
    swept: Array
    """What the piston makes room for, m3/s."""
    swept_m2: Array
    """(2,) by a metre of the piston."""

    @property
    def squeezed(self) -> Array:
        """What oil of a bulk modulus of 1 Pa would take up, m3 Pa/s."""
        return self.volume_m3 * self.rise_pa_s

    @classmethod
    def of(cls, axis: Axis, bins: Bins, i: int, stroke_m: float) -> _Chambers:
        """Of cylinder i, AXES order."""
        area_a, area_b = axis.cylinder.areas_m2
        pressure = np.column_stack([bins.pressure_a_pa[:, i], bins.pressure_b_pa[:, i]])
        rise = np.column_stack([bins.pressure_a_rate[:, i], bins.pressure_b_rate[:, i]])
        volume = _volumes_m3(axis, bins.extension_m[:, i], stroke_m)
        swept_m2 = np.array([area_a, -area_b])
        return cls(
            pressure_pa=pressure,
            rise_pa_s=rise,
            quickens=np.gradient(rise, bins.time_s, axis=0),
            volume_m3=volume,
            takes_up_m3_pa=_taken_up(axis, volume, pressure),
            swept=bins.speed_m_s[:, i, None] * swept_m2,
            swept_m2=swept_m2,
        )


def _missing(
    axis: Axis, flow: Flow, oil: _Chambers, compressed: Array, leak: Array, edge_leak: Array
) -> Array:
    """(n, 2) believed inflow less what the chambers took up, m3/s."""
    seeps = np.einsum("nce,ce->nc", edge_leak, edge_leaks(axis.valve))
    inflow = flow.from_supply + flow.to_tank + seeps + axis.oil.internal_leakage_m3_s_pa * leak
    widened = oil.rise_pa_s * _hoses_m3_pa(axis)
    return np.asarray(inflow - oil.swept - compressed - widened)


def _leaks(
    axis: Axis, bins: Bins, oil: _Chambers, flow: Flow, tank_pa: float
) -> tuple[Array, Array]:
    """What comes in by 1 m3/(s Pa) of leakage: across the piston (n, 2), and through each chamber's
    edges from the supply and to the tank (n, 2, 2).
    """
    warmer_k = bins.oil_degc - axis.oil.declared_at_degc
    thinner = np.exp(axis.seal.viscosity_rate_1_k * warmer_k)
    pressure = oil.pressure_pa
    across = (thinner * (pressure[:, 0] - pressure[:, 1]))[:, None] * np.array([-1.0, 1.0])
    drops = np.stack([bins.supply_pa[:, None] - pressure, tank_pa - pressure], axis=2)
    return across, _past_holding(axis.valve, thinner[:, None, None] * drops, flow)


def _by_pressure(valve: BelievedValve, above_supply: Flags) -> Array:
    """(n, 2) by how much flows may be off for pressures that are, m3/s."""
    low, high = valve.flow(more_pa=-PRESSURE_OFF_PA), valve.flow(more_pa=PRESSURE_OFF_PA)
    turned = valve.flow(more_pa=-TURNED_PA).from_supply
    return np.asarray(0.5 * np.abs(low.less(high)) + np.where(above_supply, turned, 0.0))


def _by_air(pressures_pa: tuple[Array, Array], oil: _Chambers, frame: Frame) -> Array:
    """(n, 2) flow into chambers by a share 1 of free air; pressures (samples,) of A and B."""
    free = [free_share(frame.at_edges(one).clip(0.0)) for one in pressures_pa]
    return -oil.volume_m3 * np.diff(np.column_stack(free), axis=0) / (frame.width * frame.period_s)


def _volumes_m3(axis: Axis, extension_m: Array, stroke_m: float) -> Array:
    """(n, 2) what chambers A and B hold at these extensions (n,)."""
    c, (area_a, area_b) = axis.cylinder, axis.cylinder.areas_m2
    a = c.dead_volume_a_m3 + area_a * extension_m
    return np.column_stack([a, c.dead_volume_b_m3 + area_b * (stroke_m - extension_m)])


def _past_holding(valve: Valve, edge: Array, flow: Flow) -> Array:
    """Leakage drops (n, 2, 2) of the edges, 0 where a shut load-holding valve lets nothing out of
    its chamber.
    """
    out, leaks = edge.copy(), edge_leaks(valve)
    for k, held in enumerate((valve.holding_a, valve.holding_b)):
        if held != NO_HOLDING:
            enters = flow.from_supply[:, k] + edge[:, k] @ leaks[k] > 0.0
            out[:, k] *= (enters | (flow.to_tank[:, k] < 0.0))[:, None]
    return out


def _taken_up(axis: Axis, volume_m3: Array, pressure_pa: Array) -> Array:
    """(n, 2) what a chamber and its hose take up by 1 Pa more, m3/Pa."""
    oil, gauge_pa = axis.oil, pressure_pa.clip(0.0)
    dissolves = free_share(gauge_pa) - free_share(gauge_pa + READING_STEP_PA)
    softness = 1.0 / oil.bulk_modulus_pa + oil.entrained_air * dissolves / READING_STEP_PA
    return np.asarray(volume_m3 * softness + _hoses_m3_pa(axis))


def _hoses_m3_pa(axis: Axis) -> tuple[float, float]:
    """What the hoses at A and B take up by 1 Pa more."""
    return axis.oil.hose_elasticity_m3_pa, axis.oil.hose_elasticity_b_m3_pa


def _by_hoses(pressure_a_pa: Array, frame: Frame) -> Array:
    """(n, hoses, 2) flow into hoses at A of 1 m3/Pa each."""
    flows = [
        frame.mean(hose_flow_m3_s(pressure_a_pa, 1.0, time, frame.period_s))
        for time in HOSE_TIMES_S
    ]
    return np.stack([np.column_stack([flow, np.zeros_like(flow)]) for flow in flows], axis=1)
