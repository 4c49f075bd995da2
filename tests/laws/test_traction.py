"""Traction devices: strokes, clamps, oil, and who starves whom."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from testbed.compiled import njit
from testbed.laws import traction as tr
from testbed.laws.oil import ATMOSPHERE_PA
from testbed.machine.build import build_machine
from testbed.robot.traction import traction_parameters
from testbed.scenario.scenario import load_scenario
from testbed.world import plant
from testbed.world.board import Board
from testbed.world.simulation import Simulation

DT = 1e-3
FULL_PA = 9.0e6


def device() -> tuple[Any, Any]:
    state = tr.TractionState.of(way=-1.0, place=tr.RESERVE_M)
    return state, traction_parameters(build_machine(), strokes=True)


def hauled(wanted: np.ndarray, tension: float = 1e4, supply: float = FULL_PA) -> np.ndarray:
    """Rates, modes and flows (3, n) of a device that is told `wanted` (n) m/s."""
    out = np.zeros((3, len(wanted)))
    _haul(*device(), wanted, tension, supply, out)
    return out


@njit
def _haul(state: Any, numbers: Any, wanted: Any, tension: float, supply: float, out: Any) -> None:
    rates, modes, flows = out
    for k, rate in enumerate(wanted):
        before = state.place
        rates[k] = tr.traction_step(state, numbers, rate, tension, supply, DT)
        modes[k] = state.mode
        flows[k] = tr.oil_taken(state, numbers, rates[k], before, DT)


def test_half_a_metre_is_hauled_in_two_strokes_with_the_clamps_taking_turns() -> None:
    """0.03 m/s for 20 s: strokes of 0.22 m, each followed by close, return, open; what is owed is
    made up.
    """
    rates, modes, flows = hauled(np.full(20000, -0.03))
    changes = modes[np.flatnonzero(np.diff(modes)) + 1]
    assert changes[:6].tolist() == [
        tr.CLOSING,
        tr.RETURNING,
        tr.OPENING,
        tr.GRIPPED,
        tr.CLOSING,
        tr.RETURNING,
    ]
    assert not (rates[modes != tr.GRIPPED] < 0.0).any()
    numbers = traction_parameters(build_machine(), strokes=True)
    seats = rates > 0.0
    assert rates[seats] == pytest.approx(np.full(seats.sum(), numbers.seat / numbers.clamp_time))
    takings = (changes == tr.CLOSING).sum() + (changes == tr.OPENING).sum()
    assert rates[seats].sum() * DT == pytest.approx(takings * numbers.seat, rel=0.02)
    first = np.flatnonzero(modes == tr.CLOSING)[0]
    assert -rates[:first].sum() * DT == pytest.approx(0.22, abs=1e-3)
    assert rates.min() == pytest.approx(-numbers.speed)
    whole = -rates[~seats].sum() * DT
    assert whole > 0.6 - 0.05 - 0.22
    back = (changes == tr.OPENING).sum() * 0.22
    assert flows.sum() * DT == pytest.approx(
        whole * numbers.area + back * numbers.annulus, rel=0.02
    )


def test_a_short_haul_is_followed_to_the_millimetre() -> None:
    rates, modes, _ = hauled(np.r_[np.full(3000, -0.03), np.zeros(300)])
    assert (
        rates[:3000] == pytest.approx(np.full(3000, -0.03))
        and not modes.any()
        and not rates[3000:].any()
    )


def test_an_idle_device_makes_a_whole_stroke_ready() -> None:
    rates, modes, _ = hauled(np.r_[np.full(5000, -0.03), np.zeros(4000), np.full(6000, -0.03)])
    assert (modes[5000:9000] == tr.RETURNING).any() and not modes[9000:].any()
    assert rates[9000:] == pytest.approx(np.full(6000, -0.03))


def test_corrections_of_the_tension_either_way_need_no_regrip() -> None:
    wanted = 0.02 * np.sin(2.0 * np.arange(20000) * DT)
    rates, modes, _ = hauled(wanted)
    assert not modes.any() and rates == pytest.approx(wanted)


def test_paying_out_goes_the_other_way_round() -> None:
    rates, modes, flows = hauled(np.full(9000, 0.05))
    first = np.flatnonzero(modes == tr.CLOSING)[0]
    assert rates[:first].sum() * DT == pytest.approx(tr.RESERVE_M, abs=1e-3)
    assert rates[~(rates > 0.5)].sum() * DT > 0.25
    assert not flows[modes == tr.GRIPPED].any(), "the load drives the piston out"


def test_traction_stalls_at_what_pressure_and_rating_can_pull() -> None:
    """5e-3 m2 at 5 MPa pulls 25 kN; at 9 MPa it would be 45 kN, but the rating is 31.4 kN."""
    numbers = traction_parameters(build_machine(), strokes=True)
    assert tr.pull_share(25.0e3, 5.0e6, numbers) == 0.0
    assert tr.pull_share(10.0e3, 5.0e6, numbers) == 1.0
    assert tr.pull_share(31.0e3, FULL_PA, numbers) == pytest.approx(400.0 / 3141.0)
    assert tr.pull_share(31.4e3, FULL_PA, numbers) == 0.0
    rates, _, flows = hauled(np.full(2000, -0.05), tension=26e3, supply=5.0e6)
    assert not rates.any() and not flows.any()


def test_a_rope_gives_the_body_no_more_than_its_device_got_from_the_oil() -> None:
    """Energy audit of one rope with its device and a body that swings: spring + work on the body <=
    oil's work.
    """
    board = Board.zeros()[0]
    board.traction = traction_parameters(build_machine(), strokes=True)
    board.rotation, board.clock.step_s = np.eye(3), DT
    board.supply.pressure = FULL_PA + ATMOSPHERE_PA
    rope, body = board.ropes[0], board.body
    rope.anchor, rope.stiffness_ea, rope.damping = (30.0, 0.0, 0.0), 9.8e6, 5e3
    rope.breaking_load, rope.whole, rope.unstrained = 1e9, 1.0, 29.99
    work, oil = 0.0, 0.0
    for k in range(9000):
        t = k * DT
        body.position[0] = 0.01 * np.sin(7.0 * t) + 0.02 * t
        body.velocity[0] = 0.07 * np.cos(7.0 * t) + 0.02
        rope.wanted_rate = -0.03 + 0.04 * np.sin(0.9 * t)
        board.given.force[:] = 0.0
        flow = plant.rope_step(board, 0)
        work += float(board.given.force @ body.velocity) * DT
        oil += flow * FULL_PA * DT
    stretch = 30.0 - body.position[0] - rope.unstrained
    spring = 0.5 * 9.8e6 / rope.unstrained * max(stretch, 0.0) ** 2
    first = 0.5 * 9.8e6 / 29.99 * 0.01**2
    assert work + spring <= first + oil
    assert work > 0.0


def test_hauling_takes_the_legs_oil_and_a_weak_supply_stops_the_haul() -> None:
    """One supply: with the pump at a third of its pressure the same order hauls less, and hauling
    costs pressure.
    """
    events = "events=[{kind: set_rope, at_s: 0.3, rope: left, pay_out_m: -0.02, duration_s: 0.5}]"
    lengths, lowest = [], []
    for pressure in (9.0e6, 2.5e6):
        supply = f"hydraulics.supply_pressure_pa={pressure}"
        locked, circuit = "hydraulics.valves_locked=true", "machine.set=original"
        world = Simulation(
            load_scenario("stand_slope_45", [events, supply, locked, circuit], duration=1.1)
        )
        before = world.machine.board.ropes[0].unstrained
        _, truth = world.run_block(1000)
        lengths.append(before - world.machine.board.ropes[0].unstrained)
        pressure_pa = truth[:, world.truth_columns.index("supply_pressure")]
        lowest.append(pressure_pa[:280].min() - pressure_pa[300:800].min())
        world.close()
    assert lengths[0] == pytest.approx(0.02, abs=1e-3)
    assert lengths[1] < 0.005
    assert lowest[0] > 2.0e4
