"""A valve's four metering edges: each scales its own flow, is found beside friction with its
interval, and is no finding as long as a workshop may have left it so.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from testbed.benchmarks.reference_leg.rigs import Hidden, make_rig
from testbed.diagnosis.leg.base_models import MOST_UNEQUAL, declared, fit_base
from testbed.diagnosis.leg.diagnose import diagnose
from testbed.diagnosis.leg.findings import as_json
from testbed.diagnosis.leg.fit import Fit
from testbed.diagnosis.leg.flow_structure import flow_structure
from testbed.diagnosis.leg.probabilities import answer, calibration
from testbed.diagnosis.leg.problem import Problem
from testbed.diagnosis.leg.series import series_of
from testbed.diagnosis.leg.valve_edges import edges_of
from testbed.effects import by_name
from testbed.effects.active import Active
from testbed.effects.terms import FlowTerms, Signals
from testbed.estimation.leg.flow import EDGES, Edges, flow_balance, smoothed_opening
from testbed.recording.axis import Rig
from testbed.recording.known import Known

UNEQUAL = {"pa_more": 0.03, "at_more": -0.02, "pb_more": -0.03, "bt_more": 0.01}
WAYS = {"extending": 1.0, "retracting": -1.0}


def rig_of(monkeypatch: pytest.MonkeyPatch, seed: int, numbers: dict[str, float]) -> Rig:
    """A rig of the reference leg with these numbers of its own and nothing else hidden."""
    monkeypatch.setattr(
        "testbed.benchmarks.reference_leg.rigs.draw_hidden",
        lambda rng, kind: Hidden((), (), numbers, ()),
    )
    return make_rig(seed, "clean")[0]


def fitted(monkeypatch: pytest.MonkeyPatch, numbers: dict[str, float]) -> tuple[Problem, Fit]:
    """Friction and valve of a rig with these numbers."""
    rig = rig_of(monkeypatch, 12, numbers)
    base = declared(rig)
    problem = Problem(series_of(rig.identify, base.known), base, True)
    return problem, fit_base(problem)[0]


def at_rest(way: float) -> tuple[Signals, np.ndarray]:
    """A piston that stands between 4 and 3 MPa, and an opening of 0.2 one way."""
    known = Known(
        bore_m=0.07,
        rod_m=0.04,
        stroke_m=0.5,
        supply_pressure_nominal_pa=9e6,
        tank_pressure_pa=2e5,
        bulk_modulus_pa=1.2e9,
        valve_rated_flow_m3_s=5e-4,
        valve_rated_drop_per_edge_pa=3.5e6,
    )
    still, full = np.zeros(50), np.full(50, 1.0)
    signals = Signals(
        time_s=np.arange(50) / 250.0,
        rate_hz=250.0,
        known=known,
        position_m=0.2 * full,
        velocity_m_s=still,
        acceleration_m_s2=still,
        pressure_a_pa=4e6 * full,
        pressure_b_pa=3e6 * full,
    )
    return signals, 0.2 * way * full


@pytest.mark.parametrize(
    ("edge", "chamber", "way"),
    [
        ("pa", "a_m3_s", "extending"),
        ("at", "a_m3_s", "retracting"),
        ("pb", "b_m3_s", "retracting"),
        ("bt", "b_m3_s", "extending"),
    ],
)
def test_an_edge_scales_the_flow_of_its_chamber_one_way_and_nothing_else(
    edge: str, chamber: str, way: str
) -> None:
    terms = FlowTerms(leakage_m3_s_pa=0.0, deadband=0.0)
    for name, sign in WAYS.items():
        signals, open_ = at_rest(sign)
        plain = flow_balance(signals, terms, open_)
        wider = flow_balance(signals, terms, open_, Edges(**{edge: 1.1}))
        for flow in ("a_m3_s", "b_m3_s"):
            factor = 1.1 if (flow, name) == (chamber, way) else 1.0
            assert getattr(wider, flow) == pytest.approx(factor * getattr(plain, flow))


def metered(edges: Edges) -> float:
    """Probability that something without a name meters."""
    return answer({"one": 1.0, "uneven": edges.unevenness()}, calibration().edges)


def test_edges_alike_are_no_sign_of_anything_and_outlets_a_fifth_smaller_are() -> None:
    assert metered(Edges()) < 1e-3
    assert metered(Edges(pa=0.97, at=1.03, pb=1.03, bt=0.97)) < 0.01
    assert metered(Edges(gain=0.85)) < 1e-3  # the whole valve is smaller
    assert metered(Edges(pa=1.1, at=0.9, pb=1.1, bt=0.9)) > 0.95


@pytest.mark.slow
def test_the_edges_columns_are_what_differences_give_where_they_enter_straight(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    problem, fit = fitted(monkeypatch, UNEQUAL)
    at, own = fit.at, fit.at.model(problem.base)
    air = Active(effect := by_name("hydraulics.air"), effect.complete({"fraction": 0.01}))
    for effects in ((), (air,)):
        columns = problem.edge_columns(effects, at.edges)
        assert columns is not None and set(columns) == {"gain", *EDGES}
        before = problem.flow(own, effects, at.edges)["flow"]
        for name, column in columns.items():
            wider = replace(at.edges, **{name: getattr(at.edges, name) + 1e-3})
            slope = (problem.flow(own, effects, wider)["flow"] - before) / 1e-3
            assert column == pytest.approx(slope, abs=1e-9)
    droop = by_name("supply.droop")
    drawn = Active(droop, droop.complete({"droop": 2e9, "time": 0.1}))
    assert problem.edge_columns((drawn,), at.edges) is None


@pytest.mark.slow
def test_unequal_edges_are_found_within_their_intervals(monkeypatch: pytest.MonkeyPatch) -> None:
    problem, fit = fitted(monkeypatch, UNEQUAL)
    found = edges_of(problem, fit, 3.0)
    for edge, size in found.items():
        truth = 1.0 + UNEQUAL[f"{edge}_more"]
        assert size.interval90 is not None
        assert size.interval90[0] < truth < size.interval90[1] < size.interval90[0] + 0.04
        assert size.value == pytest.approx(truth, abs=0.008)


@pytest.mark.slow
def test_equal_edges_are_found_equal(monkeypatch: pytest.MonkeyPatch) -> None:
    problem, fit = fitted(monkeypatch, {})
    sizes = [size.value for size in edges_of(problem, fit, 3.0).values()]
    assert sizes == pytest.approx([1.0] * 4, abs=0.006)


@pytest.mark.slow
def test_edges_within_a_workshops_tolerance_leave_what_a_sound_valve_does_and_others_more(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    sound, _ = flow_structure(*problem_of_outlets(monkeypatch, 0.0))
    within, _ = flow_structure(*problem_of_outlets(monkeypatch, 0.1))
    beyond, fall = flow_structure(*(wide := problem_of_outlets(monkeypatch, 0.3)))
    assert within < 2.0 * max(sound, 100.0)
    assert beyond > 5.0 * max(sound, 100.0) and fall > 0.3
    edges = wide[1].at.edges
    assert max(abs(getattr(edges, edge) - 1.0) for edge in EDGES) == pytest.approx(MOST_UNEQUAL)
    assert metered(edges) > 0.9


def problem_of_outlets(monkeypatch: pytest.MonkeyPatch, loss: float) -> tuple[Problem, Fit]:
    """A rig whose outlets are smaller than its inlets by a share."""
    return fitted(monkeypatch, {"edge_gain": loss})


@pytest.mark.slow
def test_a_sound_leg_with_edges_three_per_cent_apart_is_told_sound(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    numbers = {"pa_more": 0.03, "at_more": -0.03, "pb_more": 0.0, "bt_more": 0.03}
    found = as_json(diagnose(rig_of(monkeypatch, 10, numbers)))
    assert found["verdict"] == "none" and found["effects"] == []
    sizes = {edge: size["value"] for edge, size in found["valve_edges"].items()}
    assert sizes == pytest.approx({"pa": 1.03, "at": 0.97, "pb": 1.0, "bt": 1.03}, abs=0.008)


def test_of_what_a_supply_is_measured_to_wander_so_much_reaches_the_edges_as_they_see() -> None:
    signals, open_ = at_rest(1.0)
    nominal = signals.known.supply_pressure_nominal_pa
    assert nominal is not None
    wandering = signals.with_(supply_pressure_pa=np.full(50, nominal + 4e5))
    higher = signals.with_(
        known=signals.known.model_copy(update={"supply_pressure_nominal_pa": nominal + 2e5})
    )
    half = flow_balance(wandering, FlowTerms(0.0, 0.03), open_, Edges(supply_share=0.5))
    assert half.a_m3_s == pytest.approx(flow_balance(higher, FlowTerms(0.0, 0.03), open_).a_m3_s)
    blind = flow_balance(wandering, FlowTerms(0.0, 0.03), open_)
    assert blind.a_m3_s == pytest.approx(flow_balance(signals, FlowTerms(0.0, 0.03), open_).a_m3_s)
    assert half.supply_pa == pytest.approx(np.full(50, 4e5))  # what has to be explained stays


def test_a_spool_laps_further_on_the_way_that_it_is_told_to() -> None:
    at = np.repeat([-0.5, -0.04, 0.04, 0.5], 40)
    lapped = smoothed_opening(at, 0.05, 1.0, laps=(0.01, -0.02)).reshape(4, 40)[:, 20]
    assert lapped == pytest.approx([-0.47 / 0.95, -0.01 / 0.95, 0.0, 0.44 / 0.95])


@pytest.mark.slow
def test_a_spool_that_opens_late_is_found_so_and_is_no_finding(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """The valve is as it was, and declared to open 0.3 % of its travel earlier."""
    rig = rig_of(monkeypatch, 12, {})
    as_declared = rig.known.valve_deadband
    assert as_declared is not None
    base = declared(rig)
    early = base.known.model_copy(update={"valve_deadband": as_declared - 0.003})
    base = base.model_copy(update={"known": early})
    fit, _ = fit_base(Problem(series_of(rig.identify, early), base, True))
    _, sound = fitted(monkeypatch, {})
    for lap in ("lap_out", "lap_in"):
        further = getattr(fit.at.edges, lap) - getattr(sound.at.edges, lap)
        assert further == pytest.approx(0.003, abs=4e-4)
    assert fit.scale["flow"] == pytest.approx(sound.scale["flow"], rel=0.05)
