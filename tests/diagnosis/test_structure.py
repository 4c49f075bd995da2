"""What is left where no name fits: flow terms, rest, bristles of a sound seal, and intervals from
blocks.
"""

from __future__ import annotations

from dataclasses import replace
from types import SimpleNamespace
from typing import Any

import numpy as np
import numpy.typing as npt
import pytest

from testbed.benchmarks.reference_leg.rigs import Hidden, make_rig
from testbed.diagnosis.leg.base_models import declared, fit_base
from testbed.diagnosis.leg.evidence import evidence
from testbed.diagnosis.leg.fit import Fit
from testbed.diagnosis.leg.points import FRICTION_NAMES, STRAIGHT, Point
from testbed.diagnosis.leg.prediction import block_covariance
from testbed.diagnosis.leg.problem import Layout, Problem
from testbed.diagnosis.leg.series import series_of
from testbed.diagnosis.leg.unexplained import fit_generic
from testbed.effects import by_name
from testbed.effects.active import Active
from testbed.effects.terms import Coordinate
from testbed.effects.unnamed import rested
from testbed.estimation.leg.flow import Edges
from testbed.recording.leg_model import Friction

Array = npt.NDArray[np.float64]


def problem_of(monkeypatch: pytest.MonkeyPatch, numbers: dict[str, float]) -> tuple[Problem, Fit]:
    hidden = Hidden(("outside.some",), (1.0,), numbers, (0,))
    monkeypatch.setattr(
        "testbed.benchmarks.reference_leg.rigs.draw_hidden", lambda rng, kind: hidden
    )
    rig, _ = make_rig(12, "outside")
    base = declared(rig)
    problem = Problem(series_of(rig.identify, base.known), base, True)
    return problem, fit_base(problem)[0]


@pytest.mark.slow
def test_a_recorder_that_writes_its_command_a_sample_early_is_no_finding(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    problem, sound = problem_of(monkeypatch, {})
    rig, _ = make_rig(12, "outside")
    early = [
        replace(one, valve_command=np.append(one.valve_command[1:], one.valve_command[-1]))  # type: ignore[index]
        for one in rig.identify
    ]
    series = series_of(early, problem.base.known)
    fit, _ = fit_base(Problem(series, problem.base, True))
    sample_s = 1.0 / series[0].full_rate_hz
    assert fit.at.edges.late_s - sound.at.edges.late_s == pytest.approx(sample_s, rel=0.2)
    assert fit.scale["flow"] == pytest.approx(sound.scale["flow"], rel=0.1)


@pytest.mark.slow
def test_a_drag_with_the_square_of_the_speed_is_told_with_its_size_although_friction_imitates_it(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    problem, refit = problem_of(monkeypatch, {"drag": 4e4})
    before = evidence(problem, refit)
    fit = fit_generic(problem, refit, seal=True)
    found = evidence(problem, fit)
    assert found.gain_over(before, found) > 200.0
    # The term is in N at 0.1 m/s: 4e4 * 0.1^2.
    assert fit.at.effects[-1].values["velocity_2"] == pytest.approx(400.0, rel=0.15)


@pytest.mark.slow
def test_where_friction_enters_straight_the_exact_columns_are_what_differences_give(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    problem, refit = problem_of(monkeypatch, {})
    load = Active(effect := by_name("friction.load"), effect.complete({"coefficient": 0.05}))
    at = {name: refit.at.friction.model_dump()[name] for name in FRICTION_NAMES}
    own = problem.base.model_copy(update={"friction": Friction(**at)})
    for effects in ((), (load,)):
        exact = problem.straight_columns(own, effects)
        assert exact is not None and exact.shape == (len(refit.residual["force"]), len(STRAIGHT))
        for k, name in enumerate(STRAIGHT):
            sides = [
                problem.force(
                    problem.base.model_copy(update={"friction": Friction(**{**at, name: value})}),
                    effects,
                )
                for value in (at[name] + 1e-3, at[name])
            ]
            off = np.abs(exact[:, k] - (sides[0] - sides[1]) / 1e-3)
            assert (
                np.mean(off > 1e-5) < 1e-3
            )  # but where the load passes through zero and its friction begins
    bristle = Active(
        effect := by_name("friction.presliding"),
        effect.complete({"stiffness": 1e7, "damping": 0.0}),
    )
    assert problem.straight_columns(problem.base, (bristle,)) is None


def test_a_piston_has_rested_after_a_long_rest_and_forgets_it_as_it_slides() -> None:
    speed = np.concatenate([np.zeros(2000), np.full(2000, 0.02)])
    age = rested(speed, 0.004)
    assert age[1999] == pytest.approx(1.0, abs=1e-3)
    assert age[-1] == pytest.approx(1.0 / 11.0, rel=1e-3)  # 1 / (1 + 0.02 / 0.002)


def some_fit(effects: tuple[Active, ...], **changes: Any) -> Fit:
    friction = Friction(
        viscous_plus_n_s_m=2e3,
        coulomb_plus_n=400.0,
        stribeck_plus_n=100.0,
        stribeck_speed_plus_m_s=0.01,
        viscous_minus_n_s_m=2e3,
        coulomb_minus_n=300.0,
        stribeck_minus_n=100.0,
        stribeck_speed_minus_m_s=0.01,
    )
    empty: dict[str, Array] = {}
    return Fit(
        changes.get("coordinates", ()),
        np.zeros(1),
        Point(friction, Edges(), effects),
        changes.get("residual", empty),
        changes.get("jacobian", empty),
        changes.get("scale", empty),
        np.zeros((1, 1)),
    )


def test_a_series_held_for_a_block_is_one_witness_a_block() -> None:
    rng = np.random.default_rng(5)
    n, block = 8000, 20
    numbers = np.arange(n)
    layout = Layout(
        ("force",),
        np.zeros(n, dtype=np.int64),
        numbers // block,
        np.ones(n),
        np.ones(n),
        (("force", "one"),),
    )
    problem: Any = SimpleNamespace(layout={"force": layout})
    white = rng.standard_normal(n)
    variance = {}
    for name, residual in (("white", white), ("held", np.repeat(white[: n // block], block))):
        fit = some_fit(
            (),
            coordinates=(Coordinate("friction", "level", 0.0, -9.0, 9.0, 1.0),),
            residual={"force": residual},
            jacobian={"force": np.ones((n, 1))},
            scale={"force": np.ones(1)},
        )
        variance[name] = float(block_covariance(problem, fit)[0, 0])
    assert variance["white"] == pytest.approx(1.0 / n, rel=0.2)
    assert variance["held"] == pytest.approx(block / n, rel=0.2)
