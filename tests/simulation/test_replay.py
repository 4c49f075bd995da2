"""A controller over a recording sees what it saw live, and plans the same again."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

import testbed
from testbed.control.distribution.distribution import Plan
from testbed.control.distribution.quadratic import Quadratic
from testbed.control.distribution.statics import UNKNOWNS, Balance
from testbed.errors import InputError
from testbed.simulation.replay import replay_controller


class Kept(Quadratic):
    """The shipped program, which keeps what it was asked and answered."""

    def __init__(self) -> None:
        super().__init__()
        self.asked: list[Balance] = []
        self.answered: list[Plan] = []

    def plan(self, now: Balance) -> Plan:
        plan = super().plan(now)
        self.asked.append(now)
        self.answered.append(plan)
        return plan


class Silent:
    """Answers nothing."""

    def plan(self, now: Balance) -> None:
        del now


@pytest.fixture(scope="module")
def live(tmp_path_factory: pytest.TempPathFactory) -> tuple[Kept, Path]:
    kept, out = Kept(), tmp_path_factory.mktemp("runs") / "run"
    scenario = testbed.load_scenario("stand_slope_45", duration=0.2)
    with testbed.simulate(scenario, out=out, controller=kept) as run:
        while not run.finished:
            run.step(50)
    return kept, out


def test_over_the_recording_it_is_asked_and_plans_as_live(live: tuple[Kept, Path]) -> None:
    """The recording keeps four bytes a number, and ropes' directions are taken from encoders."""
    kept, out = live
    again = Kept()
    plans, recorded = replay_controller(again, out)
    assert plans.forces.shape == (len(plans.row), UNKNOWNS) and plans.feasible.all()
    assert recorded["t"][plans.row] == pytest.approx(
        0.01 * np.round(recorded["t"][plans.row] / 0.01)
    )
    weight_n = float(np.linalg.norm(kept.asked[0].load[:3]))
    for now in again.asked[1:]:
        nearest = min(kept.asked, key=lambda one: float(np.linalg.norm(one.load - now.load)))
        assert np.linalg.norm(nearest.load - now.load) < 0.01 * weight_n
        assert np.linalg.norm(nearest.measured - now.measured) < 0.02 * weight_n
    live_n, again_n = (
        np.array([plan.forces for plan in one.answered]).mean(axis=0) for one in (kept, again)
    )
    assert again_n == pytest.approx(live_n, abs=0.02 * weight_n)


def test_a_shipped_one_goes_by_its_name(live: tuple[Kept, Path]) -> None:
    plans, _ = replay_controller("pseudo_inverse", live[1])
    assert np.isfinite(plans.forces).all()


def test_what_is_none_is_refused(live: tuple[Kept, Path], tmp_path: Path) -> None:
    with pytest.raises(InputError, match="no such controller"):
        replay_controller("nobody", live[1])
    with pytest.raises(InputError, match="answered no plan"):
        replay_controller(Silent, live[1])  # type: ignore[arg-type]
    with pytest.raises(InputError, match="run"):
        replay_controller("qp", tmp_path / "run")
