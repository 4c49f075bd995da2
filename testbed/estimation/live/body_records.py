"""What the whole-body estimate believes of the machine and knows of it by now: named records."""

from __future__ import annotations

from testbed.estimation.filters import persistent
from testbed.estimation.live import fusion as fu
from testbed.estimation.live.axis import AxisBelief, AxisState, Decisions
from testbed.estimation.live.belly_support import Support
from testbed.estimation.live.body_acceleration import AccelerationMemory
from testbed.estimation.live.body_stirred import Stirred
from testbed.estimation.live.cylinder_errors import LearntInAir
from testbed.estimation.live.surprise import SurpriseNumbers, SurpriseState
from testbed.estimation.live.told_friction import ForceRange, ToldShares
from testbed.formats.records import Record, part, quantity
from testbed.machine.names import AXES, LEGS, SIDES
from testbed.recording.rows import XYZ
from testbed.robot.linkage import Linkage
from testbed.robot.loads import foot_forces as ff
from testbed.robot.rope_bearings import RopeBearings


class BodyBelief(Record):
    """What is believed of the whole machine, and how sure the estimate is of what."""

    believed = quantity(
        "1", "1: the whole machine; 0: each vertical cylinder is estimated by itself"
    )
    every = quantity("1", "steps between two balances")
    gravity = quantity("m/s2", "strength")
    sliding_keep = quantity("s", "for how long friction deviates while sliding")
    rest_keep = quantity("s", "the same at rest")
    alike = quantity("1", "correlation of friction between vertical cylinders long at rest")
    alike_after = quantity("s", "of rest, after which it is about there")
    balance_keep = quantity("s", "for how long the balance's own error lasts")
    rope_share = quantity("1", "of the ropes' tensions, that the balance may be off by")
    known = quantity("N", "standard deviations of what is constant", per=fu.CONSTANTS)
    drill_share = quantity("1", "of the ordered thrust, likewise")
    blow_share = quantity("1", "of the thrust, by blows, likewise")
    force_variance = quantity("N2", "of the balance of forces")
    moment_variance = quantity("N2 m2", "of the balance of moments")
    gate = quantity("1", "standard deviations beyond which an observation counts less")
    blame_memory = quantity("s", "over which the balance is looked at for a sensor that lies")
    blame_threshold = quantity("1", "standard deviations at which one is blamed; 0: never")
    doubt_cost = quantity("1", "cost of a balance that is still believed (doubt.py); 0: any")
    doubt_time = quantity("s", "within which the balance's doubt grows and fades")
    zero_wander = quantity("N2/s", "by which a zero wanders")
    air_load = quantity("N", "less than this a foot that is not meant to carry is in the air")
    air_dwell = quantity("s", "for so long")
    air_sd = quantity("N", "how surely it then carries nothing")
    learns_in_air = quantity("1", "0/1: zeros are learnt from feet in the air")
    balances = quantity("1", "0/1: the body's balance is used")
    only_pushes = quantity("1", "0/1: a foot pushes and does not pull")
    shakes = quantity("1", "0/1: the body's acceleration shows fast changes of the loads")
    carries = quantity("N", "from this load on a foot carries its share of these")
    noise_sd = quantity("N", "noise of a filtered load")
    moving_sd = quantity("N", "what inertia and friction leave beside it while the piston slides")
    steady_sd = quantity("N", "the same where the body goes steadily")
    told = part(ToldShares, "of what friction makes, in an interval")
    range_noise = quantity("N", "over which a piston's force seems to go by noise alone")
    spread_share = quantity("1", "of the filter's standard deviation, that makes the spread")
    spread_stuck = quantity("1", "of that, on a vertical piston that never slid")
    set_margin = quantity("1", "by which friction's set may be wider than believed, of its width")
    surprise = part(SurpriseNumbers, "how readily the machine is believed to be otherwise")
    news_share = quantity("1", "of a change of force at rest, that may be friction's")
    news_noise = quantity("N", "of such a change, that is noise")
    calibrated_at = quantity("degC", "temperature of the sensors' calibration")
    base_mass = quantity("kg", "of body and turntables")
    body_mass = quantity("kg", "of all that moves with the body: without frames and feet")
    base_centre = quantity("m", "its centre from the body's origin", per=XYZ)
    inertia = quantity("kg m2", "of the whole machine about the body's origin", per=(XYZ, XYZ))
    balance_sd = quantity("N", "expected error of the balance (moments N m)", per=fu.WRENCH)
    linkages = part(Linkage, "from joint to rod", per=AXES)
    weight = quantity("N", "of the machine")
    belly_height = quantity("m", "underside of the belly above the body's origin")
    belly_length = quantity("m", "half of it, along x")
    belly_width = quantity("m", "half of it, along y")
    foot_height = quantity("m", "underside of a foot above the origin, joints at 0", per=LEGS)
    rope_point = quantity("m", "where the ropes pull, body frame", per=(SIDES, XYZ))
    rope_direction = quantity("1", "towards the anchors at the start, world", per=(SIDES, XYZ))
    rope_distance = quantity("m", "of the anchors then; infinite: nobody knows", per=SIDES)
    pin_gain = quantity("1", "reading of a load pin by true tension", per=SIDES)
    pin_zero = quantity("N", "reading of a slack rope's load pin", per=SIDES)
    unit_roll = quantity("rad", "how the inertial unit is turned against the body")
    unit_pitch = quantity("rad", "the same, about its y axis before x")
    drill_point = quantity("m", "where the drill pushes, body frame", per=XYZ)
    store_point = quantity("m", "where the store of rods is, body frame", per=XYZ)
    filter = part(persistent.Numbers, "of the foot loads")
    decisions = part(Decisions, "common to the axes")
    legs = part(ff.LegNumbers, "masses and geometry", per=LEGS)
    axes = part(AxisBelief, "cylinders", per=AXES)


