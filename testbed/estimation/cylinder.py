"""One cylinder as an estimator may know it: its sensors corrected, its force, its friction as a
value and as a set.

    true pressure = (reading - zero - drift t) / (1 + gain)
    piston force  = pA A_A - pB A_B
    F_f(v)        = sigma v + sign(v) [F_c0 + F_s0 exp(-|v| / c_s)]   (5)

The first is the law of sensor.drift_a and sensor.gain_a; (5) has one set of numbers for each sense.

What a model adds to (5) comes as `Conditions`. Used live (a number at a time) and over recordings;
forces in N along extension, friction positive against extension.
"""

from __future__ import annotations

import math
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from testbed.compiled import njit
from testbed.effects.hydraulics_air import compliance_1_pa
from testbed.effects.sensor_drift_a import zero_pa
from testbed.effects.sensor_gain import true_pa
from testbed.formats.arrays import Array, Flags
from testbed.formats.records import Record, Records, part, quantity
from testbed.recording.leg_model import Friction

EXTENDING, RETRACTING = 0, 1
"""Places of the two senses in `Stribeck.sides`."""
SENSES = {EXTENDING: "plus", RETRACTING: "minus"}
"""Names of the two senses in a model file."""


class FrictionSide(Record):
    """Equation (5) in one sense of motion."""

    viscous = quantity("N s/m", "sigma: what grows with speed")
    coulomb = quantity("N", "F_c0: dry friction while sliding fast")
    static = quantity("N", "F_s0: what break-away asks for beyond F_c0")
    stribeck_speed = quantity("m/s", "c_s: speed over which F_s0 fades")


class Stribeck(Record):
    """Equation (5) in both senses."""

    sides = part(FrictionSide, "extension, retraction", per=("extending", "retracting"))


class Conditions(NamedTuple):
    """What changes (5) at this moment: F_c = factor F_c0 + extra, sigma times thinning, F_s0 +
    dwell F_c.
    """

    factor: float
    extra: float
    thinning: float
    dwell: float


class Sensor(Record):
    """What is believed of a pressure sensor's errors; all 0: it reads what it should."""

    gain = quantity("1", "relative error of the gain")
    zero = quantity("Pa", "reading at no pressure")
    drift = quantity("Pa/s", "change of the zero since the start")


class Cylinder(Record):
    """What is believed of a cylinder, its seals and its sensors; what is 0 is not there."""

    area_a = quantity("m2", "piston side")
    area_b = quantity("m2", "rod side")
    stroke = quantity("m", "stroke")
    dead_volume_a = quantity("m3", "oil in chamber A at extension 0")
    dead_volume_b = quantity("m3", "oil in chamber B at full extension")
    bulk_modulus = quantity("Pa", "of the oil, without air")
    hose_a = quantity("m3/Pa", "elasticity of chamber A's hose")
    hose_b = quantity("m3/Pa", "elasticity of chamber B's hose")
    air = quantity("1", "volume of entrained air at 1 bar, share")
    seal_stiffness = quantity("N/m", "of the seals' bristles")
    deadband = quantity("1", "valve command below which no oil flows")
    sensor_a = part(Sensor, "pressure sensor of chamber A")
    sensor_b = part(Sensor, "pressure sensor of chamber B")
    friction = part(Stribeck, "at the reference temperature")
    position_slope = quantity("1", "more Coulomb friction over the stroke, about its middle")
    pressure_coefficient = quantity("m2", "friction by pA + pB")
    load_coefficient = quantity("1", "friction by the load along the rod")
    side_coefficient = quantity("1", "friction by the load across the rod, mid-stroke")
    side_growth = quantity("1", "how that grows over the stroke, share of its middle")
    viscosity_rate = quantity("1/K", "thinning of the viscous part with warmth")
    viscosity_reference = quantity("degC", "temperature at which sigma holds")
    spring_stiffness = quantity("N/m", "of a spring against extension")
    spring_rest = quantity("m", "extension at which the spring is slack")
    cushion_stiffness = quantity("N/m", "of a cushion near the closed end")
    cushion_start = quantity("m", "extension below which the cushion pushes")
    offset = quantity("N", "constant force along extension")


def stribeck_of(friction: Friction) -> NDArray[Any]:
    """A model's friction (5) as one `Stribeck` record, shape (1,)."""
    out = Stribeck.zeros()
    for side, sense in SENSES.items():
        numbers = out["sides"][0, side]
        numbers["viscous"] = getattr(friction, f"viscous_{sense}_n_s_m")
        numbers["coulomb"] = getattr(friction, f"coulomb_{sense}_n")
        numbers["static"] = getattr(friction, f"stribeck_{sense}_n")
        numbers["stribeck_speed"] = getattr(friction, f"stribeck_speed_{sense}_m_s")
    return out


