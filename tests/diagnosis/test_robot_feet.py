"""Where feet stand: on a wall, where none bears enough to be sure of, there is nothing to say."""

from __future__ import annotations

from dataclasses import replace
from types import SimpleNamespace
from typing import Any, cast

import numpy as np

from testbed.diagnosis.robot.feet import LEAST_LOAD_N, group_of
from testbed.machine.names import LEGS
from testbed.machine.scale import ROBOCLIMBER
from tests.diagnosis.test_robot_signatures import sound


def test_feet_that_bear_next_to_nothing_have_no_place_that_could_be_missed() -> None:
    body = sound()
    count = body.seen.bins
    carrying = np.ones((count, len(LEGS)))
    bins = cast(Any, SimpleNamespace(count=count, carrying=carrying, time_s=body.seen.time_s))
    off_slope = np.array([1.0, 0.0, 0.0])
    for share, shows in ((0.9, False), (1.1, True)):
        load = share * LEAST_LOAD_N * np.broadcast_to(off_slope, (count, len(LEGS), 3))
        frame = np.broadcast_to(np.eye(3)[::-1], (count, 3, 3))
        seen = replace(body.seen, slope_frame=frame)
        found = group_of(replace(body, seen=seen, foot_force=load), bins, ROBOCLIMBER)
        assert (found is not None) == shows
