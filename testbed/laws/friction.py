"""Seal and guide friction of a cylinder: the paper's (5) as the steady state of a bristle.

    dz/dt = v - k |v| z / g(v),   F = k z + d dz/dt + sigma v,   g(v) = F_c0 + F_s0 exp(-|v| / c_s)

With an elastic share s > 0 the contact is elasto-plastic (Dupont and others, 2002: nothing slips
below break-away):

    dz/dt = v (1 - alpha |z| k / g),
    alpha |z| k / g = (|z| k / g - s) / (1 - s) above s where z grows, else 0

Its steady state is the same. A stuck seal then keeps its force under a vibration below the share s
of the break-away force, whereas the plain bristle (s = 0) creeps and loses it. At a given g, z is a
function of the distance alone: it relaxes exponentially, so the mean force has a closed form.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

from testbed.compiled import njit_law
from testbed.formats.records import Record, part, quantity

if TYPE_CHECKING:
    from testbed.laws.axis_records import AxisInput


SHORT_EXPONENT, SHORTEST_EXPONENT = 0.01, 1e-6
"""Exponents below which a series (accurate to 1e-10), or its first term, replaces the closed form,
which would divide zero by zero.
"""

STILL = 1.0e-12
"""A slide shorter than this share of the bristle's length only shifts it: no division by less."""
SMALLEST_N = 1.0e-3
"""Dry friction is at least this, for the bristle is divided by its level; also if it is off."""


class Sliding(Record):
    """Equation (4) for one direction of sliding."""

    coulomb = quantity("N", "dry friction at high speed")
    static = quantity("N", "by how much break-away exceeds it")
    stribeck_speed = quantity("m/s", "speed over which that excess decays")
    viscous = quantity("N s/m", "friction by speed, at the reference temperature")


class SealParameters(Record):
    """Friction of a cylinder's seals and guides."""

    outward = part(Sliding, "extending")
    inward = part(Sliding, "retracting")
    bristle_stiffness = quantity("N/m", "of the contact before it slides")
    bristle_damping = quantity("N s/m", "of the same")
    elastic_share = quantity("1", "of the break-away force below which the contact only bends")
    position_slope = quantity("1", "how dry friction grows along the stroke, share of its middle")
    pressure_coefficient = quantity("m2", "dry friction by the sum of both gauge pressures")
    load_coefficient = quantity("1", "dry friction by the load that presses the rod in")
    side_load_coefficient = quantity("1", "dry friction by the load across the rod, mid-stroke")
    side_load_growth = quantity("1", "how that grows along the stroke, share of its middle")
    dwell_gain = quantity("1", "increase of break-away after long rest, share of dry friction")
    dwell_time = quantity("s", "time constant of that increase")
    viscosity_rate = quantity("1/K", "how viscous friction falls, beside the oil's own rate")


class SealState(Record):
    """The contact of seals and guides."""

    bristle = quantity("m", "deflection of the contact")
    dwell = quantity("1", "ageing of the contact, share of dry friction")


@njit_law(forceinline=True)
def stribeck_level(speed: float, coulomb_n: float, static_n: float, stribeck_m_s: float) -> float:
    """g(v) = F_c0 + F_s0 exp(-|v| / c_s), N: the paper's (4) and (5), exponent one; `speed` = |v|
    in m/s.
    """
    return coulomb_n + static_n * math.exp(-speed / stribeck_m_s)


@njit_law
def relax(start: float, aim: float, exponent: float) -> tuple[float, float]:
    """Value at the end and mean of an exponential approach from `start` to `aim` over `exponent`
    time constants.
    """
    if exponent < SHORT_EXPONENT:
        mean = 1.0 - exponent * (0.5 - exponent * (1.0 / 6.0 - exponent / 24.0))
        return start + (aim - start) * exponent * mean, aim + (start - aim) * mean
    left = math.exp(-exponent)
    return aim + (start - aim) * left, aim + (start - aim) * (1.0 - left) / exponent


