"""The rows of a recorded run: what the machine's electronics know, and what only a simulator knows.

Declared once. The compiled loop writes these records, the recorder's columns and the environments'
observations are their fields, and the contract's column names follow from the names here.
"""

from __future__ import annotations

from testbed.formats.records import Record, part, quantity
from testbed.machine.names import AXES, LEGS, SIDES

XYZ = ("x", "y", "z")
ANGLES = {"_rotation": "rad"}
"""The first joint of a leg turns; the other two slide."""


class Estimates(Record):
    """Foot load along the vertical joint's axis by every method, N, one number a foot."""

    one_chamber = quantity("N", "piston side alone, the paper's (1)", per=LEGS)
    two_chamber = quantity("N", "both chambers, the paper's (3)", per=LEGS)
    friction = quantity("N", "less friction, weight and inertia of the frame: (7)", per=LEGS)
    kbf = quantity("N", "(7) through the paper's Kalman-based filter (6)", per=LEGS)
    modified_kbf = quantity("N", "(7) through the paper's modified filter", per=LEGS)
    own = quantity("N", "the whole-body estimate", per=LEGS)


METHODS = tuple(Estimates.fields)


class Interval(Record):
    """How sure an estimate of the foot loads is."""

    low = quantity("N", "lower end of the 90 % interval", per=LEGS)
    high = quantity("N", "upper end of the 90 % interval", per=LEGS)
    sd = quantity("N", "standard deviation", per=LEGS)
    spread = quantity(
        "N",
        "standard deviation with one share of all that is not known, constants and friction alike: "
        "what learned contact detectors weigh the estimate by",
        per=LEGS,
    )


class FootForces(Record):
    """Force of the ground on each foot by the whole-body estimate, body frame, and its standard
    deviation.
    """

    x = quantity("N", "force of the ground on the foot along body x", per=LEGS)
    y = quantity("N", "force of the ground on the foot along body y", per=LEGS)
    z = quantity("N", "force of the ground on the foot along body z", per=LEGS)
    x_sd = quantity("N", "standard deviation of x", per=LEGS)
    y_sd = quantity("N", "standard deviation of y", per=LEGS)
    z_sd = quantity("N", "standard deviation of z", per=LEGS)


class SensorRow(Record):
    """What the machine's sensors read, and the valve commands that were out meanwhile."""

    t = quantity("s", "time")
    position = quantity(
        "m", "encoder: extension of the joint (rotation: angle)", per=AXES, units=ANGLES
    )
    pressure_a = quantity("Pa", "piston side, gauge, through calibration", per=AXES)
    pressure_b = quantity("Pa", "rod side, gauge, through calibration", per=AXES)
    valve = quantity("1", "valve command, -1 to 1, + extends", per=AXES)
    supply_pressure = quantity("Pa", "supply pressure, gauge")
    oil_temperature = quantity("degC", "oil temperature")
    rope_tension = quantity("N", "tension at the traction device", per=SIDES)
    attitude = quantity(
        "rad", "inertial unit: roll, pitch, yaw of the body", per=("roll", "pitch", "yaw")
    )
    angular_rate = quantity("rad/s", "inertial unit: rate in the body frame", per=XYZ)
    specific_force = quantity(
        "m/s2", "inertial unit at the body's origin: acceleration less gravity, body frame", per=XYZ
    )


class KnownRow(Record):
    """What estimators, the model and control make of it."""

    estimate = part(Estimates, "foot load along the vertical joint's axis, by method")
    estimate_own = part(Interval, "how sure the own estimate is", column="own")
    own = part(FootForces, "force of the ground on the foot by the own estimate")
    own_balance_doubt = quantity(
        "1",
        "how much less the body's balance is trusted than believed: more than 1 where pressures "
        "contradict weight, ropes or drill",
    )
    own_surprise = quantity(
        "1",
        "how much further from its belief the machine seems than was told, by the square: 1 as "
        "told; intervals are wider by the root",
    )
    contact = quantity("1", "contact state by the detector: 1 loaded, 0 contact lost", per=LEGS)
    expected = quantity(
        "N", "foot load along the vertical joint's axis that the model expects", per=LEGS
    )
    reference = quantity("m", "set point of the joint (rotation: angle)", per=AXES, units=ANGLES)
    carrying = quantity(
        "1", "stance as control wishes it: 1 the foot is meant to carry, 0 it swings", per=LEGS
    )


class DrillKnown(Record):
    """What the drill's own controls know: what they ordered, and where their rods are."""

    ordered_thrust = quantity(
        "N", "drill as control ordered it: thrust away from the ground along body z"
    )
    ordered_torque = quantity("N m", "torque that the rock answers with, about body z")
    rods_in_hole = quantity("kg", "rods in the hole, the drill's own count")
    rods_in_mast = quantity("kg", "rods in the mast, the drill's own count")
    rods_mast_height = quantity("m", "middle of the rods in the mast above the drill point")
    rods_stored = quantity("kg", "rods gained by the store since the start")


class DataRow(SensorRow, KnownRow, DrillKnown):
    """One row of `data`: sensors, estimates, what control ordered, and the drill's own count of its
    rods.
    """


class TruthRow(Record):
    """One row of `truth`: read by the evaluation alone."""

    t = quantity("s", "time")
    body_pose_in_world = quantity(
        "m",
        "body link's origin, and its quaternion",
        per=("x", "y", "z", "qx", "qy", "qz", "qw"),
        units={"_qx": "1", "_qy": "1", "_qz": "1", "_qw": "1"},
    )
    foot_force_in_world = quantity("N", "force of the ground on the foot", per=(LEGS, XYZ))
    foot_load = quantity("N", "foot force along the vertical joint's axis", per=LEGS)
    contact_normal = quantity("N", "foot force along the ground's normal", per=LEGS)
    rope_force_in_world = quantity("N", "force of the rope on the body", per=(SIDES, XYZ))
    drill_wrench_in_world = quantity(
        "N",
        "drill on the body about the drill point: force and torque",
        per=("fx", "fy", "fz", "tx", "ty", "tz"),
        units={"_tx": "N m", "_ty": "N m", "_tz": "N m"},
    )
    friction = quantity("N", "seal and guide friction of the cylinder, against + rate", per=AXES)
    chamber_a = quantity("Pa", "true pressure, piston side, gauge", per=AXES)
    chamber_b = quantity("Pa", "true pressure, rod side, gauge", per=AXES)
    supply_pressure = quantity("Pa", "true supply pressure, gauge")
    oil_temperature = quantity("degC", "true oil temperature")
    pump_power = quantity(
        "W", "hydraulic power that the pump puts in, mean over the last physics step"
    )
    hole_depth = quantity("m", "depth of the drilled hole")
    drill_string_mass = quantity("kg", "rods in hole and mast")
    traction_stroke = quantity("m", "place of the traction device's piston", per=SIDES)
    traction_mode = quantity("1", "what the traction device does (laws/traction.py)", per=SIDES)
