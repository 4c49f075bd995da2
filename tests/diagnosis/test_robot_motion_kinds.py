"""What sound machines seem to show depends on what they do in a recording."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from testbed.diagnosis.robot.balance import BodyBalance
from testbed.diagnosis.robot.motion_kinds import (
    DRILL,
    RAISED,
    SECOND,
    SWAY,
    VERTICAL,
    WALK,
    motion_kind,
)
from testbed.diagnosis.robot.probabilities import RobotSigns, calibration, distribution
from tests.diagnosis.test_robot_signatures import sound

PRESLIDING = ("friction.presliding@rl_radial",)


def quiet() -> BodyBalance:
    """A sound machine whose feet stand, with neither thrust nor travel."""
    body = sound()
    counted = body.counted.copy()
    counted[:, 6:] = False
    still = np.broadcast_to(body.seen.extension_m[:1], body.seen.extension_m.shape)
    seen = replace(body.seen, thrust_n=np.zeros(body.seen.bins), extension_m=still)
    return replace(body, seen=seen, counted=counted)


def raised(share: float) -> BodyBalance:
    """The same whose vertical cylinders move by a share of their strokes."""
    body = quiet()
    moved = body.seen.extension_m.copy()
    moved[:, VERTICAL] += (
        np.linspace(0.0, share, len(moved))[:, None] * body.seen.stroke_m[VERTICAL]
    )
    return replace(body, seen=replace(body.seen, extension_m=moved))


def test_lifted_feet_make_a_walk_and_thrust_makes_drilling() -> None:
    lifted = quiet()
    lifted.counted[0, 6:9] = True
    assert motion_kind(lifted) == (WALK,)
    pushed = quiet()
    pushing = replace(pushed.seen, thrust_n=np.ones(pushed.seen.bins))
    assert motion_kind(replace(pushed, seen=pushing)) == (DRILL,)


def test_a_motion_unlike_those_that_were_fitted_counts_as_all_of_them() -> None:
    assert motion_kind(raised(0.9 * RAISED)) == (SWAY,)
    assert motion_kind(raised(1.1 * RAISED)) == (SWAY, WALK, DRILL)


def test_evidence_counts_from_what_sound_machines_reach_in_the_same_motion() -> None:
    numbers = {**calibration(), "sound": {SWAY: {}, WALK: {"friction.presliding@radial": 12.0}}}

    def of(*motions: str) -> float:
        signs = RobotSigns(((PRESLIDING, 17.0),), motions=motions)
        return distribution(signs, numbers)[PRESLIDING]

    assert of(SWAY) > 0.5 > 0.2 > of(WALK)
    assert of(SWAY, WALK, SECOND) == of(WALK)
