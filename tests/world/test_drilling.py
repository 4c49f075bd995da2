"""The drilling cycle: the order of its phases, the masses it moves, the forces it gives, and the
rock.
"""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from testbed.control.gait import Command, Measured, SetPoints
from testbed.control.layers import DEAD_RAD, GAIN_1_S, KeepMast
from testbed.laws.drill import DrillLoads, DrillOrder
from testbed.laws.penetration import best_feed, penetration_rate, thrust_factor, wandering
from testbed.machine.build import build_machine
from testbed.machine.names import LEGS
from testbed.recording.rows import DataRow, DrillKnown
from testbed.scenario.drilling import DrillHole, Rock
from testbed.world import plant
from testbed.world.board import Board
from testbed.world.drilling.cycle import DrillCycle
from testbed.world.drilling.drilling import DrillReporter, Loads, drill_known
from testbed.world.drilling.strata import VOID, Strata, sticking_places, strata_of

DT = 0.01


def hole(**changes: object) -> DrillHole:
    given = {
        "kind": "drill_hole",
        "start_s": 0.0,
        "drilled_m": 2.9,
        "depth_m": 3.1,
        "rods": 5,
        "rod_change_s": 2.0,
        "rock": {"layers": [{"kind": "soft", "thickness_m": 9.0}], "stick_probability": 0.0},
    }
    return DrillHole.model_validate(given | changes)


def rests(drill: DrillCycle) -> bool:
    """Whether a drill lets nothing act, and its controls ask for nothing."""
    acting = [getattr(drill.loads, name) for name in DrillOrder.fields]
    return not any([*acting, drill.ordered.thrust, drill.ordered.torque])


def drilled(
    task: DrillHole, most_s: float = 300.0
) -> tuple[DrillCycle, list[dict], np.ndarray, float]:
    """Run a cycle to its end: the cycle, its events, its loads over time and the mass that went to
    the store, kg.
    """
    cycle, events, rows, moved = (
        DrillCycle(task, 1, build_machine()),
        [],
        [],
        0.0,
    )
    for k in range(round(most_s / DT)):
        events += [{"t": k * DT, **e} for e in cycle.update(k * DT, DT)]
        moved += cycle.store_change_kg
        cycle.store_change_kg = 0.0
        rows.append(cycle.loads.numbers())
        if cycle.phase == "done":
            break
    return cycle, events, np.array(rows, [(name, float) for name in vars(cycle.loads)]), moved


def test_a_hole_is_drilled_rod_by_rod_and_taken_out_rod_by_rod() -> None:
    cycle, events, rows, moved = drilled(hole())
    kinds = [e["kind"].removeprefix("drill_") for e in events]
    assert kinds == [
        "position",
        "drill",
        "add_rod",
        "drill",
        "extract",
        "remove_rod",
        "extract",
        "remove_rod",
        "extract",
        "done",
    ]
    assert cycle.depth_m == pytest.approx(3.1) and rows[:]["depth"].max() == pytest.approx(3.1)
    assert cycle.rods == 1 and cycle.bit_m == pytest.approx(0.0, abs=1e-9)
    # two rods stood in the hole at first, one is in the mast at the end
    assert moved == pytest.approx(10.2)
    assert rows[-1]["mast_mass"] == pytest.approx(10.2) and rows[-1][
        "string_mass"
    ] == pytest.approx(0.0)
    assert rests(cycle)


def test_another_seed_on_the_way_changes_what_is_still_random_and_not_the_rock() -> None:
    cycles = [DrillCycle(hole(), 1, build_machine()) for _ in range(3)]
    for cycle, seed in zip(cycles, (None, 7, 8), strict=True):
        if seed is not None:
            cycle.reseed(seed)
        for k in range(1000):
            cycle.update(k * DT, DT)
    feeds = [cycle.loads.feed for cycle in cycles]
    assert len(set(feeds)) == len(feeds)
    assert all(cycle.strata == cycles[0].strata for cycle in cycles)


def test_a_hole_without_extraction_ends_with_a_feed_that_has_let_go() -> None:
    cycle, *_ = drilled(hole(extract=False))
    assert cycle.phase == "done" and rests(cycle)


