"""What the whole-body estimate (whole_body.py) believes of the machine, and how sure it is of
what.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, fields, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from testbed.estimation.filters import persistent
from testbed.estimation.live.axis import END_FORCE_N, END_ZONE_M, Decisions
from testbed.estimation.live.believed import Leg, declared
from testbed.estimation.live.body_records import BodyBelief
from testbed.estimation.live.fusion import Constants
from testbed.estimation.live.uncertainty import Uncertainty, constants
from testbed.machine.model import Axis, Machine
from testbed.machine.names import AXES, GRAVITY_M_S2, JOINTS, LEGS
from testbed.machine.scale import Scale
from testbed.recording.leg_model import EffectEntry
from testbed.robot.linkage import Linkages
from testbed.robot.model import RobotModel
from testbed.robot.rope_bearings import SurveyedRopes
from testbed.scenario.machines import WORKSHOP

EVEN = 1.0 / math.sqrt(3.0)
"""One standard deviation of what is anywhere in a set, as a share of the set's half width."""

TUNED_AT_S = 1.0e-3
"""What OwnTuning has by samples is for samples that are so far apart."""


@dataclass(frozen=True)
class OwnTuning:
    """How sure the estimator is of what, and which of its ideas are on. All numbers assumed (E) and
    chosen on runs that no result is taken from; see `testbed estimators`.

    `*_sd_*` is one standard deviation, `*_share` a share of what its name says, `*_keep_s` for how
    long a deviation lasts.
    """

    rich: bool = True
    """Friction beyond (5): warmth of the oil, place on the stroke, pressure, side load, rest."""
    swing: bool = True
    """A foot in the air carries nothing: zeros are learnt there."""
    balance: bool = True
    """Foot forces, weight, ropes and drill add up to nothing."""
    friction: bool = True
    """Friction of each cylinder is learnt while it slides."""
    weighs: bool = True
    """Weight, centre of mass, ropes, load pins and the inertial unit's bracket are learnt."""
    robust: bool = True
    """A sensor that the balance blames far more than a sound machine's carries the blame alone, and
    a balance that no friction can explain is given up.
    """
    pushes: bool = True
    """A foot pushes and does not pull."""
    shakes: bool = True
    """Fast changes of the loads follow from the body's acceleration."""
    every: int = 5
    """Samples between two balances of the body."""
    observer_rad_s: float = 60.0
    """Bandwidth of the observer that takes speed and acceleration from the encoder."""
    rest_m_s: float = 0.001
    """A piston that is slower counts as resting."""
    slide_m_s: float = 0.003
    """A piston that is faster counts as sliding; between the two friction is neither a set nor
    known.
    """
    friction_share: float = 0.12
    """Sliding friction is known to this share."""
    slow_share: float = 0.6
    """The same at the slowest speeds, beside that: a piston may stick and slip there."""
    slow_m_s: float = 0.008
    """Speed over which that fades."""
    speed_sd_m_s: float = 0.003
    """Of the piston speed: what friction may be off by because the speed is."""
    rest_share: float = 0.3
    """One standard deviation of friction at rest, of its set's half width; EVEN without
    load-holding valves.
    """
    fresh_more: float = 1.5
    """So much more of it right after a stop, while oil and friction settle."""
    fresh_s: float = 4.0
    """Over which that fades."""
    stuck_share: float = EVEN
    """Likewise of a piston that has not slid since the start: it may be stuck anywhere in its
    set.
    """
    sliding_keep_s: float = 0.5
    """Of friction while a piston slides."""
    rest_keep_s: float = 0.3
    """Of friction at rest."""
    rest_alike: float = 0.5
    """Correlation of friction between feet that have rested for `alike_after_s`: oil that leaks
    moves it the same way at all of them.
    """
    alike_after_s: float = 30.0
    """Of rest, after which friction is about as much alike."""
    body_keep_s: float = 0.3
    """Of the balance's own error: shorter than friction's, else it takes what a stuck piston hides
    for an error of the weight.
    """
    weight_share: float = 0.005
    """Of the weight, by which the balance of forces may be off."""
    centre_sd_m: float = 0.01
    """Of the centre of mass: the weight times this is what the balance of moments may be off by."""
    rope_share: float = 0.005
    """Of the ropes' tensions, by which the balance may be off."""
    drill_share: float = 0.05
    """Of the ordered thrust, by which it may."""
    blow_share: float = 0.2
    """Of the thrust, by which it may while the hammer blows."""
    force_sd_n: float = 300.0
    """Noise of the balance of forces."""
    moment_sd_n_m: float = 450.0
    """Noise of the balance of moments."""
    set_margin: float = 0.2
    """By so much of its width friction's set may be wider than believed."""
    news_share: float = 0.8
    """Of a change of the piston force at rest, that may be friction."""
    news_noise_n: float = 50.0
    """Of such a change, that is noise."""
    gate: float = 8.0
    """An observation that is more standard deviations off than this counts less."""
    blame_s: float = 1.0
    """Over which the balance is looked at for a sensor that lies."""
    blame_threshold: float = 2.5
    """Standard deviations at which a sensor is blamed."""
    doubt_cost: float = 10.0
    """Cost of a balance that is still believed at rest (doubt.py). On 26 tuning runs of sound drawn
    machines it is at most 5 standing and drilling, 8 raising, and 24 for moments of a crawl.
    """
    doubt_time_s: float = 2.0
    """Within which a doubted balance is given up, and believed again."""
    zero_wander_n2_s: float = 1.0
    """Variance by which a zero of the cylinder force grows."""
    zero_sd_n: float = 20.0
    """The calibration itself, beside what the machine's tolerances say of the sensors."""
    dry_sd_n: float = 20.0
    """Dry friction likewise."""
    air_load_n: float = 1500.0
    """A foot that is not meant to carry and bears less is in the air,"""
    air_dwell_s: float = 0.15
    """once it has for so long."""
    air_sd_n: float = 40.0
    """Of the load of a foot in the air: how surely it is nothing."""
    carries_n: float = 300.0
    """From this load on a foot takes its part in fast changes of the body's load."""
    noise_sd_n: float = 15.0
    """Of a filtered load."""
    moving_sd_n: float = 110.0
    """What inertia and friction leave beside that while the piston slides."""
    steady_sd_n: float = 40.0
    """What they leave where the body goes steadily."""
    told_share: float = 0.75
    """Of the filter's standard deviation, what intervals are made of: deviations end where their
    sets do, so that large ones are rarer than a normal law has them.
    """
    stuck_told: float = 0.7
    """Of that, on a vertical piston that never slid: what it may hide is as wide as its set, and
    control that holds the posture leads most of it to less. Chosen on drawn machines whose seals
    begin loose, or stuck anywhere.
    """
    friction_told: float = 0.93
    """Of both, in an interval, of what friction makes: beside it the constants are told whole."""
    filter_q_n2: float = 150.0
    """Variance by which a load changes from sample to sample, for the filter of what is told."""
    filter_r_n2: float = 1500.0
    """Variance of what that filter is fed."""
    e_max_n: float = 500.0
    """A load that jumps by more is held back,"""
    hold_samples: float = 4.0
    """for so many samples: a spike is over by then, news is not."""

    def scaled(self, scale: Scale) -> OwnTuning:
        """The same for a machine of another size."""
        by_unit = {
            "_n_m": scale.moment,
            "_m_s": scale.speed,
            "_n2": scale.force**2,
            "_n2_s": scale.force**2,
            "_n": scale.force,
            "_m": scale.length,
        }
        changes = {}
        for field in fields(self):
            unit = next((end for end in by_unit if field.name.endswith(end)), None)
            if unit is not None:
                changes[field.name] = by_unit[unit] * getattr(self, field.name)
        return replace(self, **changes)

    def stepped(self, dt_s: float) -> OwnTuning:
        """The same for samples that come every so many seconds: as quick to follow a load, by
        larger steps where there are fewer.
        """
        steps = round(dt_s / TUNED_AT_S, 3)
        return replace(
            self,
            every=math.ceil(self.every / steps),
            hold_samples=max(self.hold_samples / steps, 2.0),
            filter_q_n2=self.filter_q_n2 * steps,
        )


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
        # Right after a stop: at an end. What is even is told as it is.
        t = told_whole(replace(t, rest_share=EVEN, fresh_more=1.0 / EVEN - 1.0))
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
    body["zero_wander"] = tuning.zero_wander_n2_s
    body["air_load"], body["air_dwell"] = tuning.air_load_n, tuning.air_dwell_s
    body["air_sd"], body["learns_in_air"] = tuning.air_sd_n, tuning.swing
    body["balances"], body["noise_sd"] = tuning.balance, tuning.noise_sd_n
    body["moving_sd"], body["steady_sd"] = tuning.moving_sd_n, tuning.steady_sd_n
    body["friction_told"] = tuning.friction_told
    body["told_share"], body["stuck_told"] = tuning.told_share, tuning.stuck_told
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


