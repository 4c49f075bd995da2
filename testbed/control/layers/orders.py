"""What somebody orders by hand: speeds of the ropes, the drill's feed and the hammer's share, laid
over a gait.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from testbed.control.command import Command
from testbed.control.measured import Measured
from testbed.formats.arrays import Array
from testbed.machine.names import SIDES


class Orders:
    """A Layer; see the module's docstring."""

    def __init__(self) -> None:
        self.rope_rates_m_s: Array = np.zeros(len(SIDES))
        """Added to the rates of the ropes' unstrained lengths, left and right; negative hauls
        in.
        """
        self.feed_n: float | None = None
        """See Command."""
        self.hammer = 1.0
        """See Command."""

    def over(self, command: Command, t: float, dt: float, measured: Measured) -> Command:
        """See Layer."""
        return replace(
            command,
            rope_rates_m_s=command.rope_rates_m_s + self.rope_rates_m_s,
            feed_n=self.feed_n,
            hammer=self.hammer,
        )