@njit_law
def bend_elastic(z: float, way: float, longest: float, elastic_share: float) -> tuple[float, float]:
    """`bend` for the elasto-plastic contact: a spring up to the elastic share of `longest`, then an
    exponential approach to `longest`.
    """
    length = abs(way)
    if length < STILL * longest:
        return z + way, z
    along = math.copysign(1.0, way)
    bent = along * z
    free = min(max(elastic_share * longest - bent, 0.0), length)
    total = free * (bent + 0.5 * free)
    bent += free
    if length > free:
        reach = (1.0 - elastic_share) * longest
        bent, mean = relax(bent, longest, (length - free) / reach)
        total += mean * (length - free)
    return along * bent, along * total / length


@njit_law(forceinline=True)
def bend(z: float, way: float, longest: float, elastic_share: float) -> tuple[float, float]:
    """The bristle's deflection (m) after a slide by `way` (m) at constant speed from `z`, and its
    mean during it. Exact.

    longest: deflection in steady sliding, level / stiffness, m; |z| never exceeds the larger of
    this and its start.
    """
    if elastic_share > 0.0:
        new, mean = bend_elastic(z, way, longest, elastic_share)
        return new, mean
    exponent = abs(way) / longest
    if exponent < SHORTEST_EXPONENT:
        new = z + way - exponent * z
        return new, 0.5 * (z + new)
    new, mean = relax(z, math.copysign(longest, way), exponent)
    return new, mean


@njit_law(forceinline=True)
def dwell_step(
    dwell: float, gain: float, rest_1_s: float, slide_1_s: float, dt: float
) -> tuple[float, float]:
    """Ageing d of the contact after dt and its mean: it approaches `gain` at rest and is worn off
    by sliding, d' = rest (gain - d) - slide d. Exact.

    Break-away is raised by d times the Coulomb friction.
    """
    rate = rest_1_s + slide_1_s
    after, mean = relax(dwell, gain * rest_1_s / rate, rate * dt)
    return after, mean


@njit_law(forceinline=True)
def friction_step(
    s: SealState,
    p: SealParameters,
    rod: AxisInput,
    skipped: float,
    place: float,
    pressures: float,
    thinning: float,
    dt: float,
) -> float:
    """Mean friction of one axis over dt, N, positive against a positive rate. Advances the bristle
    and the dwell in `s`.

    skipped: slide of the contact before the step, m (hydraulic_step); place: extension at mid-step
    from the middle of the stroke, share of the stroke; pressures: sum of the mean gauge pressures
    of both chambers, Pa; thinning: factor of the viscous part.
    """
    v = rod.rate
    speed = abs(v)
    side = p.outward if v >= 0.0 else p.inward
    fc, fs = side.coulomb, side.static
    fc *= 1.0 + p.position_slope * place
    fc += p.pressure_coefficient * pressures
    pressing = rod.load if rod.load > 0.0 else 0.0
    across = p.side_load_coefficient * (1.0 + p.side_load_growth * place)
    fc += p.load_coefficient * pressing + across * abs(rod.side_load)
    fc = fc if fc > SMALLEST_N else SMALLEST_N
    if p.dwell_gain > 0.0:
        # Sliding by one bristle length renews the contact.
        s.dwell, aged = dwell_step(
            s.dwell, p.dwell_gain, 1.0 / p.dwell_time, speed * p.bristle_stiffness / fc, dt
        )
        fs += fc * aged
    level = stribeck_level(speed, fc, fs, side.stribeck_speed)
    longest = level / p.bristle_stiffness
    start, slide = s.bristle, skipped + dt * rod.rate
    s.bristle, mean = bend(start, slide, longest, p.elastic_share)
    bent = s.bristle - start
    if skipped != 0.0:  # the mean is that of the step alone, which begins after the skipped slide
        mean += 0.5 * skipped * (bent / slide if abs(slide) > STILL * longest else 1.0)
    force = p.bristle_stiffness * mean + p.bristle_damping * bent / dt
    return force + side.viscous * thinning * slide / dt
