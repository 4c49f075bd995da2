"""A drill that waits when control tells it to: its loads fade out, its programme stands still, then
both go on.
"""

from __future__ import annotations

from typing import Any

from testbed.laws.drill import scale_order
from testbed.world.drilling.drilling import Drilling

FADE_S, RESUME_S = 0.05, 0.5
"""Times in which feed, pull and torque vanish and come back: a pressure-relieved feed cylinder
(E).
"""


class DrillHold:
    """How much of the drill's loads is there, and for how long its programme has stood still."""

    def __init__(self) -> None:
        self._share = 1.0
        self._waited_s = 0.0

    def update(self, drill: Drilling, t: float, dt: float, hold: bool) -> list[dict[str, Any]]:
        """Let the drill set its loads for the tick from t to t + dt (s), unless it is to wait;
        returns its news.
        """
        change = -dt / FADE_S if hold else dt / RESUME_S
        self._share = min(max(self._share + change, 0.0), 1.0)
        news: list[dict[str, Any]] = []
        if self._share <= 0.0:
            self._waited_s += dt
        else:
            news = drill.update(t - self._waited_s, dt)
        if self._share < 1.0:
            scale_order(drill.loads, self._share)
            drill.ordered["thrust"] *= self._share
            drill.ordered["torque"] *= self._share
        return news
