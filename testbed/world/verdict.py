"""How a run ends: stood, fell, slid, rope broke. The rules in words: docs/verdicts.md."""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from testbed.estimation.contact_losses import loss_force_n
from testbed.formats.arrays import Array, Flags
from testbed.machine.scale import ROBOCLIMBER, Scale

TILT_FALL_RAD = math.radians(20.0)
"""Body turned this far from its start attitude against the slope: fallen (E)."""
BELLY_SHARE = 0.10
"""Belly carrying this share of the weight while raised: fallen (E)."""
SLIDE_M = 0.30
"""Feet that moved this far along the ground while meant to stand: slid (E)."""
ALOFT_M = 0.5
"""Feet that moved this far on the whole since any of them bore: fallen (E)."""


LOOK_TICKS = 10
"""The judge looks at every tenth control tick (10 Hz)."""


class Judge:
    """Watches the truth at a slow rate and ends the run when the machine is lost."""

    def __init__(
        self, rotation_start: Array, weight_n: float, raised: bool, scale: Scale = ROBOCLIMBER
    ) -> None:
        self._start = rotation_start.copy()
        self.weight_n = weight_n
        self._scale = scale
        self.bears_n = loss_force_n(scale.nominal_load_n)
        """Normal load above which a foot stands."""
        self._raised = raised
        self._anchor: list[list[float] | None] = [None] * 4
        self._left: Array | None = None
        """Middle of the feet when the last of them ceased to bear."""
        self.slip_m = 0.0
        self.turn_rad = 0.0
        self.verdict = "stood"

    def look(
        self, t: float, rotation: Array, feet: Array, carrying: Flags, loaded: Flags, belly_n: float
    ) -> dict[str, Any] | None:
        """Feet (4, 3) in the world; returns the event that ends the run, or None.

        What counts as sliding is the way along the slope: ground may settle under a foot.
        """
        tilt = math.acos(min(1.0, max(-1.0, (float(np.vdot(self._start, rotation)) - 1.0) / 2.0)))
        self.turn_rad = max(self.turn_rad, tilt)
        places, slip = (feet @ self._start[:, :2]).tolist(), 0.0
        for leg, stands in enumerate((carrying & loaded).tolist()):
            if not stands:
                self._anchor[leg] = None
                continue
            first = self._anchor[leg] = self._anchor[leg] or places[leg]
            slip = max(slip, math.dist(places[leg], first))
        self.slip_m = max(self.slip_m, slip)
        aloft = self._aloft_m(feet.mean(axis=0), bool(loaded.any()))
        if (
            tilt > TILT_FALL_RAD
            or aloft > ALOFT_M * self._scale.length
            or (self._raised and belly_n > BELLY_SHARE * self.weight_n)
        ):
            self.verdict = "fell"
        elif slip > SLIDE_M * self._scale.length:
            self.verdict = "slid"
        else:
            return None
        return {"t": t, "kind": self.verdict, "turn_deg": math.degrees(tilt), "slip_m": slip}

    def _aloft_m(self, middle: Array, bears: bool) -> float:
        """How far the feet have come on the whole since any of them bore, m."""
        if bears:
            self._left = None
            return 0.0
        if self._left is None:
            self._left = middle
        return float(np.linalg.norm(middle - self._left))
