"""What the own estimator believes of the whole machine: numbers packed once for the compiled step (own_kernel.py)."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, fields

import numpy as np
from numpy.typing import NDArray

from testbed.estimation.live import axis_kernel as ax
from testbed.estimation.live import own_kernel as own
from testbed.estimation.live.believed import Leg, friction_of
from testbed.machine.model import Axis, Machine
from testbed.machine.names import AXES, GRAVITY_M_S2
from testbed.robot.linkage import RotationLinkage, stroke_m
from testbed.robot.loads import foot_forces as ff
from testbed.robot.model import RobotModel

Array = NDArray[np.float64]


@dataclass(frozen=True)
class OwnTuning:
    """How sure the estimator is of what, and which of its ideas are on. All numbers assumed (E) and chosen on runs
    that no result is taken from; see `testbed estimators`.

    `friction_share`: sliding friction is known to this share; `rest_share`: one standard deviation of friction at rest,
    as a share of its set's half width; `*_keep_s`: for how long a deviation lasts (the balance's own shorter than
    friction's: else it takes what a stuck piston hides for an error of the weight); `sd_at_rest`: what is stated of
    the filter's standard deviation at rest: errors there have long tails, and its own makes intervals too wide.
    """

    rich: bool = True
    """Friction beyond (5): warmth of the oil, place on the stroke, pressure, side load, rest."""
    history: bool = True
    """Friction at rest remembers (friction_at_rest.py)."""
    swing: bool = True
    """A foot in the air carries nothing: zeros are learnt there."""
    balance: bool = True
    """Foot forces, weight, ropes and drill add up to nothing."""
    robust: bool = True
    """A zero far beyond its expected size is set free, so that one bad sensor carries the blame alone."""
    every: int = 5
    observer_rad_s: float = 60.0
    rest_m_s: float = 0.001
    slide_m_s: float = 0.003
    friction_share: float = 0.07
    speed_sd_m_s: float = 0.003
    rest_share: float = 0.45
    sliding_keep_s: float = 0.5
    rest_keep_s: float = 1.0
    body_keep_s: float = 0.3
    weight_share: float = 0.005
    centre_sd_m: float = 0.01
    rope_share: float = 0.005
    drill_share: float = 0.05
    blow_share: float = 0.2
    sd_at_rest: float = 0.7
    force_sd_n: float = 120.0
    moment_sd_n_m: float = 180.0
    news_share: float = 0.8
    news_noise_n: float = 50.0
    gate: float = 8.0
    tail_s: float = 3.0
    zero_wander_n2_s: float = 1.0
    zero_sd_n: float = 20.0
    air_load_n: float = 1500.0
    air_dwell_s: float = 0.15
    air_sd_n: float = 40.0
    noise_sd_n: float = 15.0
    filter_q_n2: float = 150.0
    filter_r_n2: float = 1500.0
    e_max_n: float = 500.0
    hold_samples: float = 4.0


def packed(
    machine: Machine,
    model: RobotModel,
    legs: Sequence[Leg],
    dt_s: float,
    rope_directions_in_world: Array,
    tuning: OwnTuning | None = None,
) -> Array:
    """The array (BODY_SIZE,) of own_kernel: `machine` and `model` as believed, `legs` the four vertical cylinders.

    `rope_directions_in_world` (2, 3): unit vectors from the traction devices to the anchors, as surveyed at the start;
    zeros where there are no ropes.
    """
    t = OwnTuning() if tuning is None else tuning
    linkage = RotationLinkage.from_machine(machine)
    base_mass, base_centre = model.base_mass()
    weight = model.total_mass_kg * GRAVITY_M_S2
    body = np.zeros(own.BODY_SIZE)
    body[: own.BODY_NUMBERS] = [
        t.every,
        t.sliding_keep_s,
        t.rest_keep_s,
        t.body_keep_s,
        t.rope_share,
        t.force_sd_n**2,
        t.moment_sd_n_m**2,
        t.gate,
        t.tail_s if t.robust else 0.0,
        t.zero_wander_n2_s,
        t.air_load_n,
        t.air_dwell_s,
        t.air_sd_n,
        t.swing,
        t.balance,
        t.noise_sd_n,
        GRAVITY_M_S2,
        base_mass,
        machine.sensor.calibration_temperature_degc,
        t.drill_share,
        t.news_share,
        t.news_noise_n,
        t.blow_share,
        t.sd_at_rest if t.balance else 1.0,
    ]
    force_sd, moment_sd = t.weight_share * weight, t.centre_sd_m * weight
    body[own.BODY_SD : own.FILTER] = [force_sd] * 3 + [moment_sd] * 3
    body[own.FILTER : own.GEOMETRY] = [t.filter_q_n2, t.filter_r_n2, t.e_max_n, t.hold_samples]
    body[own.GEOMETRY : own.BASE_CENTRE] = linkage.geometry
    body[own.BASE_CENTRE : own.FOOT_Z] = base_centre
    body[own.FOOT_Z : own.ROPE_POINTS] = model.foot_positions_m(np.zeros(len(AXES)))[:, 2]
    body[own.ROPE_POINTS : own.ROPE_DIRECTIONS] = model.rope_attachments_m.ravel()
    body[own.ROPE_DIRECTIONS : own.DRILL_POINT] = np.asarray(rope_directions_in_world).ravel()
    body[own.DRILL_POINT : own.STORE_POINT] = model.drill_mount_m
    body[own.STORE_POINT : own.INERTIA] = model.rod_store_m
    middle = model.limits.mean(axis=1)
    body[own.INERTIA : own.COMMON] = model.mass_matrix(middle)[3:6, 3:6].ravel()
    body[own.COMMON : own.LEGS_AT] = [
        dt_s,
        t.observer_rad_s,
        t.rest_m_s,
        t.slide_m_s,
        t.friction_share,
        t.speed_sd_m_s,
        t.rest_share,
        t.rich,
        t.history,
    ]
    numbers = model.leg_numbers()
    numbers["links"]["mass"][:, 2] = [leg.mass_kg + leg.extra_mass_kg for leg in legs]
    body[own.LEGS_AT : own.AXES_AT] = ff.LegNumbers.as_table(numbers).ravel()
    axes = body[own.AXES_AT :].reshape(len(AXES), ax.AXIS_BELIEFS)
    arm = float(linkage.moment_arm_m(0.0))
    for i, axis in enumerate(machine.axes.values()):
        axes[i] = _cylinder(axis, stroke_m(axis.cylinder, linkage), arm)
        if axis.joint == "vertical":
            _vertical(axes[i], legs[i // 3])
    return body


def _cylinder(axis: Axis, stroke: float, arm_m: float) -> Array:
    """One cylinder as the machine declares it (AXIS_BELIEFS,); `arm_m`: of the rotation linkage."""
    c, seal, sensor, stop = axis.cylinder, axis.seal, axis.sensor, axis.end_stop
    area_a = 0.25 * math.pi * c.bore_m**2
    area_b = area_a - 0.25 * math.pi * c.rod_m**2
    count = sensor.encoder_linear_m
    if axis.joint == "rotation":
        count = 2.0 * math.pi / sensor.encoder_counts_per_turn * arm_m
    b = np.zeros(ax.AXIS_BELIEFS)
    b[:8] = friction_of(c).packed()
    b[ax.AREA_A], b[ax.AREA_B] = area_a, area_b
    b[ax.STROKE] = stroke
    b[ax.RESOLUTION] = count
    b[ax.SLOPE], b[ax.PRESSURE] = seal.position_slope, seal.pressure_coefficient_m2
    b[ax.SIDE], b[ax.LOAD] = seal.side_load_coefficient, seal.load_coefficient
    b[ax.WARMTH_RATE], b[ax.WARMTH_REFERENCE] = (
        seal.viscosity_rate_1_k,
        seal.viscosity_reference_degc,
    )
    b[ax.DWELL_GAIN], b[ax.DWELL_TIME] = seal.dwell_gain, seal.dwell_time_s
    b[ax.SEAL], b[ax.DEAD_A], b[ax.DEAD_B] = (
        seal.bristle_stiffness_n_m,
        c.dead_volume_a_m3,
        c.dead_volume_b_m3,
    )
    b[ax.BULK], b[ax.DEADBAND] = axis.oil.bulk_modulus_pa, axis.valve.deadband
    b[ax.CUSHION_LENGTH], b[ax.CUSHION_DAMPING] = (
        stop.cushion_length_m,
        stop.cushion_damping_n_s_m,
    )
    per_kelvin = sensor.thermal_zero_share * sensor.pressure_range_pa / sensor.thermal_range_k
    both = math.hypot(area_a, area_b)
    b[ax.THERMAL_N_K] = per_kelvin / math.sqrt(3.0) * both  # any slope up to that is as likely
    b[ax.ZERO_SD] = OwnTuning.zero_sd_n
    return b


def _vertical(b: Array, leg: Leg) -> None:
    """The vertical cylinder as the chain believes it, with the effects of a model file on top of what is declared."""
    b[:8] = leg.friction.packed()
    b[ax.AREA_A], b[ax.AREA_B], b[ax.STROKE] = leg.area_a_m2, leg.area_b_m2, leg.stroke_m
    b[ax.GAIN_A], b[ax.GAIN_B] = leg.gain_a, leg.gain_b
    b[ax.ZERO_A], b[ax.ZERO_B], b[ax.DRIFT_A] = leg.zero_a_pa, leg.zero_b_pa, leg.drift_a_pa_s
    b[ax.SLOPE] += leg.position_slope
    b[ax.PRESSURE] += leg.pressure_coefficient_m2
    b[ax.LOAD] += leg.load_coefficient
    b[ax.WARMTH_RATE] += leg.viscosity_rate_1_k
    b[ax.SPRING], b[ax.SPRING_REST] = leg.spring_stiffness_n_m, leg.spring_rest_m
    b[ax.CUSHION], b[ax.CUSHION_START] = leg.cushion_stiffness_n_m, leg.cushion_start_m
    b[ax.OFFSET] = leg.force_offset_n


def without(tuning: OwnTuning, *ideas: str) -> OwnTuning:
    """The tuning with some ideas switched off (`rich`, `history`, `swing`, `balance`, `robust`)."""
    values = {f.name: getattr(tuning, f.name) for f in fields(tuning)}
    return OwnTuning(**(values | dict.fromkeys(ideas, False)))
