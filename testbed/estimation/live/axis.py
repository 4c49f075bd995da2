"""One cylinder, live: from pressures and encoder to the force of its piston, and friction as a set.
Compiled.

The force that drives the joint is F = pA A_A - pB A_B + F_end - F_f. Friction F_f is the paper's
(5), thinned by the oil's warmth, with what the machine's file declares beside it: it grows along
the stroke, with pressure, with side load and after a rest. Where the piston may be at rest,
friction is a set, and the middle of the set its likeliest value.
"""

from __future__ import annotations

import math
from typing import NamedTuple

from testbed.compiled import njit
from testbed.estimation.cylinder import (
    EXTENDING,
    RETRACTING,
    Conditions,
    Cylinder,
    Stribeck,
    chamber_pressure,
    clipped_reading_sd,
    extra_friction,
    friction_set,
    friction_size,
    piston_force,
    place_factor,
    side_load_factor,
    thinning_by_warmth,
)
from testbed.estimation.live import encoder
from testbed.formats.records import Record, part, quantity

END_ZONE_M = 1.0e-3
"""Nearer to a stop than this the stop of ROBOCLIMBER may carry any load (E)."""
END_FORCE_N = 4.0e4
"""What its stop may carry (E)."""


class AxisBelief(Record):
    """What is believed of one axis: its cylinder, and what the machine's file declares beside
    it.
    """

    cylinder = part(Cylinder, "cylinder, seals, sensors")
    encoder_resolution = quantity("m", "one count of the encoder, as extension")
    dwell_gain = quantity(
        "1", "more break-away friction after a long rest, as a share of Coulomb's"
    )
    dwell_time = quantity("s", "time constant of a rest with which it grows")
    end_cushion_length = quantity("m", "of the end cushion, a damper that grows towards either end")
    end_cushion_damping = quantity("N s/m", "of that damper at the end")
    thermal_sd = quantity("N/K", "standard deviation of the sensors' zero by warmth, as a force")


class AxisState(Record):
    """What is known of one axis."""

    encoder = part(encoder.EncoderState, "motion")
    dwell = quantity("1", "growth of its break-away friction by rest so far, up to dwell_gain")
    time = quantity("s", "since the start")
    force = quantity("N", "of the piston, without friction, along extension")
    friction = quantity("N", "likeliest friction")
    low = quantity("N", "lower end of friction's set")
    high = quantity("N", "upper end of friction's set")
    spread = quantity("N", "standard deviation of friction")
    use = quantity("1", "likeliest friction as a share of that end of its set, -1 to 1")
    across = quantity("N", "load across the rod")
    slides = quantity("1", "how surely it slides, 0 to 1")
    sense = quantity("1", "direction in which it slid last: -1, 0, 1")
    rested = quantity("s", "for how long it has been at rest")
    slid = quantity("s", "for how long it has surely slid in its present direction")
    has_slid = quantity("1", "1 once it has surely slid")
    speed = quantity("m/s", "of the piston")
    acceleration = quantity("m/s2", "of the piston, 0 at rest")
    changed = quantity("1", "1 where friction's set has just changed with the direction")


class Decisions(Record):
    """How the whole-body estimate decides, common to the axes."""

    dt = quantity("s", "step")
    observer = quantity("rad/s", "bandwidth of the encoders' observer")
    rest_speed = quantity("m/s", "slower than this a piston stands still")
    slide_speed = quantity("m/s", "faster than this it surely slides")
    friction_share = quantity("1", "sliding friction is known to this share")
    slow_share = quantity(
        "1", "further share for a piston that hardly moves: it may stick and slip"
    )
    slow_speed = quantity("m/s", "speed over which that decays")
    speed_sd = quantity("m/s", "standard deviation of the speed")
    rest_share = quantity("1", "standard deviation of friction at rest over its set's half width")
    fresh_more = quantity("1", "by which it is larger right after a stop, share of itself")
    fresh = quantity(
        "s", "time constant with which that decays: creep moves friction to the middle"
    )
    stuck_share = quantity("1", "rest_share of a piston that never slid")
    knows_dependence = quantity("1", "0/1: friction beyond (5)")
    end_zone = quantity("m", "nearer to a stop than this the stop may carry any load")
    end_force = quantity("N", "what a stop may carry")


class Loads(NamedTuple):
    """What acts on a rod, N."""

    along: float
    across: float


@njit
def cushion_n(x: float, v: float, belief: AxisBelief) -> float:
    """Declared end cushion, N along extension: a damper growing over the last stretch before either
    end.
    """
    length, damping = belief.end_cushion_length, belief.end_cushion_damping
    if length <= 0.0:
        return 0.0
    if v < 0.0 and x < length:
        return -damping * v * (length - max(x, 0.0)) / length
    left = belief.cylinder.stroke - x
    if v > 0.0 and left < length:
        return -damping * v * (length - max(left, 0.0)) / length
    return 0.0


