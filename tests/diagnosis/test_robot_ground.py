"""How steep the ground seems: by feet and inertial unit, beside an earlier recording from there."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any, cast

import numpy as np
import numpy.typing as npt
import pytest

from testbed.diagnosis.robot.diagnose import shown_by_place
from testbed.diagnosis.robot.evidence import RawGroup
from testbed.diagnosis.robot.ground import (
    PIECE_S,
    UNEVEN_RAD,
    Ground,
    group_of,
    is_same_place,
    steepness,
)
from testbed.diagnosis.robot.groups import Balances, Candidate
from testbed.diagnosis.robot.hypotheses import Ledger
from testbed.effects import by_name
from testbed.effects.signature import Change
from testbed.machine.names import LEGS

Array = npt.NDArray[np.float64]
FEET_M = np.array([[1.0, 0.8, -1.0], [1.0, -0.8, -1.0], [-1.0, 0.8, -1.0], [-1.0, -0.8, -1.0]])
ROPES = np.array([[0.9, 0.2, 0.39], [0.9, -0.2, 0.39]])
SLOPE_RAD = -0.7
BINS = 60


def stood(
    roll: float = 0.0,
    pitch: float = SLOPE_RAD,
    feet_m: Array = FEET_M,
    ropes: Array = ROPES,
    pull_n: float = 1e4,
) -> Ground | None:
    """The ground of a recording of six seconds in which the body stands still."""
    seen = SimpleNamespace(
        foot_m=np.tile(feet_m, (BINS, 1, 1)), tension_n=np.full((BINS, 2), pull_n)
    )
    bins = SimpleNamespace(
        time_s=0.1 * np.arange(BINS),
        carrying=np.ones((BINS, len(LEGS))),
        attitude_rad=np.tile([roll, pitch, 0.0], (BINS, 1)),
    )
    balance = SimpleNamespace(seen=seen, foot_force=np.full((BINS, len(LEGS), 3), 5e3))
    return group_of(cast(Any, balance), cast(Any, bins), ropes)


def ground(**given: Any) -> Ground:
    """The same, of one that has a ground."""
    found = stood(**given)
    assert found is not None
    return found


def test_level_feet_lie_as_the_body_does() -> None:
    attitudes = np.array([[0.0, SLOPE_RAD, 0.0], [0.1, 0.0, 0.0]])
    lies = steepness(np.array([FEET_M, FEET_M]), attitudes)
    assert lies[0] == pytest.approx([SLOPE_RAD, 0.0])
    assert lies[1] == pytest.approx([0.0, -0.1])


def test_feet_that_reach_further_down_in_front_stand_on_ground_that_falls_off_there() -> None:
    ahead = FEET_M - np.array([0.0, 0.0, 0.1]) * (FEET_M[:, :1] > 0.0)
    assert steepness(ahead[None], np.zeros((1, 3)))[0] == pytest.approx([np.arctan2(0.1, 2.0), 0])


def test_a_unit_that_sits_askew_turns_the_ground_by_as_much() -> None:
    pitched = Change(unit_turned=np.array([0.0, 1.0, 0.0]))
    pieces = round(0.1 * BINS / PIECE_S)
    assert ground().rows_of(pitched) == pytest.approx(np.tile([1.0, 0.0], pieces), abs=1e-3)
    assert ground().rows_of(Change()) == pytest.approx(0.0)


def test_an_encoder_that_lets_one_foot_seem_lower_tips_the_ground_by_half_of_it() -> None:
    lower = np.zeros((BINS, len(LEGS), 3))
    lower[:, 0, 2] = -1.0
    pitch, roll = ground().rows_of(Change(feet=lower))[:2]
    assert pitch == pytest.approx(0.25, rel=0.01)
    assert roll == pytest.approx(0.5 / 1.6, rel=0.01)


def test_what_was_there_before_is_taken_off_and_what_the_unit_reads_now_is_left() -> None:
    now, before = ground(pitch=SLOPE_RAD + 0.04), ground()
    beside = now.knowing(before)
    assert beside.missing[0::2] == pytest.approx(0.04)
    assert beside.missing[1::2] == pytest.approx(0.0)
    assert beside.lasting is not None and np.diag(beside.lasting) == pytest.approx(UNEVEN_RAD**2)


def test_a_place_is_known_by_its_ropes() -> None:
    assert is_same_place(ground(), ground())
    assert not is_same_place(ground(), ground(ropes=ROPES + 0.01))
    assert not is_same_place(ground(), None)


def test_without_ropes_nothing_tells_one_place_from_another() -> None:
    assert stood(pull_n=0.0) is None


UNIT = "robot.attitude@body"


@pytest.mark.parametrize(("weight_n", "told"), [(0.0, (UNIT,)), (2e3, ())])
def test_a_tilt_that_only_the_ground_shows_is_said_to_rest_on_the_place(
    weight_n: float, told: tuple[str, ...]
) -> None:
    """Forces show a tilt of 0.1 rad where it turns the weight by more than they are known to, 20
    N.
    """

    def sideways(change: Change) -> Array:
        turned = change.unit_turned
        return np.zeros(4) if turned is None else np.tile(turned[:2], 2) * weight_n

    tilt = np.array([0.0, 0.1, 0.0])
    forces = RawGroup(
        missing=sideways(Change(unit_turned=tilt)),
        time_s=np.arange(4.0),
        noise=20.0**2 * np.eye(4),
        tolerated=np.zeros((4, 1)),
        rows_of=sideways,
    )
    beside = ground(pitch=SLOPE_RAD + tilt[1]).knowing(ground())
    ledger = ledger_of_a_unit({"forces": forces, "ground": beside})
    assert ledger.hypothesis((UNIT,)).log_factor > 20.0
    assert shown_by_place(ledger, (UNIT,)) == told
    assert shown_by_place(ledger_of_a_unit({"forces": forces}), (UNIT,)) == ()


def ledger_of_a_unit(raw: dict[str, RawGroup]) -> Ledger:
    """The ledger of an inertial unit that may sit askew, and of nothing else."""
    tilts = {"roll": np.array([1.0, 0.0, 0.0]), "pitch": np.array([0.0, 1.0, 0.0])}
    signature = {name: Change(unit_turned=tilt) for name, tilt in tilts.items()}
    groups = {key: group.whitened({UNIT: signature}) for key, group in raw.items()}
    nothing = cast(Any, None)
    found = {UNIT: Candidate(by_name("robot.attitude"), "body", signature)}
    return Ledger(Balances(nothing, nothing, raw, groups, found))
