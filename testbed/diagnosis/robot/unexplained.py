"""What no name covers: an error of any course in time at one cylinder, at the body or in one
cylinder's oil.

These stand beside the named effects as hypotheses of the same kind, with many more numbers, so the
evidence prefers a name wherever one of them fits.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import ClassVar

import numpy as np
import numpy.typing as npt

from testbed.effects.base import Effect
from testbed.effects.parameter_spec import ParameterSpec
from testbed.effects.signature import Change, RobotSeen, Signature, knots
from testbed.machine.names import AXES
from testbed.machine.scale import Scale

Array = npt.NDArray[np.float64]
UNNAMED = "unnamed"
FORCE_N, WRENCH_N, OIL_M3_S = 800.0, 1500.0, 1.0e-5
"""How large an unexplained force, wrench (N m alike) or flow may be expected to be (E)."""


class Unexplained(Effect):
    """What the three have in common."""

    equation = "an error of any course in time"
    text = "something that no effect of the list describes"
    parameters: ClassVar[tuple[ParameterSpec, ...]] = ()
    rigs = ()
    size: ClassVar[float] = 1.0
    unit: ClassVar[str] = "1"

    def spread(self, number: str) -> float:
        """See Effect."""
        return self.size

    def grows(self, number: str, scale: Scale) -> float:
        """See Effect."""
        return scale.times(self.unit)


class UnexplainedForce(Unexplained):
    """At one cylinder: a constant, a course in time, and one that turns with the direction of
    motion.
    """

    kind = f"{UNNAMED}.force"
    places = AXES
    size, unit = FORCE_N, "N"

    def signature(self, seen: RobotSeen, place: str) -> Signature:
        """Straight lines between knots, and the same against the motion."""
        i = seen.axis(place)
        ways = np.column_stack([np.ones(seen.bins), knots(seen.time_s)])
        against = ways * seen.direction[:, i, None]
        both = np.hstack([ways, against])
        return {f"{k}": Change(force={i: way}) for k, way in enumerate(both.T)}


class UnexplainedWrench(Unexplained):
    """On the body: constant in its own frame, and a course in time."""

    kind = f"{UNNAMED}.wrench"
    places = ("body",)
    size, unit = WRENCH_N, "N"

    def signature(self, seen: RobotSeen, place: str) -> Signature:
        """Each of six components by itself."""
        ways = np.column_stack([np.ones(seen.bins), knots(seen.time_s)])
        out = {}
        for axis in range(6):
            for k, way in enumerate(ways.T):
                wrench = np.zeros((seen.bins, 6))
                wrench[:, axis] = way
                out[f"{axis} {k}"] = Change(wrench=wrench)
        return out


class UnexplainedFlow(Unexplained):
    """In the oil of one cylinder, chambers apart."""

    kind = f"{UNNAMED}.flow"
    places = AXES
    size, unit = OIL_M3_S, "m3/s"

    def signature(self, seen: RobotSeen, place: str) -> Signature:
        """Straight lines between knots, for each chamber."""
        i = seen.axis(place)
        ways = np.column_stack([np.ones(seen.bins), knots(seen.time_s)])
        out = {}
        for chamber in (0, 1):
            for k, way in enumerate(ways.T):
                flow = np.zeros((seen.bins, 2))
                flow[:, chamber] = way
                out[f"{chamber} {k}"] = Change(oil={i: flow})
        return out


ALL_UNEXPLAINED: tuple[Effect, ...] = (
    UnexplainedForce(),
    UnexplainedWrench(),
    UnexplainedFlow(),
)


def is_unexplained(name: str) -> bool:
    """Whether a candidate's name stands for no name."""
    return name.startswith(UNNAMED)


def listed(names: Iterator[str] | tuple[str, ...]) -> bool:
    """Whether a set of candidates consists of named effects alone."""
    return not any(is_unexplained(name) for name in names)