def test_control_counts_every_rod_wherever_it_is() -> None:
    """Two of five stood in the hole: 20.4 kg beyond what the store carried at the start, whatever
    moves afterwards.

    With one left in the string when it is done, the store has gained one: 10.2 kg.
    """
    task = hole()
    cycle = DrillCycle(task, 1, build_machine())
    known, counted, most_in_mast = DrillKnown.zeros()[0], set(), 0.0
    for k in range(6000):
        cycle.update(k * DT, DT)
        drill_known(cycle, known)
        counted.add(round(float(known.rods_in_hole + known.rods_in_mast + known.rods_stored), 9))
        most_in_mast = max(most_in_mast, float(known.rods_in_mast))
    assert cycle.phase == "done" and counted == {20.4}
    assert known.rods_stored == pytest.approx(10.2) and most_in_mast == pytest.approx(10.2)


def test_expected_loads_carry_the_rods_of_a_string_in_the_hole() -> None:
    from testbed.scenario.scenario import load_scenario
    from testbed.world.simulation import Simulation

    world = Simulation(load_scenario("drill_deep", duration=1.0))
    data, truth = world.run_block(1000)
    world.close()
    expected, true = (
        sum(block[-200:, names.index(f"{stem}_{leg}")].mean() for leg in LEGS)
        for block, names, stem in (
            (data, world.data_columns, "expected"),
            (truth, world.truth_columns, "foot_load"),
        )
    )
    assert expected == pytest.approx(true, rel=0.003)  # 120 kg of rods would be 3 %


def test_the_string_weighs_what_its_rods_weigh_at_any_time() -> None:
    task = hole(rod_kg=95.0)
    cycle = DrillCycle(task, 1, build_machine())
    store = cycle.store_kg
    for k in range(4000):
        cycle.update(k * DT, DT)
        store += cycle.store_change_kg
        cycle.store_change_kg = 0.0
        assert store + cycle.loads.mast_mass + cycle.loads.string_mass == pytest.approx(5 * 95.0)


def test_collaring_is_gentle() -> None:
    _, events, rows, _ = drilled(hole(drilled_m=0.0, depth_m=0.1, extract=False))
    collar, drill = (
        next(e["t"] for e in events if e["kind"] == f"drill_{k}") for k in ("collar", "drill")
    )
    assert rows[round(collar / DT) + 40 : round(drill / DT)]["feed"].mean() == pytest.approx(
        2500.0, rel=0.1
    )
    assert rows[round(drill / DT) + 40 : -10]["feed"].mean() == pytest.approx(5000.0, rel=0.1)


def test_thrust_is_gone_over_a_void_and_the_string_runs_ahead() -> None:
    layers = [
        {"kind": "soft", "thickness_m": 2.95},
        {"kind": "void", "thickness_m": 0.06},
        {"kind": "soft", "thickness_m": 1.0},
    ]
    task = hole(
        rock={"layers": layers, "stick_probability": 0.0}, drilled_m=2.9, rods=5, rod_length_m=1.6
    )
    _, events, rows, _ = drilled(task)
    fell, landed = (
        next(e["t"] for e in events if e["kind"] == f"drill_{k}")
        for k in ("break_through", "landed")
    )
    assert landed - fell == pytest.approx(0.06 / task.feed_speed_m_s, abs=2 * DT)
    before, after = rows[round(fell / DT) - 1], rows[round(fell / DT)]
    assert before["feed"] > 3500.0 and before["blow"] > 0.0
    assert after["feed"] == 0.0 and after["blow"] == 0.0


def test_a_stuck_rod_is_pulled_far_above_the_feed_until_it_comes() -> None:
    task = hole(
        rock={
            "layers": [{"kind": "soft", "thickness_m": 9.0}],
            "stick_probability": 0.0,
            "stuck": [{"depth_m": 2.0, "hold_n": 18000.0}],
        }
    )
    cycle, events, rows, _ = drilled(task)
    stuck, freed = (next(e for e in events if e["kind"] == f"rod_{k}") for k in ("stuck", "freed"))
    assert stuck["depth_m"] == pytest.approx(2.0, abs=0.01) and freed["depth_m"] == stuck["depth_m"]
    assert 2.0 * task.feed_n < rows[:]["pull"].max() < 18000.0
    assert rows[round(freed["t"] / DT) + 1]["pull"] == pytest.approx(task.pull_n)
    assert cycle.summary()["drill"]["freed"] == 1 and cycle.phase == "done"


def test_a_rod_that_never_comes_is_left_behind_with_the_string() -> None:
    task = hole(
        pull_max_n=5000.0,
        give_up_s=3.0,
        rock={
            "layers": [{"kind": "soft", "thickness_m": 9.0}],
            "stick_probability": 0.0,
            "stuck": [{"depth_m": 3.05, "hold_n": 60000.0}],
        },
    )
    cycle, events, rows, _ = drilled(task)
    assert any(e["kind"] == "rods_lost" for e in events)
    assert cycle.rods == 0 and rows[-1]["string_mass"] == rows[-1]["mast_mass"] == 0.0


