"""The oil of twelve cylinders: what the flow balance of each chamber misses, as means over bins.

    Q + (leaks) -+ A v - (V / beta + hose) dp/dt = 0,   Q of the declared valve, its edges and its
    load-holding valve

Volumes and compressed oil are differences over a bin, so no derivative is taken; the valve's flow
is a mean of samples.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from testbed.diagnosis.robot.bins import Bins, Frame
from testbed.diagnosis.robot.evidence import RawGroup
from testbed.diagnosis.robot.flicker import flicker_pa, of_shared_edges
from testbed.diagnosis.robot.places import play, played, rounded, rounding, swept
from testbed.diagnosis.robot.rig import through_amplifier
from testbed.diagnosis.robot.tolerances import LATE_S, middle, standard_deviation
from testbed.diagnosis.robot.valve_edges import through_edges
from testbed.effects.hydraulics_air import free_share
from testbed.effects.hydraulics_hose import HOSE_TIMES_S, hose_flow_m3_s
from testbed.estimation.leg.flow import spool
from testbed.laws.holding import NO_HOLDING
from testbed.machine.groups import Valve
from testbed.machine.model import Axis, Machine
from testbed.machine.names import AXES
from testbed.machine.scale import Scale
from testbed.robot.robot import Robot

Array = npt.NDArray[np.float64]
WHITE_M3_S = 2.0e-6
"""Noise of a bin beside the encoder's rounding (E)."""
VALVE_SHARE, MEMORY_S = 0.03, 0.5
"""A valve's flow is known to this share, and its deviation lasts so long (E)."""
VOID_PA, FULL_PA, VOID_M3_S = 0.7e5, 1.5e5, 8.0e-5
"""Below the first a chamber may hold a void, that much higher it surely does not (E)."""
ZERO_PA = 4.0e4
"""Zeros of a sensor and its line, at any warmth (E)."""
COMPRESSED_SHARE = 0.15
"""Oil in which air goes in and out of solution is known to this share beside its tolerances (E)."""
CUT_OFF = 0.003
"""An overlap that is wider than declared within its tolerance cuts small openings off as a wide one
does (B).
"""
SEEPS_M3_S = 7.0e-7
"""What seeps through a valve whose spool lies at the edge of its overlap (E)."""
SPOOL_OFF = 0.002
"""The spool's place is known to this share of its travel: play, amplifier (E)."""
PRESSURE_OFF_PA = 1.5e5
"""A pressure drop across an edge is known to this: sensors, lines, a swing within a bin (E)."""
TURNED_PA = 5.0e5
"""So much may a pressure be off that reads more than the supply behind an open edge (E)."""
HOSE_M3_PA = 3.0e-13
"""What hoses of any machine may take up, by each time in which they fill (E)."""
SOUND_LEAK_M3_S_PA = 1.0e-13
"""What passes the piston of a sound seal: 3e-14 to 2e-13 (D)."""
HYSTERESIS_SDS = 1.5
"""By so many standard deviations of its hysteresis a valve is tried (E)."""
STEP, READING_STEP_PA = 1e-3, 2.0e4
WIDE = 0.05
"""A wide overlap, beside the declared one: of the size that is looked for."""


@dataclass(frozen=True, eq=False)
class Asks:
    """What a cylinder asks of the supply, by sample."""

    load_pa: Array
    """(3, samples) pressure behind the port that its valve opens to the supply, were the overlap as
    declared, at the least and at the most of its tolerance; 0 while it opens none.
    """
    drawn_m3_s: Array
    """(samples,)"""


