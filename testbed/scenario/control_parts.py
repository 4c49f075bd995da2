"""The parts of a scenario that say what the machine believes, estimates, and does about its
loads.
"""

from __future__ import annotations

from typing import Annotated, Literal

from pydantic import Field, model_validator

from testbed.formats.checked import Checked, NameOrClass, Numbers, impossible

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
    exact: not at all; null: as machine.draw
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
