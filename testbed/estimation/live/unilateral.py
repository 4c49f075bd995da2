"""What the contact itself says of a foot's force: in the air it is nothing, on the ground it pushes
and does not pull. Compiled.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from testbed.compiled import njit
from testbed.estimation.live import fusion as fu
from testbed.estimation.live.learnt import learnt, weigh_leg
from testbed.formats.records import SET


@njit
def hangs(k: int, row: Any, body: Any, state: Any) -> bool:
    """Whether foot k is in the air by now; counts for how long."""
    up = state.means.foot_force[k, 2] - learnt(3 * k + 2, state)
    off = bool(row.carrying[k] < SET and abs(up) < body.air_load)
    dt = body.every * body.decisions.dt
    state.in_air[k] = state.in_air[k] + dt if off else 0.0
    return off


@njit
def learn_in_air(k: int, map_: Any, body: Any, state: Any) -> None:
    """Three observations: foot k carries nothing. map_ (3, 3): leg_map."""
    h = np.zeros(fu.N)
    for index in range(3):
        weigh_leg(k, map_[index], state, h)
        force, slides = state.means.foot_force[k, index], state.axes[3 * k + 2].slides >= 1.0
        fu.observe(state.fusion, h, force, body.air_sd**2, body.gate, index == 2 and slides)


@njit
def only_push(maps: Any, body: Any, state: Any) -> None:
    """One observation of every foot that seems to pull: it carries nothing; maps (4, 3, 3):
    leg_map. Constants learn nothing from it: it is known of them only that they were too small.
    """
    h = np.zeros(fu.N)
    for k in range(4):
        force = state.means.foot_force[k, 2]
        up = force
        for j in range(3):
            up -= maps[k, 2, j] * learnt(3 * k + j, state)
        if up < 0.0:
            h[:] = 0.0
            weigh_leg(k, maps[k, 2], state, h)
            fu.observe(state.fusion, h, force, body.air_sd**2, body.gate, False)