@dataclass(frozen=True, eq=False)
class Oil:
    """One cylinder's oil in n bins; arrays (n, 2) are of chambers A and B, m3/s into the
    chamber.
    """

    pressure_pa: Array
    missing: Array
    """Believed inflow less what the chamber took up: + where more is believed to enter than it
    got.
    """
    from_supply: Array
    """Believed flow from the supply; `to_tank` likewise (negative)."""
    asks: Asks
    to_tank: Array
    by_spool: Array
    """What the balance misses by a spool that is one whole travel less far out than believed;
    `by_...` likewise by one unit of what the model lacks.
    """
    by_pressure: Array
    """What it may miss by pressures that are off by PRESSURE_OFF_PA; by TURNED_PA above supply."""
    by_reading: Array
    """By a sensor that reads 1 Pa too much."""
    void: Array
    """How surely a chamber is not full of oil, 0 to 1: nobody knows what flows then."""
    compressed: Array
    """Size of what goes into compressed oil."""
    by_deadband: Array
    """For a tolerance; `by_wide_deadband` by a travel's worth of an overlap that is WIDE: what the
    valve still lets through is cut off, not turned round.
    """
    by_wide_deadband: Array
    by_hysteresis: Array
    """By one standard deviation more of the valve's hysteresis than is expected."""
    by_leak: Array
    """Flow by 1 m3/(s Pa) of leakage across the piston."""
    by_air: Array
    """By a share 1 of free air."""
    by_softness: Array
    """By 1 / bulk modulus, 1/Pa."""
    by_hose: Array
    """(n, hoses, 2) by 1 m3/Pa of each hose of hydraulics.hose at A."""
    swept_m2: Array
    """(2,) by a metre of the piston, into chambers A and B."""
    rounding_m: Array
    """(n + 1,) standard deviation of the encoder's rounding at the bins' edges; `play_m` (2, n + 1)
    likewise of where the joint is within its play.
    """
    play_m: Array
    by_lateness: Array
    """By a sensor that reads 1 s late, were pressures to go on as they do."""
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
    time = np.asarray(data["t"], dtype=float)
    ordered = np.asarray(data[f"valve_{AXES[i]}"], dtype=float)

    def placed(valve: Valve) -> Array:
        command = through_amplifier(ordered, time, valve)
        return spool(command, 1.0 / frame.period_s, valve.natural_frequency_hz, valve.damping)

    place, lagging = placed(_expected(axis.valve)), placed(_expected(axis.valve, HYSTERESIS_SDS))
    samples = [np.asarray(data[f"pressure_{c}_{AXES[i]}"], dtype=float) for c in "ab"]
    supply = np.asarray(data["supply_pressure"], dtype=float)
    tank, bin_s = machine.power_unit.tank_pressure_pa, frame.width * frame.period_s

    def of_samples(at: Array, wider: float, more_pa: float) -> list[tuple[Array, Array]]:
        overlap = axis.valve.deadband + wider
        read = (samples[0] + more_pa, samples[1] + more_pa, supply)
        return [through_edges(axis, k, at, overlap, read, tank) for k in range(2)]

    def through(
        shift: float, wider: float, more_pa: float = 0.0, at: Array = place
    ) -> tuple[Array, Array]:
        found = of_samples(at + shift, wider, more_pa)
        return tuple(np.column_stack([frame.mean(one[side]) for one in found]) for side in range(2))  # type: ignore[return-value]

    supplied, drained = through(0.0, 0.0)
    shifted, wider, wide = through(STEP, 0.0), through(0.0, STEP), through(0.0, WIDE)
    late = through(0.0, 0.0, at=lagging)
    over = through(0.0, 0.0, READING_STEP_PA)
    low, high = (through(0.0, 0.0, way * PRESSURE_OFF_PA) for way in (-1.0, 1.0))
    turned = through(0.0, 0.0, -TURNED_PA)[0]
    oil, (area_a, area_b) = axis.oil, axis.cylinder.areas_m2
    volume = _volumes_m3(axis, bins.extension_m[:, i], robot.linkages.stroke_m[i])
    p = np.column_stack([bins.pressure_a_pa[:, i], bins.pressure_b_pa[:, i]])
    rise = np.column_stack([bins.pressure_a_rate[:, i], bins.pressure_b_rate[:, i]])
    squeezed = volume * rise
    free = np.column_stack([free_share(frame.at_edges(one).clip(0.0)) for one in samples])
    by_air = -volume * np.diff(free, axis=0) / bin_s
    swept = bins.speed_m_s[:, i, None] * np.array([area_a, -area_b])
    leaking = np.exp(axis.seal.viscosity_rate_1_k * (bins.oil_degc - oil.declared_at_degc))
    across = (leaking * (p[:, 0] - p[:, 1]))[:, None] * np.array([-1.0, 1.0])
    edge = leaking[:, None, None] * np.stack([bins.supply_pa[:, None] - p, tank - p], axis=2)
    edge = _past_holding(axis.valve, edge, supplied, drained)
    compressed = squeezed / oil.bulk_modulus_pa + oil.entrained_air * by_air
    seeps = np.einsum("nce,ce->nc", edge, _edge_leaks(axis.valve))
    missing = supplied + drained + seeps + oil.internal_leakage_m3_s_pa * across
    widened = rise * (oil.hose_elasticity_m3_pa, oil.hose_elasticity_b_m3_pa)
    missing = missing - swept - compressed - widened
    by_reading = (over[0] + over[1] - supplied - drained) / READING_STEP_PA
    quickens = np.gradient(rise, bins.time_s, axis=0)
    takes_up = _taken_up(axis, volume, p)
    return Oil(
        pressure_pa=p,
        missing=missing,
        from_supply=supplied,
        to_tank=drained,
        asks=_asks(axis, place, samples, of_samples(place, 0.0, 0.0)),
        by_spool=-(shifted[0] + shifted[1] - supplied - drained) / STEP,
        by_pressure=0.5 * np.abs(low[0] + low[1] - high[0] - high[1])
        + np.where(p > bins.supply_pa[:, None], turned, 0.0),
        by_reading=by_reading,
        by_lateness=takes_up * quickens - by_reading * rise,
        compressed=np.abs(compressed),
        void=np.clip(1.0 - (p - VOID_PA) / FULL_PA, 0.0, 1.0),
        by_deadband=-(wider[0] + wider[1] - supplied - drained) / STEP,
        by_hysteresis=-(late[0] + late[1] - supplied - drained) / HYSTERESIS_SDS,
        by_wide_deadband=-(wide[0] + wide[1] - supplied - drained) / WIDE,
        by_leak=-across,
        by_air=by_air,
        swept_m2=np.array([area_a, -area_b]),
        rounding_m=rounding(bins, i, axis),
        play_m=play(bins, i, axis),
        by_softness=squeezed,
        by_hose=_by_hoses(samples[0], frame),
        by_edge_leak=-edge,
        flickers=takes_up * [flicker_pa(axis, one, frame) for one in samples] / bin_s,
    )


