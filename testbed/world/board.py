"""One record that holds the world outside the engine: everything that a run steps, each part by its
name.

A compiled call pays for every array it is handed; on one board they come as one. A copy of the
board is a snapshot of the world outside the engine.
"""

from __future__ import annotations

from testbed.control.valve_loop import PositionLoop
from testbed.formats.records import Record, part, quantity
from testbed.laws.axis_records import AxisInput, AxisParameters, AxisState
from testbed.laws.drill import DrillLoads
from testbed.laws.rope import Rope
from testbed.laws.supply import PowerUnit, SupplyState
from testbed.laws.traction import TractionParameters, TractionState
from testbed.machine.names import AXES, LEGS, SIDES
from testbed.recording.rows import XYZ
from testbed.robot.linkage import Linkage
from testbed.robot.loads.foot_forces import BodyMotion, JointMotion, LegNumbers
from testbed.world.sensing import CHAMBERS, OtherSensors, Transducer

QUATERNION = ("x", "y", "z", "w")


class EngineState(Record):
    """What is read from the engine in one go."""

    joint = quantity("m", "positions of the joints (rotation: rad)", per=AXES)
    joint_rate = quantity("m/s", "rates of the joints (rotation: rad/s)", per=AXES)
    position = quantity("m", "centre of mass of the base, world frame", per=XYZ)
    quaternion = quantity("1", "principal axes of the base to world", per=QUATERNION)


class EngineInput(Record):
    """What acts on the machine during the next engine step, beside gravity and ground."""

    joint_torque = quantity("N", "forces along the joints (rotation: torque, N m)", per=AXES)
    force = quantity("N", "on the base at its centre of mass, world frame", per=XYZ)
    torque = quantity("N m", "on the base, world frame", per=XYZ)


class BodyState(Record):
    """The body's motion, world frame."""

    position = quantity("m", "centre of mass of the base", per=XYZ)
    quaternion = quantity("1", "body frame to world", per=QUATERNION)
    velocity = quantity("m/s", "of the centre of mass", per=XYZ)
    angular_velocity = quantity("rad/s", "turning", per=XYZ)


class Clock(Record):
    """Steps, and where the run is in them."""

    step = quantity("1", "engine steps done", kind="i8")
    recorded = quantity("1", "rows recorded of this block", kind="i8")
    step_s = quantity("s", "an engine step")
    control_step_s = quantity("s", "a step of the position loops")
    steps_a_sample = quantity("1", "engine steps from one sample to the next", kind="i8")
    substeps = quantity("1", "of the hydraulics in an engine step", kind="i8")


class Board(Record):
    """The world outside the engine."""

    clock = part(Clock, "steps")
    engine = part(EngineState, "as last read")
    given = part(EngineInput, "for the next engine step")
    body = part(BodyState, "motion of the body")
    base_turn = quantity("1", "principal axes of the base in the body frame", per=QUATERNION)
    base_centre = quantity("m", "centre of mass of the base, body frame", per=XYZ)
    rotation = quantity("1", "body to world", per=(XYZ, XYZ))
    motion = part(BodyMotion, "change of the base's motion over the last step, world frame")
    before = part(JointMotion, "the joints before the last engine step, and over it")
    legs = part(LegNumbers, "masses and axes, hips from the base's centre of mass", per=LEGS)
    foot_force = quantity("N", "ground on the foot, world frame", per=(LEGS, XYZ))
    normal_force = quantity("N", "its part along the ground's normal", per=LEGS)
    ground_normals = quantity("1", "of the ground under the feet, world frame", per=(LEGS, XYZ))
    axes = part(AxisState, "hydraulics of the joints", per=AXES)
    parameters = part(AxisParameters, "of these", per=AXES)
    inputs = part(AxisInput, "what acts on them over the step", per=AXES)
    extension = quantity("m", "of the rods", per=AXES)
    arms = quantity("m/rad", "extension by joint position (straight: 1)", per=AXES)
    linkages = part(Linkage, "from joint to rod", per=AXES)
    supply = part(SupplyState, "oil between pump and valves")
    unit = part(PowerUnit, "the power unit")
    ropes = part(Rope, "the ropes", per=SIDES)
    devices = part(TractionState, "their traction devices", per=SIDES)
    traction = part(TractionParameters, "of both devices")
    drill_point = quantity("m", "where the drill acts, body frame", per=XYZ)
    drill = part(DrillLoads, "what the drill does")
    drill_phase = quantity("1", "blows so far")
    drill_wrench = quantity(
        "N",
        "of the drill on the body about the drill point, world frame",
        per=("fx", "fy", "fz", "tx", "ty", "tz"),
    )
    shove = quantity("N", "somebody pushes the base, world frame", per=XYZ)
    foot_shove = quantity("N", "somebody pushes a foot's underside, world frame", per=(LEGS, XYZ))
    foot_height = quantity(
        "m", "underside of a foot over the base's centre of mass, joints at 0", per=LEGS
    )
    transducers = part(Transducer, "pressure transducers", per=(CHAMBERS, AXES))
    sensors = part(OtherSensors, "the other sensors")
    gravity_in_body = quantity("m/s2", "as the inertial unit has it", per=XYZ)
    loops = part(PositionLoop, "of the valves", per=AXES)
    valves_locked = quantity("1", "1: no valve answers its command", kind="i8")