def test_penetration_by_hand() -> None:
    """0.7 of 110 J, 35 times a second, on 45.4 cm2 of rock of 240 MJ/m3: 2.48 mm/s at the best
    feed.
    """
    rate = penetration_rate(110.0, 35.0, 0.7, 0.076, 2.4e8, thrust_factor(5500.0, 5500.0))
    assert rate == pytest.approx(0.7 * 110.0 * 35.0 / (math.pi / 4 * 0.076**2 * 2.4e8))
    assert rate == pytest.approx(2.475e-3, rel=1e-3)
    assert [thrust_factor(f, 5500.0) for f in (0.0, 2750.0, 11000.0, 12000.0)] == [
        0.0,
        0.75,
        0.0,
        0.0,
    ]


def test_hard_rock_wants_more_feed_than_soft_rock() -> None:
    """Medium rock wants the hammer's own best feed; twice the energy to the power 0.35 is 1.27
    times it.
    """
    assert best_feed(5500.0, 1.0, 0.35) == 5500.0
    assert best_feed(5500.0, 2.0, 0.35) == pytest.approx(1.2746 * 5500.0, rel=1e-4)
    cycle = DrillCycle(hole(), 1, build_machine())
    assert cycle.best_feed_n(2.9) == pytest.approx(5500.0 * (5.0 / 13.0) ** 0.35)


def _ordered(feed_n: float | None, hammer: float, seconds: float = 12.0) -> DrillCycle:
    """Soft rock, whose best feed is 3.9 kN, drilled with what control orders."""
    task = hole(drilled_m=0.1, depth_m=1.4, extract=False, position_s=1.0)
    cycle = DrillCycle(task, 1, build_machine())
    cycle.feed_n, cycle.hammer = feed_n, hammer
    for k in range(round(seconds / DT)):
        cycle.update(k * DT, DT)
    return cycle


def test_control_orders_feed_and_hammer_while_it_drills() -> None:
    best, half, gentle = _ordered(3940.0, 1.0), _ordered(3940.0, 0.5), _ordered(1970.0, 1.0)
    assert half.depth_m - 0.1 == pytest.approx(0.5 * (best.depth_m - 0.1), rel=0.02)
    assert gentle.depth_m - 0.1 == pytest.approx(0.75 * (best.depth_m - 0.1), rel=0.05)
    assert half.loads.blow == pytest.approx(0.5 * best.loads.blow)
    assert _ordered(None, 1.0).depth_m == _ordered(5000.0, 1.0).depth_m


def test_a_bit_pressed_at_nearly_twice_its_best_feed_jams_and_is_turned_free() -> None:
    """At 1.9 times the best feed (0.8 of the way from 1.5 to 2 times) a jam takes 2.5 s; then 8 s
    are lost.
    """
    cycle = _ordered(1.9 * 3940.0, 1.0, seconds=4.5)
    assert cycle.phase == "jam" and cycle.summary()["drill"]["jams"] == 1
    assert cycle.ordered.thrust < 1.9 * 3940.0
    assert _ordered(1.9 * 3940.0, 1.0, seconds=13.0).phase == "drill"
    assert _ordered(1.4 * 3940.0, 1.0).summary()["drill"]["jams"] == 0


def test_a_wandering_load_has_the_asked_spread() -> None:
    rng, value, seen = np.random.default_rng(0), 0.0, []
    for _ in range(20000):
        value = wandering(value, 0.1, 0.15, DT, float(rng.normal()))
        seen.append(value)
    assert np.std(seen) == pytest.approx(0.1, rel=0.06)
    assert np.corrcoef(seen[:-15], seen[15:])[0, 1] == pytest.approx(math.exp(-1.0), abs=0.06)


@settings(max_examples=50, deadline=None)
@given(st.integers(0, 2**32 - 1), st.floats(0.0, 0.9), st.floats(0.5, 20.0))
def test_drawn_rock_reaches_down_repeats_and_never_starts_or_goes_on_in_a_void(
    seed: int, share: float, depth: float
) -> None:
    one, two = (
        strata_of(
            Rock(void_share=share, strength_spread=spread),
            depth,
            np.random.default_rng(seed),
            np.random.default_rng(seed + 1),
        )
        for spread in (0.0, 0.5)
    )
    assert (one.bottoms_m, one.kinds) == (two.bottoms_m, two.kinds)
    assert set(one.strengths) == {1.0} and min(two.strengths) > 0.0 and 1.0 not in two.strengths
    assert one.bottoms_m[-1] > depth and all(np.diff(one.bottoms_m) > 0)
    assert one.kinds[0] != VOID and one.kinds[-1] != VOID
    assert all(a != VOID or b != VOID for a, b in zip(one.kinds, one.kinds[1:], strict=False))