RATIO_MOST = 2.0
"""Behind softer oil than that the noise of the pressures outweighs what they tell of the seals
(E).
"""
POLYTROPIC_POWER = 1.0 / 1.4
"""Of air."""
_behind_gain, _drifted, _of_air = njit(true_pa), njit(zero_pa), njit(compliance_1_pa)


@njit
def true_pressure(reading: float, sensor: Sensor, time_s: float) -> float:
    """The pressure (Pa) behind a reading `time_s` after the start."""
    drifted = _drifted(time_s, sensor.drift, 0.0)
    return float(_behind_gain(reading - sensor.zero - drifted, sensor.gain, 0.0))


VOID_PA, VOID_SD_PA = -0.5e5, 0.29e5
"""A gauge reads nothing below the atmosphere: a chamber whose reading has ended at 0 holds anything
down to a void, 1 bar below: its middle, and its standard deviation."""


def replace_clipped(readings_pa: Array) -> Array:
    """Readings (samples,), what has ended at 0 replaced by the middle of what it may stand for."""
    return np.where(readings_pa <= 0.0, VOID_PA, readings_pa)


@njit
def chamber_pressure(reading: float, sensor: Sensor, time_s: float) -> float:
    """The pressure (Pa) in a chamber behind a reading, which may have ended at 0."""
    return VOID_PA if reading <= 0.0 else true_pressure(reading, sensor, time_s)


@njit
def clipped_reading_sd(reading_a: float, reading_b: float, c: Cylinder) -> float:
    """Standard deviation (N) of what readings that have ended at 0 leave open of a piston's
    force.
    """
    in_a = c.area_a if reading_a <= 0.0 else 0.0
    in_b = c.area_b if reading_b <= 0.0 else 0.0
    return VOID_SD_PA * math.hypot(in_a, in_b)


def piston_force_n(pressure_a: Any, pressure_b: Any, area_a: float, area_b: float) -> Any:
    """PA A_A - pB A_B, N; numbers or arrays."""
    return pressure_a * area_a - pressure_b * area_b


piston_force = njit(piston_force_n)
"""`piston_force_n` for compiled callers."""


@njit
def stribeck_share(speed: float, side: FrictionSide) -> float:
    """What is left of F_s0 at `speed` = |v|, 1."""
    return math.exp(-speed / side.stribeck_speed)


def friction_terms(speed: Array, stribeck_speed: Any) -> Array:
    """What sigma, F_c0 and F_s0 of (5) are multiplied by at `speed` = |v|: shape (..., 3).

    speed, m/s, and stribeck_speed, m/s, broadcast. For those who look for these numbers.
    """
    left = np.exp(-speed / stribeck_speed)
    return np.asarray(np.stack(np.broadcast_arrays(speed, 1.0, left), axis=-1))


@njit
def friction_size(speed: float, side: FrictionSide, now: Conditions) -> float:
    """Size of friction in one sense at `speed` = |v| >= 0, N."""
    static = side.static + now.dwell * (side.coulomb * now.factor + now.extra)
    dry = side.viscous * now.thinning * speed + side.coulomb * now.factor + now.extra
    return dry + static * stribeck_share(speed, side)


@njit
def friction_value(v: float, friction: Stribeck, now: Conditions) -> float:
    """F_f(v) of (5), against extension; 0 at v = 0 as sign(0) = 0."""
    if v > 0.0:
        return friction_size(v, friction.sides[EXTENDING], now)
    if v < 0.0:
        return -friction_size(-v, friction.sides[RETRACTING], now)
    return 0.0


@njit
def break_away(friction: Stribeck, now: Conditions) -> tuple[float, float]:
    """(lowest, highest) friction of a piston at rest."""
    low = -friction_size(0.0, friction.sides[RETRACTING], now)
    return low, friction_size(0.0, friction.sides[EXTENDING], now)


@njit
def friction_set(
    v: float, sense: float, slides: float, friction: Stribeck, now: Conditions
) -> tuple[float, float]:
    """(lowest, highest) friction that the encoder leaves open.

    `slides` = 1: the single value (5) at |v| in `sense`; 0: all between the two break-away values;
    in between, the edge on the far side moves back linearly.
    """
    low, high = break_away(friction, now)
    if slides <= 0.0:
        return low, high
    if sense > 0.0:
        value = friction_size(max(v, 0.0), friction.sides[EXTENDING], now)
    else:
        value = -friction_size(max(-v, 0.0), friction.sides[RETRACTING], now)
    return slides * value + (1.0 - slides) * low, slides * value + (1.0 - slides) * high


