"""The parts of a scenario that say what the world is: rates, machine, posture, ropes, hydraulics,
sensors, undeclared effects.
"""

from __future__ import annotations

from typing import Annotated, Literal, get_args

from pydantic import Field, ValidationInfo, field_validator, model_validator

from testbed.formats.checked import Checked, Four, NameOrClass, Numbers, Pair, Sequence, impossible
from testbed.machine.names import AXES, LEGS
from testbed.machine.provenance import DEFAULT, SetName

HydraulicPart = Literal[
    "friction",
    "coulomb",
    "stribeck",
    "viscous",
    "dwell",
    "friction_position",
    "friction_pressure",
    "friction_load",
    "friction_side_load",
    "leakage",
    "internal_leakage",
    "outer_leakage",
    "edge_leakage",
    "air",
    "hose",
    "hose_elasticity",
    "deadband",
    "hysteresis",
    "valve_dynamics",
    "amplifier_lag",
    "edge_asymmetry",
    "load_holding",
    "cushions",
    "end_stops",
    "line_b",
    "transducer_lag",
    "load_sensing",
    "supply_droop",
    "accumulator",
    "pump_lag",
    "power_limit",
    "relief",
    "case_leakage",
    "oil_warming",
    "viscosity",
]
HYDRAULIC_PARTS: tuple[str, ...] = get_args(HydraulicPart)
"""The one list: the scenario checks against it, the world has a switch for each
(testbed.world.switches).
"""


SensorPart = Literal[
    "encoder", "pressure", "supply_pressure", "rope_tension", "inertial", "oil_temperature"
]
PLACES: tuple[str, ...] = (
    *AXES,
    *LEGS,
    *(f"foot_{leg}" for leg in LEGS),
    "rope",
    "rope_left",
    "rope_right",
    "body",
    "drill",
    "supply",
)
"""Where an undeclared effect may sit."""


TICK_HZ = 100
"""Rate of the slow tick: events, drill, gait, judge, ground [Hz]."""


class Rates(Checked):
    """How often each part of the loop runs; all divide the rate of the physics."""

    physics_hz: int = Field(default=1000, ge=100, le=20000)
    """steps of the bodies and contacts [Hz]"""
    hydraulic_substeps: int = Field(default=2, ge=1, le=200)
    """steps of the oil within one step of the bodies"""
    control_hz: int = Field(default=1000, ge=1)
    """position controllers [Hz]"""
    sensor_hz: int = Field(default=1000, ge=1)
    """sensors are sampled [Hz]"""
    estimator_hz: int = Field(default=1000, ge=200)
    """force estimates and contact states; slower, their observers diverge [Hz]"""
    expected_loads_hz: int = Field(default=10, ge=1)
    """expected foot loads from the model [Hz]"""
    record_hz: int = Field(default=1000, ge=1)
    """rows written [Hz]"""

    @model_validator(mode="after")
    def _whole_multiples(self) -> Rates:
        for name in ("control_hz", "sensor_hz", "estimator_hz", "expected_loads_hz", "record_hz"):
            value = getattr(self, name)
            if self.physics_hz % value:
                raise impossible(
                    f"{name} = {value} does not divide physics_hz = {self.physics_hz}",
                    "a whole fraction of physics_hz",
                )
        return self


class OwnMachine(Checked):
    """Which machine world and model have, and by what the world's differs from its drawing."""

    folder: str | None = None
    """folder of a machine of your own, relative to the scenario file, or a shipped one by name
    (climber_8t, quarter_model); null: ROBOCLIMBER
    """
    set: SetName = DEFAULT
    """numbers of the drawing board: inferred (the circuit under which the paper's figures hold
    together), original (constant supply, edges that leak alike, no holding valves) or overlapped
    (inferred, with valves without spool feedback and an amplifier that jumps their overlap)
    """
    draw: Literal["workshop"] | None = None
    """tolerances from which the world's machine is drawn; the model keeps the drawing-board
    machine; null: the world has that one too
    """
    seed: int = Field(default=0, ge=0, le=2**32 - 1)
    """which of the machines that could be drawn"""

    @model_validator(mode="after")
    def _seed_of_a_draw(self) -> OwnMachine:
        if self.folder is not None and self.set != DEFAULT:
            raise impossible("has a set, which machine.yaml of its folder chooses", "set there")
        if self.draw is None and self.seed != 0:
            raise impossible("has a seed, but nothing is drawn", "draw: workshop beside it")
        return self