def test_given_layers_come_first() -> None:
    strata = Strata((1.0, 1.2, 4.0), ("hard", VOID, "soft"), (1.0, 1.0, 0.5))
    assert [strata.strength_at(x) for x in (0.5, 1.2, 9.0)] == [1.0, 0.5, 0.5]
    kinds = [strata.at(x)[0] for x in (0.0, 0.999, 1.0, 1.19, 1.2, 3.0, 9.0)]
    assert kinds == ["hard", "hard", VOID, VOID, "soft", "soft", "soft"]
    places = sticking_places(
        Rock(stick_probability=1.0), 3.0, 1.5, 5000.0, np.random.default_rng(0)
    )
    assert len(places) == 2 and places[0][0] > 1.5 > places[1][0] > 0.0
    assert all(1e4 <= hold <= 2e4 for _, hold in places)


def test_weight_of_a_string_in_the_mast_and_in_the_hole_on_a_slope() -> None:
    """45 degrees: of 100 kg in the hole 981 cos 45 N pull along -z; 50 kg in the mast pull straight
    down, 0.75 m up.
    """
    s = math.sqrt(0.5)
    rotation = np.array([[s, 0.0, -s], [0.0, 1.0, 0.0], [s, 0.0, s]])
    board = Board.zeros()[0]
    board.rotation, board.clock.step_s = rotation, 1e-3
    board.drill = DrillLoads.of(string_mass=100.0, mast_mass=50.0, mast_height=0.75)
    plant.drill_step(board)
    force, torque = board.drill_wrench[:3], board.drill_wrench[3:]
    assert rotation.T @ force == pytest.approx([-50 * 9.81 * s, 0.0, -150 * 9.81 * s])
    assert torque == pytest.approx([0.0, -0.75 * s * 50 * 9.81, 0.0])
    assert np.allclose(board.given.force, force) and np.allclose(board.given.torque, torque)


def test_the_mast_is_turned_back_by_the_legs_on_its_low_side() -> None:
    """Nose down by 0.01 rad: the front legs lengthen at gain * 0.01 rad * 1.1 m, the rear ones
    shorten, no twist.
    """
    feet = np.array([[1.1, 0.8, -0.6], [1.1, -0.8, -0.6], [-1.1, 0.8, -0.6], [-1.1, -0.8, -0.6]])
    mast, held, set_points = KeepMast(feet), Command(np.zeros(12)), SetPoints(np.zeros(12))
    for k in range(150):
        assert not mast.over(held, k * DT, DT, Measured.of()).joints.any()
    nose_down = Measured.of(attitude=[0.0, 0.01, 0.0])
    for k in range(150, 450):
        _, rates = set_points.follow(mast.over(held, k * DT, DT, nose_down), DT)
    assert rates[[2, 5, 8, 11]] == pytest.approx(
        GAIN_1_S * 0.01 * 1.1 * np.array([1, 1, -1, -1]), rel=1e-2
    )
    assert set_points.joints[2] > 0.0
    nearly = Measured.of(attitude=[0.0, 0.5 * DEAD_RAD, 0.0])
    for k in range(450, 800):
        _, rates = set_points.follow(mast.over(held, k * DT, DT, nearly), DT)
    assert not rates.any() and set_points.joints[2] > 0.0


def test_what_a_drill_works_out_has_the_names_of_what_the_world_reads() -> None:
    assert set(vars(Loads())) == set(DrillLoads.fields)


def test_the_board_and_the_row_are_told_whatever_changes() -> None:
    cycle = DrillCycle(hole(), 1, build_machine())
    boards, rows = Board.zeros(), DataRow.zeros()
    reporter = DrillReporter(cycle)
    for k in range(1500):
        cycle.update(k * DT, DT)
        reporter.report(boards, rows[0])
        assert all(boards["drill"][name] == value for name, value in vars(cycle.loads).items())
        assert rows[0].ordered_thrust == cycle.ordered.thrust
        assert rows[0].ordered_torque == -cycle.ordered.torque
        assert rows[0].rods_stored == cycle.stored_kg
    assert cycle.loads.feed > 0.0
