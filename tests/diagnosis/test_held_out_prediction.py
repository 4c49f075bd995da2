"""What recordings foretell of each other: one that alone shows an effect cannot be foretold by the
others.
"""

from __future__ import annotations

from dataclasses import replace
from types import SimpleNamespace
from typing import Any

import numpy as np
import numpy.typing as npt
import pytest

from testbed.diagnosis.leg.evidence import Evidence
from testbed.diagnosis.leg.fit import Fit
from testbed.diagnosis.leg.points import Point
from testbed.diagnosis.leg.prediction import UNKNOWN, shown_by_one
from testbed.diagnosis.leg.problem import Layout
from testbed.diagnosis.leg.search import Candidate
from testbed.diagnosis.leg.signs import _by_recording
from testbed.effects.terms import Coordinate
from testbed.estimation.leg.flow import Edges
from testbed.recording.leg_model import Friction

Array = npt.NDArray[np.float64]
BINS, BLOCK = 800, 20
NAMES = ("air", "press")


def problem() -> Any:
    """Two recordings of BINS bins of one channel."""
    place = np.arange(2 * BINS)
    layout = Layout(
        ("force",),
        place // BINS,
        place // BLOCK,
        np.ones(2 * BINS),
        np.ones(2 * BINS),
        tuple(("force", name) for name in NAMES),
    )
    series = tuple(SimpleNamespace(name=name) for name in NAMES)
    return SimpleNamespace(layout={"force": layout}, series=series)


def fitted(shown: dict[str, float], truth: float = 3.0) -> Fit:
    """The straight fit of a level, which both recordings show, and of an effect that each shows by
    so much, to what has both and white noise of 1.
    """
    rng = np.random.default_rng(3)
    waves = np.tile(np.sin(0.7 * np.arange(BINS)), 2)
    effect = np.repeat([shown[name] for name in NAMES], BINS) * waves
    columns = np.stack([np.ones(2 * BINS), effect], axis=1)
    seen = columns @ [1.0, truth] + rng.standard_normal(2 * BINS)
    theta = np.linalg.lstsq(columns, seen, rcond=None)[0]
    coordinates = (
        Coordinate("friction", "level", 0.0, -99.0, 99.0, 1.0),
        Coordinate("effect", "size", 0.0, -99.0, 99.0, 1.0),
    )
    return Fit(
        coordinates,
        theta,
        Point(Friction(), Edges(), ()),
        {"force": columns @ theta - seen},
        {"force": columns},
        {"force": np.ones(2)},
        np.eye(2),
    )


def without(fit: Fit) -> Fit:
    """The same recordings with the level alone."""
    columns = fit.jacobian["force"]
    seen = columns @ fit.theta - fit.residual["force"]
    level = float(seen.mean())
    residual, only = {"force": level - seen}, {"force": columns[:, :1]}
    return Fit(fit.coordinates[:1], np.array([level]), fit.at, residual, only, fit.scale, np.eye(1))


def carried(fit: Fit) -> dict[tuple[str, str], float]:
    """Log-likelihood that the effect gains in each recording as the others have it, where they
    have.
    """
    alone = shown_by_one(problem(), fit, {"effect"})
    state: Any = SimpleNamespace(problem=problem())
    empty = Evidence({}, {}, {}, {}, {})
    now, then = (
        _by_recording(state, Candidate((), one, empty), alone) for one in (fit, without(fit))
    )
    return now.parts(then, now)


def test_a_recording_without_which_an_effect_is_unknown_shows_it_alone() -> None:
    assert shown_by_one(problem(), fitted({"air": 0.0, "press": 1.0}), {"effect"}) == {"press"}
    assert shown_by_one(problem(), fitted({"air": 1.0, "press": 1.0}), {"effect"}) == set()
    assert shown_by_one(problem(), fitted({"air": 0.0, "press": 1.0}), {"friction"}) == set()


@pytest.mark.filterwarnings("error")
def test_a_number_that_moves_nothing_takes_no_other_s_knowledge() -> None:
    """Such as the speed of a Stribeck rise that is none."""
    fit = fitted({"air": 0.0, "press": 1.0})
    still = Coordinate("friction", "speed", 0.0, -99.0, 99.0, 1.0)
    columns = np.column_stack([fit.jacobian["force"], np.zeros(2 * BINS)])
    more = replace(
        fit,
        coordinates=(*fit.coordinates, still),
        theta=np.append(fit.theta, 0.0),
        jacobian={"force": columns},
        covariance=np.eye(3),
    )
    assert shown_by_one(problem(), more, {"effect"}) == {"press"}


@pytest.mark.parametrize(("share", "alone"), [(0.8, {"press"}), (1.25, set())])
def test_the_others_know_nothing_where_their_variance_is_so_many_times_that_of_all(
    share: float, alone: set[str]
) -> None:
    """The variance goes as one over the squares of what is shown: (1 + s^2) / s^2 without press."""
    little = share / np.sqrt(UNKNOWN - 1.0)
    assert shown_by_one(problem(), fitted({"air": little, "press": 1.0}), {"effect"}) == alone


def test_an_effect_that_one_recording_alone_shows_gains_there_as_its_own_blocks_say() -> None:
    alone = carried(fitted({"air": 0.0, "press": 1.0}))
    # A sine of amplitude 3 over noise of 1: ln(1 + 9 / 2) / 2 a bin of the normal distribution.
    assert alone["force", "press"] == pytest.approx(0.5 * np.log(5.5) * BINS, rel=0.15)
    assert alone["force", "air"] == pytest.approx(0.0, abs=3.0)
    both = carried(fitted({"air": 1.0, "press": 1.0}))
    assert both["force", "press"] == pytest.approx(alone["force", "press"], rel=0.15)
