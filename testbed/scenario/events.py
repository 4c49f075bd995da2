"""What happens to a machine at a time that the scenario names; what must come out of the run, and
under which change it must not.
"""

from __future__ import annotations

import json
from typing import Annotated, Any, Literal

from pydantic import Field, field_validator, model_validator

from testbed.formats.checked import Checked, Triple, impossible
from testbed.machine.names import AXES

Leg = Literal["fl", "fr", "rl", "rr"]
Side = Literal["left", "right"]


A_MOMENT = 1e-6
"""Share of a tick that counts as none of it: times are sums of binary fractions."""


def share_of_tick(t: float, dt: float, begins_s: float, duration_s: float) -> float:
    """Share of the tick from t to t + dt (s) in which something lasts that begins at `begins_s`:
    over all ticks these make its duration, whether or not it begins and ends with one.
    """
    share = (min(t + dt, begins_s + duration_s) - max(t, begins_s)) / dt
    return 0.0 if share < A_MOMENT else 1.0 if share > 1.0 - A_MOMENT else share


class CutRope(Checked):
    """A rope parts: from then on it carries nothing."""

    kind: Literal["cut_rope"]
    at_s: float = Field(ge=0)
    """time of the event [s]"""
    rope: Side
    """left or right"""


class SetRope(Checked):
    """The traction device pays rope out (positive) or takes it in (negative)."""

    kind: Literal["set_rope"]
    at_s: float = Field(ge=0)
    """time of the event [s]"""
    rope: Side
    """left or right"""
    pay_out_m: float = Field(ge=-5, le=5)
    """length paid out; negative: taken in [m]"""
    duration_s: float = Field(default=1.0, gt=0)
    """time it takes [s]"""


class Payload(Checked):
    """A load is put on the rod store (or, negative, taken off)."""

    kind: Literal["payload"]
    at_s: float = Field(ge=0)
    """time of the event [s]"""
    mass_kg: float = Field(ge=-2000, le=2000)
    """mass put on the rod store [kg]"""


class Shove(Checked):
    """A force on the body or on a foot for a while: a rock, a gust, a person. Its momentum is force
    times duration: a tick of the control (100 Hz) that it fills in part has its mean.
    """

    kind: Literal["shove"]
    at_s: float = Field(ge=0)
    """time of the event [s]"""
    duration_s: float = Field(default=0.2, gt=0)
    """how long it lasts [s]"""
    force_in_world_n: Triple
    """force in the world frame [N]"""
    at: Literal["body", "fl", "fr", "rl", "rr"] = "body"
    """the body, at its centre of mass, or a foot, at its underside"""


class SetFriction(Checked):
    """Rain or dust: the ground has another friction from then on, but for patches and feet with a
    friction of their own.
    """

    kind: Literal["set_friction"]
    at_s: float = Field(ge=0)
    """time of the event [s]"""
    friction: float = Field(ge=0, le=2)
    """the ground's friction coefficient [1]"""


class LiftFoot(Checked):
    """The control lifts one foot off the ground for a while: a true loss of contact."""

    kind: Literal["lift_foot"]
    at_s: float = Field(ge=0)
    """time of the event [s]"""
    leg: Leg
    """which leg"""
    height_m: float = Field(default=0.05, gt=0, le=0.3)
    """how far the foot is lifted [m]"""
    duration_s: float = Field(default=2.0, gt=0)
    """from lift-off to touch-down [s]"""
    reach_share: float = Field(default=0.0, ge=0, le=1)
    """how far the leg goes meanwhile to either end of its radial and rotation ranges, and as high
    again as it is lifted, by the way there [1]
    """


class SetSupply(Checked):
    """The pressure of the hydraulic power unit changes."""

    kind: Literal["set_supply"]
    at_s: float = Field(ge=0)
    """time of the event [s]"""
    pressure_pa: float = Field(ge=0, le=3.5e7)
    """new set pressure [Pa]"""


class FailSensor(Checked):
    """A pressure transducer fails: it stays where it is, or reads nothing."""

    kind: Literal["fail_sensor"]
    at_s: float = Field(ge=0)
    """time of the event [s]"""
    at: str = "fl_vertical"
    """<leg>_<joint>"""
    chamber: Literal["a", "b"] = "a"
    """which chamber's transducer"""
    how: Literal["stuck", "dead"] = "stuck"
    """stuck: shows what it showed last; dead: shows 0"""

    @field_validator("at")
    @classmethod
    def _an_axis(cls, value: str) -> str:
        if value not in AXES:
            raise impossible("no transducer sits there", ", ".join(AXES))
        return value


class Stop(Checked):
    """A walk waits for a while, between two of its motions."""

    kind: Literal["stop"]
    at_s: float = Field(ge=0)
    """time of the event [s]"""
    duration_s: float = Field(gt=0)
    """how long it waits [s]"""


class Turn(Checked):
    """A walk goes on in another direction, with the steps that are left."""

    kind: Literal["turn"]
    at_s: float = Field(ge=0)
    """time of the event [s]"""
    heading_deg: float = Field(ge=-180, le=180)
    """direction of travel, from straight up the slope to the left [deg]"""


Event = Annotated[
    CutRope
    | SetRope
    | Payload
    | Shove
    | SetFriction
    | LiftFoot
    | SetSupply
    | FailSensor
    | Stop
    | Turn,
    Field(discriminator="kind"),
]


class Bound(Checked):
    """What a number of the summary must be."""

    min: float | None = None
    """at least"""
    max: float | None = None
    """at most"""
    equals: float | str | bool | None = None
    """exactly"""

    @model_validator(mode="after")
    def _says_something(self) -> Bound:
        if self.min is None and self.max is None and self.equals is None:
            raise impossible("bounds nothing", "min, max or equals")
        if self.equals is not None and (self.min is not None or self.max is not None):
            raise impossible("equals beside min or max", "one of both")
        if self.min is not None and self.max is not None and self.min > self.max:
            raise impossible("no number is so large and so small", "min up to max")
        return self


class Expect(Checked):
    """What must come out of the run; the tests check it."""

    verdict: (
        Literal["stood", "off its feet", "lost footing", "fell", "slid", "rope broke"] | None
    ) = None
    """how the run must end"""
    summary: dict[str, Bound] = Field(default_factory=dict)
    """dotted path in summary.json -> bound"""


class Mutation(Checked):
    """Changes of the scenario under which its `expect` must fail: proof that it says something. A
    run ignores it.
    """

    set: dict[str, Any] = Field(min_length=1)
    """dotted path of a value of this scenario -> its changed value"""
    because: str = Field(min_length=1)
    """why the expectation must then fail"""

    def overrides(self) -> list[str]:
        """The changes as `load_scenario` and `--set` take them: `a.b=c`."""
        return [f"{path}={json.dumps(value)}" for path, value in self.set.items()]