class Robot(Checked):
    """The start posture and what the robot carries."""

    urdf: str | None = None
    """another URDF than the shipped one; relative to the scenario file"""
    vertical_m: Four = (0.25,) * 4
    """extension of the vertical joints, one for all; legs on the ground then reach for it. Four of
    their own (fl, fr, rl, rr) only with a height_offset_m, from where they come down [m]"""
    radial_m: Four = (0.2,) * 4
    """extension of the radial joints [m]"""
    rotation_deg: Four = (0.0,) * 4
    """angle of the rotation joints from their middle [deg]"""
    payload_kg: float = Field(default=0.0, ge=0, le=2000)
    """extra mass on the platform [kg]"""
    height_offset_m: float = Field(default=0.0, le=1)
    """how far above its ground the foot that is nearest to it starts; 0: all stand on it [m]"""

    @field_validator("height_offset_m")
    @classmethod
    def _feet_above_ground(cls, value: float) -> float:
        if value < 0:
            raise impossible(f"puts the feet {-value:g} m under the ground", "0 to 1 m")
        return value


class Ropes(Checked):
    """Two ropes from anchors above the robot to its traction devices; they pull and never push."""

    enabled: bool = True
    """false: no ropes"""
    anchor_distance_m: float = Field(default=30.0, ge=3, le=500)
    """anchors above the robot, along the slope [m]"""
    anchor_spread_m: float = Field(default=10.0, ge=0, le=200)
    """distance between the two anchors [m]"""
    azimuth_deg: float = Field(default=0.0, ge=-60, le=60)
    """where the anchors' middle lies, from straight up the slope to the left [deg]"""
    share: float = Field(default=0.9, ge=0, le=1.5)
    """share of the weight along the slope that the ropes carry at the start"""
    pull: Literal["equal", "straight"] = "equal"
    """how they share at the start: equal tensions, or so that together they pull as straight up the
    slope as they can, where the anchors lie aside
    """
    attachment_height_m: float | None = Field(default=None, ge=-0.2, le=1.5)
    """height of the traction devices' sheaves in the body frame; null: the URDF's, 0.33 m. On 85
    degrees each centimetre off the balance shifts the feet's loads by 11 cm of the 2.5 m that
    they stand apart; 0.33 balances the pull along the slope at a share of 0.95 [m]
    """
    tension_n: Pair | None = None
    """tension at the start, left and right, instead of share [N]"""
    stiffness_ea_n: float = Field(default=9.8e6, ge=1e4, le=1e9)
    """stiffness EA; a rope of length L is a spring EA/L [N]"""
    damping_n_s_m: float = Field(default=5000.0, ge=0, le=1e6)
    """damping along a taut rope [N s/m]"""
    sag: bool = False
    """true: a rope sags by its own weight (a slack rope is slack either way)"""
    strokes: bool = True
    """true: the traction devices pull in strokes and regrip; false: as winches"""
    breaking_load_n: float = Field(default=149.0e3, gt=0)
    """tension at which a rope parts [N]"""

    @field_validator("tension_n")
    @classmethod
    def _no_push(
        cls, value: tuple[float, float] | None, others: ValidationInfo
    ) -> tuple[float, float] | None:
        if value is not None and min(value) < 0:
            raise impossible("a rope cannot push", "tensions of at least 0 N")
        if value is not None and others.data.get("pull") == "straight":
            raise impossible("says how the ropes pull, as ropes.pull does", "one of both")
        return value


class Hydraulics(Checked):
    """Oil, power unit and which physical parts of the hydraulics are left out."""

    oil_temperature_degc: float = Field(default=40.0, ge=-30, le=120)
    """temperature of the oil [degC]"""
    supply_pressure_pa: float | None = Field(default=None, ge=0, le=3.5e7)
    """set pressure of the power unit; null: the parameter file's [Pa]"""
    pump: bool = True
    """false: the power unit is off, tank pressure only"""
    valves_locked: bool = False
    """true: all valves closed and tight; the cylinders are oil springs"""
    stuck_seals: float = Field(default=0.0, ge=0.0, le=1.0)
    """largest share of break-away with which a seal is stuck at the start; each draws its own,
    either way [1]
    """
    without: Annotated[tuple[HydraulicPart, ...], Sequence] = ()
    """parts of the hydraulics left out"""
    parameters: Numbers = Field(default_factory=dict)
    """dotted path of roboclimber.yaml -> the world's value (SI)"""