@njit
def thinning_by_warmth(cylinder: Cylinder, oil_degc: float) -> float:
    """What warmth leaves of the viscous part, 1."""
    if cylinder.viscosity_rate == 0.0:
        return 1.0
    return math.exp(-cylinder.viscosity_rate * (oil_degc - cylinder.viscosity_reference))


@njit
def place_factor(cylinder: Cylinder, extension: float) -> float:
    """Coulomb friction at an extension (m) over that in the middle of the stroke."""
    return 1.0 + cylinder.position_slope * (extension / cylinder.stroke - 0.5)


@njit
def side_load_factor(cylinder: Cylinder, extension: float) -> float:
    """Friction by a load across the rod at an extension (m) over that in the middle of the
    stroke.
    """
    return 1.0 + cylinder.side_growth * (extension / cylinder.stroke - 0.5)


@njit
def extra_friction(cylinder: Cylinder, pressures: float, load: float, across: float) -> float:
    """Coulomb friction beyond F_c0, N, by pA + pB (Pa) and the load along and across the rod
    (N).
    """
    extra = cylinder.pressure_coefficient * pressures + cylinder.side_coefficient * across
    return extra + cylinder.load_coefficient * max(load, 0.0)


@njit
def oil_compliance(gauge_pa: float, cylinder: Cylinder) -> float:
    """1 / beta of oil with its air, 1/Pa."""
    air = _of_air(max(gauge_pa, 0.0), cylinder.air, POLYTROPIC_POWER) if cylinder.air > 0.0 else 0.0
    return 1.0 / cylinder.bulk_modulus + air


@njit
def oil_springs(pa: float, pb: float, extension: float, cylinder: Cylinder) -> tuple[float, float]:
    """Stiffness of both chambers, N/m, ports shut: beta_A A_A^2 / V_A, beta_B A_B^2 / V_B at gauge
    pressures, Pa, the hoses' widening in both.

    V_A = dead_a + A_A x, V_B = dead_b + A_B (stroke - x).
    """
    inside = min(max(extension, 0.0), cylinder.stroke)
    volume_a = cylinder.dead_volume_a + cylinder.area_a * inside
    volume_b = cylinder.dead_volume_b + cylinder.area_b * (cylinder.stroke - inside)
    gives_a = volume_a * oil_compliance(pa, cylinder) + cylinder.hose_a
    gives_b = volume_b * oil_compliance(pb, cylinder) + cylinder.hose_b
    return (
        float(cylinder.area_a * cylinder.area_a / gives_a),
        float(cylinder.area_b * cylinder.area_b / gives_b),
    )


@njit
def seal_ratio(pa: float, pb: float, extension: float, cylinder: Cylinder) -> float:
    """Stiffness of a piston's seals over that of its oil at gauge pressures (Pa) and an extension
    (m), 1.
    """
    a, b = oil_springs(pa, pb, extension, cylinder)
    return min(cylinder.seal_stiffness / (a + b), RATIO_MOST)


@njit
def valve_direction(command: float, deadband: float) -> float:
    """The way an open valve drives the piston, -1 or 1; 0 while it is shut."""
    if abs(command) < deadband:
        return 0.0
    return 1.0 if command > 0.0 else -1.0


def friction_parts(
    velocity: Array, friction: Friction, factor: Array, extra: Array, thinning: Array
) -> tuple[Array, Array]:
    """(dry level, viscous part) of (5) over a recording, N: F_f = viscous + sign(v) level; all of
    shape (n,).

    The conditions as in `Conditions`. At v = 0 the level is that of extension.
    """
    level = np.empty_like(velocity)
    _levels(np.abs(velocity), velocity >= 0.0, stribeck_of(friction), factor, extra, level)
    sides = friction.viscous_plus_n_s_m, friction.viscous_minus_n_s_m
    return level, np.where(velocity >= 0.0, *sides) * thinning * velocity


def break_away_over(friction: Friction, factor: Array, extra: Array) -> tuple[Array, Array]:
    """`break_away` over a recording: (lowest, highest) friction of a piston at rest, N, shape
    (n,).
    """
    still, numbers = np.zeros_like(factor), stribeck_of(friction)
    low, high = np.empty_like(factor), np.empty_like(factor)
    _levels(still, np.zeros(still.shape, dtype=bool), numbers, factor, extra, low)
    _levels(still, np.ones(still.shape, dtype=bool), numbers, factor, extra, high)
    return -np.maximum(low, 0.0), np.maximum(high, 0.0)


@njit
def _levels(
    speed: Array,
    extends: Flags,
    friction: Records[Stribeck],
    factor: Array,
    extra: Array,
    level: Array,
) -> None:
    for index in range(len(speed)):
        side = friction[0].sides[EXTENDING if extends[index] else RETRACTING]
        level[index] = friction_size(
            speed[index], side, Conditions(factor[index], extra[index], 0.0, 0.0)
        )
