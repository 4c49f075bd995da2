"""Position hold, the machine as built: cylinders keep their set points, ropes their lengths, loads
fall as they may.

The baseline of the force-distributing controllers; as a Controller it never asks for anything.
"""

from __future__ import annotations

from testbed.control.distribution.distribution import Plan
from testbed.control.distribution.statics import Balance


class PositionHold:
    """See the module's docstring."""

    def plan(self, now: Balance) -> Plan:
        """No wish: `feasible` is false, so nothing is laid over the set points."""
        return Plan(now.measured, feasible=False)