def without(tuning: OwnTuning, *ideas: str) -> OwnTuning:
    """The tuning with some of its ideas, the fields that are true or false, switched off."""
    values = {field.name: getattr(tuning, field.name) for field in fields(tuning)}
    return OwnTuning(**(values | dict.fromkeys(ideas, False)))


def unsurveyed(tuning: OwnTuning) -> OwnTuning:
    """The same where nobody surveyed ropes and load: nothing balances the feet, so nothing narrows
    what friction hides. At rest it is anywhere in its set, and all of that is told.
    """
    alone = without(tuning, "balance", "weighs")
    return told_whole(replace(alone, rest_share=EVEN, fresh_more=0.0), stuck_told=0.6)


def unfelt(tuning: OwnTuning) -> OwnTuning:
    """The same where no inertial unit felt the body's acceleration: fast changes of the loads, of
    blows above all, are not followed, and what the filter does not know of is told.
    """
    alone = replace(without(tuning, "shakes"), steady_sd_n=tuning.moving_sd_n)
    return told_whole(alone, tuning.stuck_told)


def told_whole(tuning: OwnTuning, stuck_told: float = 1.0) -> OwnTuning:
    """The same with intervals of all that the filter does not know, on a vertical piston that never
    slid of a share.
    """
    return replace(tuning, told_share=1.0, stuck_told=stuck_told, friction_told=1.0)