@njit
def end_forces_n(c: Cylinder, x: float) -> float:
    """Offset, spring and cushion of a believed model, N along extension."""
    force = c.offset - c.spring_stiffness * (x - c.spring_rest)
    return force + c.cushion_stiffness * max(c.cushion_start - x, 0.0)


@njit
def conditions_of(
    state: AxisState,
    belief: AxisBelief,
    decisions: Decisions,
    pressures: float,
    loads: Loads,
    oil_degc: float,
) -> Conditions:
    """What changes (5) now; a rest ages the contact on the way. `pressures`: pA + pB, Pa."""
    if decisions.knows_dependence == 0.0:
        return Conditions(1.0, 0.0, 1.0, 0.0)
    together = pressures if math.isfinite(pressures) else 0.0  # a sample is missing
    c, rests, x = belief.cylinder, state.slides <= 0.0, state.encoder.extension
    aim = belief.dwell_gain if rests else 0.0
    state.dwell += (aim - state.dwell) * min(
        decisions.dt / belief.dwell_time if rests else 1.0, 1.0
    )
    return Conditions(
        place_factor(c, x),
        extra_friction(c, together, loads.along, loads.across * side_load_factor(c, x)),
        thinning_by_warmth(c, oil_degc),
        state.dwell,
    )


@njit
def step_axis(
    readings: tuple[float, float, float],
    loads: Loads,
    oil_degc: float,
    decisions: Decisions,
    belief: AxisBelief,
    state: AxisState,
) -> None:
    """One cylinder, one step: `state` moves on. readings: both pressures, Pa, and extension, m."""
    reading_a, reading_b, reading_m = readings
    dt, c, seen = decisions.dt, belief.cylinder, state.encoder
    pa = chamber_pressure(reading_a, c.sensor_a, state.time)
    pb = chamber_pressure(reading_b, c.sensor_b, state.time)
    state.time += dt
    resolution, slid_before = belief.encoder_resolution, state.slides
    encoder.observe(seen, reading_m, resolution, dt, decisions.observer)
    v = encoder.bounded_speed(seen, resolution, decisions.rest_speed)
    state.slides = encoder.sliding(seen, resolution, decisions.rest_speed, decisions.slide_speed)
    x, slides = seen.extension, state.slides
    state.speed = v
    state.acceleration = seen.acceleration if slides > 0.0 else 0.0
    piston = piston_force(pa, pb, c.area_a, c.area_b)
    state.force = piston + cushion_n(x, v, belief) + end_forces_n(c, x)
    now = conditions_of(state, belief, decisions, pa + pb, loads, oil_degc)
    low, high = friction_set(v, seen.sense, slides, c.friction, now)
    likely = 0.5 * (low + high)
    state.rested = state.rested + dt if slides <= 0.0 else 0.0
    if slides >= 1.0:
        state.has_slid = 1.0
    spread = spread_n(v, unsure(state, decisions) * (high - low), c.friction, now, decisions)
    spread = math.hypot(spread, clipped_reading_sd(reading_a, reading_b, c))
    most = high if likely > 0.0 else -low
    state.use = min(max(likely / most, -1.0), 1.0) if most > 0.0 else 0.0
    state.across = loads.across
    zone, end = decisions.end_zone, decisions.end_force
    if x < zone or x > c.stroke - zone:  # a stop pushes as the load asks for
        low, high, spread = low - end, high + end, end
    state.friction, state.low, state.high, state.spread = likely, low, high, spread
    sense = seen.sense if slides >= 1.0 else 0.0
    state.slid = state.slid + dt if sense != 0.0 and sense == state.sense else 0.0
    if sense != 0.0 and sense != state.sense:
        state.sense, state.changed = sense, 1.0
    elif slides <= 0.0 and slid_before > 0.0:
        state.sense = 0.0


@njit
def spread_n(
    v: float, width: float, friction: Stribeck, now: Conditions, decisions: Decisions
) -> float:
    """Standard deviation of friction, N: sliding at v (m/s), or somewhere in a set of this width
    (N).
    """
    out, back = friction.sides[EXTENDING], friction.sides[RETRACTING]
    level = 0.5 * (friction_size(abs(v), out, now) + friction_size(abs(v), back, now))
    slope = max(out.viscous, back.viscous) * now.thinning
    sticks = decisions.slow_share * math.exp(-abs(v) / decisions.slow_speed) if v != 0.0 else 0.0
    share = math.hypot(decisions.friction_share, sticks)
    sliding_sd = math.hypot(share * level, slope * decisions.speed_sd)
    return math.hypot(sliding_sd, 0.5 * decisions.rest_share * width)


@njit
def unsure(state: AxisState, decisions: Decisions) -> float:
    """How much wider than long after a stop friction is spread over its set."""
    fresh = 1.0 + decisions.fresh_more * math.exp(-state.rested / decisions.fresh)
    if state.has_slid != 0.0:
        return fresh
    return max(fresh, decisions.stuck_share / decisions.rest_share)
