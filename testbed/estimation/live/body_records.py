"""The records of the whole-body estimate: what it believes of the machine, and its state."""

from __future__ import annotations

from testbed.estimation.filters import persistent
from testbed.estimation.live import unknowns
from testbed.estimation.live.axis import AxisBelief, AxisState, Decisions
from testbed.estimation.live.belly_support import Support
from testbed.estimation.live.body_acceleration import AccelerationMemory
from testbed.estimation.live.body_stirred import Stirred
from testbed.estimation.live.cylinder_errors import LearntInAir
from testbed.estimation.live.fusion import Fusion
from testbed.estimation.live.reported_shares import ForceRange, ReportedShares
from testbed.estimation.live.surprise import SurpriseNumbers, SurpriseState
from testbed.formats.records import Record, part, quantity
from testbed.machine.names import AXES, LEGS, SIDES
from testbed.recording.rows import XYZ
from testbed.robot.linkage import Linkage
from testbed.robot.loads.foot_forces import BodyMotion, JointMotion, LegNumbers
from testbed.robot.rope_bearings import RopeBearings


class BodyBelief(Record):
    """What is believed of the whole machine, and the estimate's tuning: own_tuning.py says of each
    number of the tuning what it is for.
    """

    believed = quantity(
        "1", "1: the whole machine; 0: each vertical cylinder is estimated by itself"
    )
    every = quantity("1", "steps between two balances")
    gravity = quantity("m/s2", "strength")
    sliding_keep = quantity("s", "time constant of friction's deviation while sliding")
    rest_keep = quantity("s", "the same at rest")
    alike = quantity("1", "correlation of friction between vertical cylinders after a long rest")
    alike_after = quantity("s", "time constant of a rest with which it builds up")
    balance_keep = quantity("s", "time constant of the balance's own error")
    rope_share = quantity("1", "error of the balance of forces, share of the ropes' tensions")
    known = quantity("N", "prior standard deviations of the constants", per=unknowns.CONSTANTS)
    drill_share = quantity("1", "error of the balance along z, share of the ordered thrust")
    blow_share = quantity("1", "noise of it by the hammer's blows, share of the ordered thrust")
    force_variance = quantity("N2", "noise of the balance of forces")
    moment_variance = quantity("N2 m2", "noise of the balance of moments")
    gate = quantity("1", "standard deviations beyond which an observation gets less weight")
    blame_memory = quantity(
        "s", "over which the balance is averaged to find a sensor that reads wrong"
    )
    blame_threshold = quantity("1", "standard deviations at which one is blamed; 0: never")
    doubt_cost = quantity("1", "cost of a balance that is still believed (doubt.py); 0: any")
    doubt_time = quantity("s", "time constant of the balance's doubt")
    zero_wander = quantity("N2/s", "growth of the variance of a zero")
    air_load = quantity("N", "a foot that is not meant to carry and bears less is in the air")
    air_dwell = quantity("s", "once it has for so long")
    air_sd = quantity("N", "standard deviation of its load then")
    learns_in_air = quantity("1", "0/1: zeros are learnt from feet in the air")
    balances = quantity("1", "0/1: the body's balance is used")
    only_pushes = quantity("1", "0/1: a foot pushes and does not pull")
    shakes = quantity("1", "0/1: the body's acceleration shows fast changes of the loads")
    carries = quantity("N", "load from which a foot takes its part in these")
    noise_sd = quantity("N", "noise of a filtered load")
    moving_sd = quantity("N", "error by inertia and friction while the piston slides")
    steady_sd = quantity("N", "the same while the body moves steadily")
    reported = part(ReportedShares, "shares of the standard deviation that an interval reports")
    range_noise = quantity("N", "range of a piston's force by noise alone")
    spread_share = quantity("1", "share of the filter's standard deviation for the spread")
    spread_stuck = quantity("1", "share of that for a vertical piston that never slid")
    set_margin = quantity("1", "margin of friction's set at either end, share of its width")
    surprise = part(SurpriseNumbers, "prior and memory of the surprise")
    news_share = quantity("1", "share of a change of force at rest that may be friction's")
    news_noise = quantity("N", "part of such a change that is noise")
    calibrated_at = quantity("degC", "temperature of the sensors' calibration")
    base_mass = quantity("kg", "of body and turntables")
    body_mass = quantity(
        "kg", "of all that moves with the body: the machine without frames and feet"
    )
    base_centre = quantity("m", "its centre from the body's origin", per=XYZ)
    inertia = quantity("kg m2", "of the whole machine about the body's origin", per=(XYZ, XYZ))
    balance_sd = quantity("N", "expected error of the balance (moments N m)", per=unknowns.WRENCH)
    linkages = part(Linkage, "from joint to rod", per=AXES)
    weight = quantity("N", "of the machine")
    belly_height = quantity("m", "underside of the belly above the body's origin")
    belly_length = quantity("m", "half of it, along x")
    belly_width = quantity("m", "half of it, along y")
    foot_height = quantity("m", "underside of a foot above the origin, joints at 0", per=LEGS)
    rope_point = quantity("m", "where the ropes pull, body frame", per=(SIDES, XYZ))
    rope_direction = quantity("1", "towards the anchors at the start, world", per=(SIDES, XYZ))
    rope_distance = quantity("m", "to the anchors at the start; infinite: unknown", per=SIDES)
    pin_gain = quantity("1", "reading of a load pin by true tension", per=SIDES)
    pin_zero = quantity("N", "reading of a slack rope's load pin", per=SIDES)
    unit_roll = quantity("rad", "how the inertial unit is turned against the body")
    unit_pitch = quantity("rad", "the same, about its y axis before x")
    drill_point = quantity("m", "where the drill pushes, body frame", per=XYZ)
    store_point = quantity("m", "where the store of rods is, body frame", per=XYZ)
    filter = part(persistent.Numbers, "of the foot loads")
    decisions = part(Decisions, "common to the axes")
    legs = part(LegNumbers, "masses and geometry", per=LEGS)
    axes = part(AxisBelief, "cylinders", per=AXES)


