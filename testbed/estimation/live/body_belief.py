"""What the whole-body estimate (whole_body.py) believes of the machine, as its record."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from testbed.estimation.filters import persistent
from testbed.estimation.live.axis import END_FORCE_N, END_ZONE_M, Decisions
from testbed.estimation.live.believed import Leg, declared
from testbed.estimation.live.body_records import BodyBelief
from testbed.estimation.live.own_tuning import EVEN, OwnTuning, fully_reported
from testbed.estimation.live.uncertainty import Uncertainty, constants
from testbed.estimation.live.unknowns import Constants
from testbed.machine.model import Axis, Machine
from testbed.machine.names import AXES, GRAVITY_M_S2, JOINTS, LEGS
from testbed.recording.leg_model import EffectEntry
from testbed.robot.linkage import Linkages
from testbed.robot.model import RobotModel
from testbed.robot.rope_bearings import SurveyedRopes
from testbed.scenario.machines import WORKSHOP


def body_of(
    machine: Machine,
    model: RobotModel,
    legs: Sequence[Leg],
    dt_s: float,
    ropes: SurveyedRopes,
    tuning: OwnTuning | None = None,
    sure: Uncertainty | None = None,
    effects: Sequence[EffectEntry] = (),
) -> NDArray[Any]:
    """One record `BodyBelief`, shape (1,): `machine`, `model` as believed, `legs` the four vertical
    cylinders.

    `ropes`: as surveyed at the start, world frame. `sure`: how sure all this is; None: by
    the workshop's tolerances. `effects`: of cylinders, believed at the axis of their place, those
    of vertical ones in `legs` already. `tuning`: as for ROBOCLIMBER.
    """
    t = (OwnTuning() if tuning is None else tuning).scaled(machine.scale).stepped(dt_s)
    linkages = Linkages.from_machine(machine)
    arms = linkages.rods(linkages.limits.mean(axis=1))[1]
    out = BodyBelief.zeros()
    body = out[0]
    body["believed"] = 1.0
    if not holds(machine):
        # Right after a stop friction is at an end of its set. Intervals report all of it.
        t = fully_reported(replace(t, rest_share=EVEN, fresh_more=1.0 / EVEN - 1.0))
    _trust(body, t, model.total_mass_kg * GRAVITY_M_S2)
    body["decisions"]["end_zone"] = machine.scale.length * END_ZONE_M
    body["decisions"]["end_force"] = machine.scale.force * END_FORCE_N
    sure = Uncertainty(WORKSHOP) if sure is None else sure
    body["known"] = Constants.as_table(_learnt(constants(sure, machine), t))[0]
    body["calibrated_at"] = machine.sensor.calibration_temperature_degc
    body["base_mass"], body["base_centre"] = model.base_mass()
    body["inertia"] = model.mass_matrix(model.limits.mean(axis=1))[3:6, 3:6]
    body["linkages"] = linkages.records
    body["foot_height"] = model.foot_positions_m(np.zeros(len(AXES)))[:, 2]
    body["belly_height"] = machine.body.belly_height_m
    body["belly_length"], body["belly_width"] = 0.5 * np.array(machine.body.belly_box_m[:2])
    body["rope_point"] = model.rope_attachments_m
    body["rope_direction"], body["rope_distance"] = ropes.directions, ropes.distances_m
    body["pin_gain"] = 1.0
    body["drill_point"], body["store_point"] = model.drill_mount_m, model.rod_store_m
    body["decisions"]["dt"] = dt_s
    numbers = model.leg_numbers()
    numbers["links"]["mass"][:, JOINTS.index("vertical")] = [leg.moving_mass_kg for leg in legs]
    body["legs"] = numbers
    inner = numbers["links"]["mass"][:, : JOINTS.index("vertical")]
    body["body_mass"] = body["base_mass"] + inner.sum()
    for index, axis in enumerate(machine.axes.values()):
        own = [effect for effect in effects if effect.place == axis.name]
        _declare(body["axes"][index], axis, float(linkages.stroke_m[index]), own)
        body["axes"][index]["encoder_resolution"] = arms[index] * axis.encoder_count
        if axis.joint == "vertical":
            legs[index // len(JOINTS)].write(body["axes"][index].cylinder)
    return out


def holds(machine: Machine) -> bool:
    """Whether load-holding valves shut the oil of every vertical cylinder in.

    Where none do, leaking edges press the pistons on against their seals for good: friction at rest
    is anywhere in its set and does not settle in the middle.
    """
    return all(machine.axes[f"{leg}_vertical"].valve.holding_a for leg in LEGS)


def _learnt(known: NDArray[Any], tuning: OwnTuning) -> NDArray[Any]:
    """`known` (Constants) as the tuning lets it be learnt: what is not is believed as it is."""
    for name in Constants.fields:
        if name == "zero":
            known[name] = np.hypot(known[name], tuning.zero_sd_n)
        elif name in ("out", "back"):
            known[name] = np.hypot(known[name], tuning.dry_sd_n) if tuning.friction else 0.0
        elif not (tuning.friction if name == "side" else tuning.weighs):
            known[name] = 0.0
    return known


def _trust(body: Any, tuning: OwnTuning, weight_n: float) -> None:
    """How sure the estimate is of what, and what it decides by."""
    body["every"], body["gravity"], body["weight"] = tuning.every, GRAVITY_M_S2, weight_n
    body["sliding_keep"], body["rest_keep"] = tuning.sliding_keep_s, tuning.rest_keep_s
    body["alike"], body["alike_after"] = tuning.rest_alike, tuning.alike_after_s
    body["balance_keep"] = tuning.body_keep_s
    body["rope_share"], body["drill_share"] = tuning.rope_share, tuning.drill_share
    body["blow_share"] = tuning.blow_share
    body["force_variance"], body["moment_variance"] = tuning.force_sd_n**2, tuning.moment_sd_n_m**2
    body["gate"], body["blame_memory"] = tuning.gate, tuning.blame_s
    body["blame_threshold"] = tuning.blame_threshold if tuning.robust else 0.0
    body["doubt_cost"] = tuning.doubt_cost if tuning.robust else 0.0
    body["doubt_time"] = tuning.doubt_time_s
    body["surprise"]["worth"] = tuning.surprise_worth if tuning.robust else 0.0
    body["surprise"]["memory"] = tuning.surprise_s
    body["zero_wander"] = tuning.zero_wander_n2_s
    body["air_load"], body["air_dwell"] = tuning.air_load_n, tuning.air_dwell_s
    body["air_sd"], body["learns_in_air"] = tuning.air_sd_n, tuning.swing
    body["balances"], body["noise_sd"] = tuning.balance, tuning.noise_sd_n
    body["moving_sd"], body["steady_sd"] = tuning.moving_sd_n, tuning.steady_sd_n
    shares = body["reported"]
    shares["sliding"], shares["stopped"] = tuning.reported_sliding, tuning.reported_stopped
    shares["begun"], shares["begun_s"] = tuning.reported_begun, tuning.reported_begun_s
    shares["constants"], shares["resting"] = tuning.reported_constants, tuning.reported_resting
    shares["loaded"], shares["loaded_within"] = (
        tuning.reported_loaded,
        tuning.reported_loaded_within,
    )
    shares["stuck"], shares["led"] = tuning.reported_stuck, tuning.reported_led
    shares["led_within"] = tuning.reported_led_within
    body["range_noise"] = tuning.range_noise_n
    body["spread_share"], body["spread_stuck"] = tuning.spread_share, tuning.spread_stuck
    body["only_pushes"] = tuning.pushes
    body["shakes"], body["carries"] = tuning.shakes, tuning.carries_n
    body["news_share"], body["news_noise"] = tuning.news_share, tuning.news_noise_n
    body["set_margin"] = tuning.set_margin
    body["balance_sd"][:3] = tuning.weight_share * weight_n
    body["balance_sd"][3:] = tuning.centre_sd_m * weight_n
    body["filter"] = persistent.Numbers.one(
        process_variance=tuning.filter_q_n2,
        measurement_variance=tuning.filter_r_n2,
        innovation_limit=tuning.e_max_n,
        hold_samples=tuning.hold_samples,
    )[0]
    body["decisions"] = Decisions.one(
        dt=0.0,
        observer=tuning.observer_rad_s,
        rest_speed=tuning.rest_m_s,
        slide_speed=tuning.slide_m_s,
        friction_share=tuning.friction_share,
        slow_share=tuning.slow_share,
        slow_speed=tuning.slow_m_s,
        speed_sd=tuning.speed_sd_m_s,
        rest_share=tuning.rest_share,
        fresh_more=tuning.fresh_more,
        fresh=tuning.fresh_s,
        stuck_share=tuning.stuck_share,
        knows_dependence=tuning.rich,
        end_zone=0.0,
        end_force=0.0,
    )[0]


def _declare(out: Any, axis: Axis, stroke_m: float, effects: Sequence[EffectEntry]) -> None:
    """One AxisBelief as the machine declares it, but for its encoder, with believed effects where
    they are not the vertical legs'.
    """
    seal, sensor = axis.seal, axis.sensor
    leg = replace(
        declared(axis, stroke_m),
        position_slope=seal.position_slope,
        pressure_coefficient_m2=seal.pressure_coefficient_m2,
        load_coefficient=seal.load_coefficient,
        viscosity_rate_1_k=seal.viscosity_rate_1_k,
    )
    for effect in effects if axis.joint != "vertical" else ():
        leg = leg.with_effect(effect)
    leg.write(out.cylinder)
    out.cylinder.side_coefficient = seal.side_load_coefficient
    out.cylinder.side_growth = seal.side_load_growth
    out.dwell_gain, out.dwell_time = seal.dwell_gain, seal.dwell_time_s
    out.end_cushion_length = axis.end_stop.cushion_length_m
    out.end_cushion_damping = axis.end_stop.cushion_damping_n_s_m
    per_kelvin = sensor.thermal_zero_share * sensor.pressure_range_pa / sensor.thermal_range_k
    both = math.hypot(leg.area_a_m2, leg.area_b_m2)
    out.thermal_sd = per_kelvin / math.sqrt(3.0) * both  # any slope up to that is as likely