class Sensors(Checked):
    """What the sensors add to the truth."""

    noise: bool = True
    """random noise"""
    quantisation: bool = True
    """encoder counts and converter steps"""
    thermal_drift: bool = True
    """zero error of the pressure transducers with temperature"""
    characteristic: bool = True
    """bow and hysteresis of the pressure transducers"""
    without: Annotated[tuple[SensorPart, ...], Sequence] = ()
    """sensors that read the truth, free of all errors"""


class Undeclared(Checked):
    """An effect that the world has and the model does not."""

    effect: str
    """name of the effect, such as sensor.gain_b"""
    at: str = "body"
    """<leg>_<joint>, <leg>, foot_<leg>, rope, rope_left, rope_right, body, drill or supply"""
    parameters: dict[str, float] = Field(default_factory=dict)
    """the effect's parameters (SI)"""

    @field_validator("at")
    @classmethod
    def _known_place(cls, value: str) -> str:
        if value not in PLACES:
            raise impossible("no such place on the robot", ", ".join(PLACES))
        return value


# The parts of a scenario that say what the machine believes, estimates, and does about its loads.

CONTROLLERS = ("position_hold", "pseudo_inverse", "qp", "drill", "learned")
"""The shipped ways to share the load out; control/distribution/controllers.py has the class of
each.
"""


class Model(Checked):
    """What the robot believes about itself, where it differs from the drawing board."""

    urdf: str | None = None
    """the URDF that estimators and control believe; null: robot.urdf, or the shipped one; relative
    to the scenario file
    """

    parameters: Numbers = Field(default_factory=dict)
    """dotted path of roboclimber.yaml -> the believed value (SI)"""
    tolerances: Literal["workshop", "exact"] | None = None
    """how far the machine may be from what is believed, so far as no model file says better: the
    whole-body estimate learns within these, and its intervals are as wide as they leave them;
    exact: not at all; null: as machine.draw, or the workshop's
    """


class Estimator(Checked):
    """Estimator, detector of the contact state, constants of the paper's filters (null: the
    parameter file's).
    """

    method: str = Field(default="own", min_length=1)
    """estimator of the foot loads that control, supervisor and detectors go by: a shipped one by
    name (one_chamber, two_chamber, friction, kbf, modified_kbf, own), or FILE.py:Class; its
    loads are recorded as estimate_own_<leg>
    """
    detector: str = Field(default="held", min_length=1)
    """detector of the contact state: a shipped one by name, or FILE.py:Class"""
    process_variance_n2: float | None = Field(default=None, gt=0)
    """Q of the random walk, per step [N2]"""
    measurement_variance_n2: float | None = Field(default=None, gt=0)
    """R of the measured force [N2]"""
    innovation_limit_n: float | None = Field(default=None, gt=0)
    """e_max of the modified filter [N]"""
    contact_threshold_n: float | None = Field(default=None, gt=0)
    """estimated load below which a foot is called lost [N]"""
    loss_share: float = Field(default=0.03, gt=0, lt=1)
    """share of the nominal load (a quarter of the weight) below which a foot has truly lost its
    contact: what the summary counts as a loss, and what detectors are judged by
    """
    loss_s: float = Field(default=0.02, ge=0, le=10)
    """for so long at least; shorter gaps are no losses, shorter touches no touchdowns [s]"""

    @model_validator(mode="after")
    def _threshold_has_its_detector(self) -> Estimator:
        shipped = (self.detector, self.method) == ("held", "own")
        if not shipped and self.contact_threshold_n is not None:
            raise impossible(
                "contact_threshold_n is that of the detector held on the estimate own",
                "it with estimator.detector: held and estimator.method: own; else the detector holds its own",
            )
        return self


class Control(Checked):
    """How the load is shared out between feet and ropes."""

    distribution: Annotated[str, NameOrClass(CONTROLLERS)] = "position_hold"
    """controller of the foot loads; position_hold leaves them alone"""
    dither_m: float = Field(default=0.0, ge=0, le=2e-3)
    """vertical set points wander up and down by this, all alike: friction at rest shows itself [m]

    """
    dither_hz: float = Field(default=2.0, gt=0, le=10)
    """how often a second [Hz]"""
    supervisor: bool = False
    """true: when a foot loses its load the drill stops and the foot is lowered"""
    thrust_reserve: float | None = Field(default=None, ge=0, lt=1)
    """share of the foot loads that the drill's feed must leave on the foot that it unloads first;
    the feed is held to what that allows on this slope; null: no bound, an event says when a foot
    would leave
    """
