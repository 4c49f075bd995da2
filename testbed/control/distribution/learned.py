"""A trained correction of the quadratic program's plan: a small network of plain arrays, no learning library needed.

    action = clip(W3 tanh(W2 tanh(W1 view + b1) + b2) + b3, -1, 1)   every second plan (20 ms), as it was trained

The weights beside this file were made by the command in their entry `made_by`.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from testbed.control.distribution.corrected import VIEW, Corrected
from testbed.control.distribution.distribution import Plan
from testbed.control.distribution.statics import Balance
from testbed.errors import InputError

Array = NDArray[np.float64]
SHIPPED = Path(__file__).with_suffix(".npz")
EVERY = 2
"""Plans from action to action."""
LAYERS = 3


class Learned(Corrected):
    """See the module's docstring. `weights`: an .npz of `testbed train`; raises InputError for one that is none."""

    def __init__(self, weights: Path = SHIPPED) -> None:
        super().__init__()
        self._layers = read(weights)
        self._plans = 0

    def plan(self, now: Balance) -> Plan:
        """See Sharing."""
        if self._plans and self._plans % EVERY == 0:
            self.order(self.action(self.view()))
        self._plans += 1
        return super().plan(now)

    def action(self, view: Array) -> Array:
        """(6,) in [-1, 1] of a view (len(VIEW),)."""
        x = view
        for k, (weight, bias) in enumerate(self._layers):
            x = weight @ x + bias
            x = np.tanh(x) if k < LAYERS - 1 else x
        return np.clip(x, -1.0, 1.0)


def read(file: Path) -> list[tuple[Array, Array]]:
    """The layers' weights and biases. Raises InputError for a file that is no policy of this view."""
    try:
        with np.load(file) as data:
            layers = [
                (data[f"weight_{k}"].astype(float), data[f"bias_{k}"].astype(float))
                for k in range(LAYERS)
            ]
    except (OSError, ValueError, KeyError) as error:
        raise InputError(
            "is no policy", file=file, allowed="a policy.npz of `testbed train`"
        ) from error
    if layers[0][0].shape[1] != len(VIEW):
        raise InputError(
            "sees something else",
            file=file,
            field="weight_0",
            value=layers[0][0].shape,
            allowed=f"(.., {len(VIEW)})",
        )
    return layers