def _volumes_m3(axis: Axis, extension_m: Array, stroke_m: float) -> Array:
    """(n, 2) what chambers A and B hold at these extensions (n,)."""
    c, (area_a, area_b) = axis.cylinder, axis.cylinder.areas_m2
    a = c.dead_volume_a_m3 + area_a * extension_m
    return np.column_stack([a, c.dead_volume_b_m3 + area_b * (stroke_m - extension_m)])


def _past_holding(valve: Valve, edge: Array, supplied: Array, drained: Array) -> Array:
    """Leakage drops (n, 2, 2) of the edges, 0 where a shut load-holding valve lets nothing out of
    its chamber; flows (n, 2).
    """
    out, leaks = edge.copy(), _edge_leaks(valve)
    for k, held in enumerate((valve.holding_a, valve.holding_b)):
        if held != NO_HOLDING:
            enters = supplied[:, k] + edge[:, k] @ leaks[k] > 0.0
            out[:, k] *= (enters | (drained[:, k] < 0.0))[:, None]
    return out


def _taken_up(axis: Axis, volume_m3: Array, pressure_pa: Array) -> Array:
    """(n, 2) what a chamber and its hose take up by 1 Pa more, m3/Pa."""
    oil, gauge_pa = axis.oil, pressure_pa.clip(0.0)
    dissolves = free_share(gauge_pa) - free_share(gauge_pa + READING_STEP_PA)
    softness = 1.0 / oil.bulk_modulus_pa + oil.entrained_air * dissolves / READING_STEP_PA
    return np.asarray(
        volume_m3 * softness + (oil.hose_elasticity_m3_pa, oil.hose_elasticity_b_m3_pa)
    )


