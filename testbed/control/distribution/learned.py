"""A trained correction of the quadratic program's plan: a small network of plain arrays, no
learning library needed.

    action = clip(W3 tanh(W2 tanh(W1 view + b1) + b2) + b3, -1, 1)   every second plan (20 ms), as
    it was trained

The weights beside this file were made by the command in their entry `made_by`.
"""

from __future__ import annotations

from pathlib import Path

from testbed.control.distribution.corrected import VIEW, Corrected
from testbed.control.distribution.distribution import Plan
from testbed.control.distribution.statics import Balance
from testbed.errors import InputError
from testbed.formats.arrays import Array
from testbed.formats.networks import read_network

SHIPPED = Path(__file__).with_suffix(".npz")
"""The shipped policy."""
ACTIONS = 6
"""Loads of the four feet and pulls of the two ropes."""
EVERY = 2
"""Plans from action to action."""


class Learned(Corrected):
    """See the module's docstring. `weights`: an .npz of `testbed train`; raises InputError for one
    that is none.
    """

    def __init__(self, weights: Path = SHIPPED) -> None:
        super().__init__()
        self._network, _ = read_network(weights)
        self._plans = 0
        if (self._network.inputs, self._network.outputs) != (len(VIEW), ACTIONS):
            raise InputError(
                "sees or does something else",
                file=weights,
                value=(self._network.inputs, self._network.outputs),
                allowed=f"{len(VIEW)} numbers in, {ACTIONS} out",
            )

    def plan(self, now: Balance) -> Plan:
        """See Controller."""
        if self._plans and self._plans % EVERY == 0:
            self.order(self.action(self.view()))
        self._plans += 1
        return super().plan(now)

    def action(self, view: Array) -> Array:
        """(6,) in [-1, 1] of a view (len(VIEW),)."""
        return self._network.answer(view)