class Gathered(Record):
    """Between two balances: sums, then means."""

    foot_force = quantity("N", "by the legs' equations, before learnt errors", per=(LEGS, XYZ))
    rope_tension = quantity("N", "tensions", per=SIDES)
    angular_rate = quantity("rad/s", "of the body", per=XYZ)
    specific_force = quantity("m/s2", "of the body's origin", per=XYZ)
    cylinder_force = quantity("N", "friction included", per=AXES)


class BodyState(Record):
    """What is known of the whole machine."""

    joints = part(JointMotion, "motion of the joints by the cylinders' sensors")
    motion = part(BodyMotion, "motion of the body, taken as standing still, body frame")
    axes = part(AxisState, "cylinders", per=AXES)
    fusion = part(Fusion, "the Kalman filter of the errors")
    sums = part(Gathered, "since the last balance, added up")
    means = part(Gathered, "at the last balance")
    count = quantity("1", "samples in the sums")
    started = quantity("1", "1 after the first balance, 2 after the first answer")
    doubt = quantity("1", "standard deviation of the balance over the believed one (doubt.py)")
    unsteady = quantity("N", "change of the body's inertial force since the balance before")
    in_air = quantity("s", "for how long a foot has been in the air", per=LEGS)
    learnt_in_air = part(LearntInAir, "by the last balances in the air", per=LEGS)
    filters = part(persistent.PersistentState, "of the foot loads", per=LEGS)
    support = part(Support, "whether something that no sensor measures carries the body")
    ropes = part(RopeBearings, "where the ropes lead by now, world frame")
    shaken = part(AccelerationMemory, "fast changes of the loads")
    stirred = part(Stirred, "how unsteadily the body moves")
    surprise = part(SurpriseState, "how much further from its belief the machine is than told")
    ranges = part(ForceRange, "of the vertical pistons' forces", per=LEGS)
    level = quantity("N", "filtered force along x and y", per=(LEGS, ("x", "y")))
    force_sd = quantity(
        "N", "standard deviation of a foot force at the last balance", per=(LEGS, XYZ)
    )
    spread = quantity("N", "of a foot's load, for detectors, at the last balance", per=LEGS)
    last_force = quantity("N", "foot forces of the last step", per=(LEGS, XYZ))
    zero_variance = quantity(
        "N2", "prior variance of the zeros so far, grown with warmth", per=AXES
    )