class Gathered(Record):
    """Between two balances: sums, then means."""

    foot_force = quantity("N", "of the legs' equations, nothing learnt taken off", per=(LEGS, XYZ))
    rope_tension = quantity("N", "tensions", per=SIDES)
    angular_rate = quantity("rad/s", "of the body", per=XYZ)
    specific_force = quantity("m/s2", "of the body's origin", per=XYZ)
    cylinder_force = quantity("N", "friction included", per=AXES)


class BodyState(Record):
    """What is known of the whole machine."""

    joints = part(ff.JointMotion, "of the cylinders' sensors")
    motion = part(ff.BodyMotion, "as if it stood still, body frame")
    axes = part(AxisState, "cylinders", per=AXES)
    fusion = part(fu.Fusion, "what the cylinders' forces are off by")
    sums = part(Gathered, "since the last balance, added up")
    means = part(Gathered, "at the last balance")
    count = quantity("1", "samples in the sums")
    started = quantity("1", "1 after the first balance, 2 after the first answer")
    doubt = quantity("1", "standard deviation of the balance over the believed one (doubt.py)")
    unsteady = quantity("N", "change, since the balance before, of what the acceleration asks for")
    in_air = quantity("s", "for how long a foot has been in the air", per=LEGS)
    learnt_in_air = part(LearntInAir, "of the last moments in the air", per=LEGS)
    filters = part(persistent.PersistentState, "of the foot loads", per=LEGS)
    support = part(Support, "what carries the body that no sensor reads")
    ropes = part(RopeBearings, "where the ropes lead by now, world frame")
    shaken = part(AccelerationMemory, "fast changes of the loads")
    stirred = part(Stirred, "how unsteadily the body goes")
    surprise = part(SurpriseState, "how much further off the machine is than believed")
    ranges = part(ForceRange, "of the vertical pistons' forces", per=LEGS)
    level = quantity("N", "filtered force along x and y", per=(LEGS, ("x", "y")))
    force_sd = quantity(
        "N", "standard deviation of a foot force at the last balance", per=(LEGS, XYZ)
    )
    spread = quantity("N", "of a foot's load by one share of all, at the last balance", per=LEGS)
    last_force = quantity("N", "foot forces of the last step", per=(LEGS, XYZ))
    zero_variance = quantity("N2", "what the zeros' variance has been granted so far", per=AXES)