def _asks(axis: Axis, place: Array, samples: list[Array], flows: list[tuple[Array, Array]]) -> Asks:
    """What the cylinder asks of the supply with its spool at these places; `flows`: each chamber's,
    from the supply and to the tank.
    """
    overlaps = [axis.valve.deadband + more for more in _overlaps(axis)]
    loads = np.array([_load(place, overlap, samples) for overlap in overlaps])
    return Asks(loads, np.sum([fed for fed, _ in flows], axis=0))


def _by_hoses(pressure_a_pa: Array, frame: Frame) -> Array:
    """(n, hoses, 2) flow into hoses at A of 1 m3/Pa each."""
    flows = [
        frame.mean(hose_flow_m3_s(pressure_a_pa, 1.0, time, frame.period_s))
        for time in HOSE_TIMES_S
    ]
    return np.stack([np.column_stack([flow, np.zeros_like(flow)]) for flow in flows], axis=1)


def _overlaps(axis: Axis) -> tuple[float, float, float]:
    """By how much the overlap may differ from what is declared: none, its least, its most."""
    off = 2.0 * standard_deviation("axes.*.valve.deadband", axis.valve.deadband)
    return 0.0, -off, off


def _load(place: Array, overlap: float, pressures_pa: list[Array]) -> Array:
    """(samples,) pressure behind the port that a spool at these places opens to the supply."""
    return np.where(
        place > overlap, pressures_pa[0], np.where(place < -overlap, pressures_pa[1], 0.0)
    )


def _edge_leaks(valve: Valve) -> Array:
    """(2, 2) leakage of each chamber's edges from the supply and to the tank, m3/(s Pa)."""
    return np.array(
        [
            [valve.edge_pa_leakage_m3_s_pa, valve.edge_at_leakage_m3_s_pa],
            [valve.edge_pb_leakage_m3_s_pa, valve.edge_bt_leakage_m3_s_pa],
        ]
    )


def _expected(valve: Valve, more: float = 0.0) -> Valve:
    """The valve with the hysteresis that one of its kind may be expected to have, or so many
    standard deviations more.
    """
    number = "axes.*.valve.hysteresis"
    half_width = middle(number, valve.hysteresis)
    half_width += more * standard_deviation(number, valve.hysteresis)
    return valve.model_copy(update={"hysteresis": half_width})


def tolerated(oil: Oil, axis: Axis, scale: Scale) -> Iterator[tuple[Array, float]]:
    """(change (n, 2), standard deviation) of everything that a sound cylinder's oil and valve may
    differ by.
    """
    valve, declared = axis.valve, axis.oil
    for k in range(2):
        alone = np.zeros(2)
        alone[k] = 1.0
        yield oil.from_supply * alone, 0.1
        yield oil.to_tank * alone, 0.1
        yield np.tile(alone, (len(oil.missing), 1)), scale.times("m3/s") * SEEPS_M3_S
        for edge, name in enumerate((("pa", "at"), ("pb", "bt"))[k]):
            column = np.zeros_like(oil.missing)
            column[:, k] = oil.by_edge_leak[:, k, edge]
            yield column, getattr(valve, f"edge_{name}_leakage_m3_s_pa")
        reading = np.zeros_like(oil.missing)
        reading[:, k] = oil.by_reading[:, k]
        yield reading, scale.times("Pa") * ZERO_PA
        yield reading * oil.pressure_pa, standard_deviation(f"sensor.gain_{'ab'[k]}@*.gain_error")
    yield oil.by_spool, SPOOL_OFF
    yield oil.by_deadband, max(standard_deviation("axes.*.valve.deadband", valve.deadband), 0.006)
    yield oil.by_wide_deadband, CUT_OFF
    yield oil.by_hysteresis, 1.0
    for k in range(2):
        late = np.zeros_like(oil.missing)
        late[:, k] = oil.by_lateness[:, k]
        yield late, LATE_S
    least = {"internal_leakage_m3_s_pa": scale.times("m3/(s Pa)") * SOUND_LEAK_M3_S_PA}
    for number, column in _by_oil(oil, axis).items():
        sd = _of_tolerance(standard_deviation, number, getattr(declared, number))
        yield column, max(sd, least.get(number, 0.0))
    for k in range(len(HOSE_TIMES_S)):
        yield (
            oil.by_hose[:, k],
            max(declared.hose_capacity_m3_pa, scale.times("m3/Pa") * HOSE_M3_PA),
        )


def _by_oil(oil: Oil, axis: Axis) -> dict[str, Array]:
    """What the balance misses by one unit more of each of the oil's numbers."""
    softer = -oil.by_softness / axis.oil.bulk_modulus_pa**2
    return {
        "internal_leakage_m3_s_pa": oil.by_leak,
        "bulk_modulus_pa": softer,
        "entrained_air": oil.by_air,
    }


def _of_tolerance(asked: Callable[[str, float], float], number: str, value: float) -> float:
    """What is asked of the tolerance of a number of the oil, each cylinder's or all cylinders'."""
    each, alike = f"axes.*.oil.{number}", f"oil.{number}"
    return asked(each if standard_deviation(each, value) > 0.0 else alike, value)


def expected(oil: Oil, axis: Axis) -> Array:
    """(n, 2) what is missing in the mean of sound machines: they do not lie about the drawing."""
    out = np.zeros_like(oil.missing)
    for number, column in _by_oil(oil, axis).items():
        value = getattr(axis.oil, number)
        out += (_of_tolerance(middle, number, value) - value) * column
    return out


def group_of(oil: Oil, i: int, machine: Machine, time_s: Array) -> RawGroup:
    """The group of cylinder i: chamber A's bins, then B's."""
    nothing, axis = np.zeros_like(oil.missing), machine.axes[AXES[i]]
    columns = [sd * c.T.ravel() for c, sd in tolerated(oil, axis, machine.scale) if sd > 0.0]
    playing = swept(oil.swept_m2, played(oil.play_m, time_s))
    return RawGroup(
        missing=(oil.missing - expected(oil, axis)).T.ravel(),
        time_s=np.tile(time_s, 2),
        noise=noise_of(oil, time_s, machine.scale.times("m3/s")) + playing,
        lasting=playing,
        tolerated=np.column_stack(columns),
        rows_of=lambda change: change.oil.get(i, nothing).T.ravel(),
    )


def noise_of(oil: Oil, time_s: Array, flows: float) -> Array:
    """Covariance (2 n, 2 n) of the group's rows beside what tolerances make; `flows`: what flows of
    this machine are beside ROBOCLIMBER's.
    """
    n = len(time_s)
    apart = np.abs(time_s[:, None] - time_s[None, :])
    lasts = np.exp(-apart / MEMORY_S)
    out = np.eye(2 * n) * (flows * WHITE_M3_S) ** 2
    size = VALVE_SHARE * np.abs(oil.from_supply + oil.to_tank)
    size = np.hypot(size, flows * VOID_M3_S * oil.void)
    size = np.sqrt(size**2 + oil.by_pressure**2 + (COMPRESSED_SHARE * oil.compressed) ** 2)
    off = SPOOL_OFF * oil.by_spool
    for k in range(2):
        own = slice(k * n, (k + 1) * n)
        out[own, own] += lasts * np.outer(size[:, k], size[:, k])
        out[own, own] += of_shared_edges(oil.flickers[:, k])
    both = off.T.ravel()
    out += np.tile(lasts, (2, 2)) * np.outer(both, both)
    return np.asarray(out + swept(oil.swept_m2, rounded(oil.rounding_m, time_s)))
