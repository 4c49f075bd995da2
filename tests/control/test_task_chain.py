"""Tasks one after the other, stops and turns of a walk: set points never jump, and each part does
what it is told.
"""

from __future__ import annotations

from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from walking_machine import LOADS, START, TICK, at_the_start, believed_start

from testbed.control.gaits.chain import Chain, chain_in, legs_of_walk, walk_in
from testbed.control.gaits.table import gait_of
from testbed.errors import InputError
from testbed.scenario.scenario import Scenario, load_scenario
from testbed.scenario.tasks import Crawl

MOST_S = 120.0
FASTEST = 0.6
"""No set point moves faster, m/s or rad/s."""


def _scenario(*changes: str) -> Scenario:
    return load_scenario("crawl_slope_45", list(changes))


def _made(*changes: str) -> Chain:
    spec = _scenario(*changes)
    made = chain_in(gait_of(spec, believed_start(spec)))
    assert made is not None
    return made


def _walked(made: Chain, until_s: float = MOST_S) -> list[tuple[float, Any, dict[str, Any]]]:
    """Time, command and progress of every tick until it is done, on a machine that follows its set
    points.
    """
    seen, told, t = at_the_start(), [], 0.0
    before = START
    while t < until_s and not made.progress(t)["done"]:
        command = made.command(t, TICK, seen)
        assert np.abs(command.joints - before).max() < FASTEST * TICK, f"a jump at {t:.2f} s"
        before = command.joints
        walk = walk_in(made._gait)
        tension = seen.rope_tension if walk is None else walk._ropes.wanted_n(walk._body)
        loads = np.where(command.stance, LOADS, 0.0)
        seen = seen.but(position=command.joints, load=loads, rope_tension=tension)
        told.append((t, command, made.progress(t)))
        t += TICK
    return told


CRAWL = "{kind: crawl, start_s: 0.1, steps: 4, step_length_m: 0.2, swing_height_m: 0.05}"


@pytest.mark.slow
def test_each_part_begins_where_the_last_one_ended() -> None:
    made = _made(f"task={{kind: chain, tasks: [{{kind: stand, for_s: 0.3}}, {CRAWL}, {CRAWL}]}}")
    told = _walked(made)
    first = [t for t, _, progress in told if progress["parts_done"] == 0]
    assert max(first) == pytest.approx(0.3, abs=2 * TICK)
    assert made.progress(told[-1][0])["parts_done"] == 3 or told[-1][0] < MOST_S - 1.0
    assert made._moved_m[0] + walk_in(made._gait).moved_m[0] == pytest.approx(2 * 0.15, abs=0.02)  # type: ignore[union-attr]


@pytest.mark.slow
def test_a_walk_stops_with_all_feet_on_the_ground_and_turns_with_the_steps_that_are_left() -> None:
    events = "[{kind: stop, at_s: 4, duration_s: 6}, {kind: turn, at_s: 12, heading_deg: 20}]"
    made = _made(f"task={CRAWL.replace('steps: 4', 'steps: 8')}", f"events={events}")
    told = _walked(made)
    resting = [b for a, b in pairwise(told) if a[1] is b[1]]
    assert all(4.0 < t < 10.0 for t, _, _ in resting)
    assert len(resting) > 300, "it did not wait"
    assert all(command.stance.all() for _, command, _ in resting)
    walks = [part for part in made._parts if isinstance(part, Crawl)]
    assert [walk.heading_deg for walk in walks] == [0.0, 20.0]
    assert made.progress(told[-1][0])["done"] or told[-1][0] < MOST_S - 1.0


def test_turns_come_in_the_order_of_their_times() -> None:
    events = "[{kind: turn, at_s: 9, heading_deg: 20}, {kind: turn, at_s: 0.2, heading_deg: -30}]"
    made = _made(f"task={CRAWL}", f"events={events}")
    made.command(0.2, TICK, at_the_start())
    assert [part.heading_deg for part in made._parts] == [0.0, -30.0]


@pytest.mark.slow
def test_a_walk_comes_to_its_waypoints() -> None:
    walk = "{kind: crawl, start_s: 0.1, step_length_m: 0.2, swing_height_m: 0.05, waypoints_m: [[0.2, 0], [0.2, 0.1]]}"
    made = _made(f"task={walk}")
    _walked(made)
    here = made._moved_m + walk_in(made._gait).moved_m  # type: ignore[union-attr]
    assert here[:2] == pytest.approx([0.2, 0.1], abs=0.02)


@pytest.mark.parametrize("gait", ["flowing", "two_phase", "wave"])
def test_strides_are_as_long_as_the_way_needs(gait: Any) -> None:
    places = ((0.5, 0.0), (0.5, -0.3))
    task = Crawl(kind="crawl", gait=gait, step_length_m=0.2, waypoints_m=places)
    first, second = legs_of_walk(task)
    assert first.heading_deg == 0.0 and second.heading_deg == -90.0
    for leg, way in ((first, 0.5), (second, 0.3)):
        assert leg.step_length_m <= 0.2 + 1e-12 and leg.steps % 4 == 0
        short = 0.125 if gait == "wave" else 0.25
        assert leg.step_length_m * (leg.steps / 4 - short) == pytest.approx(way)


def test_words_stand_for_tasks(tmp_path: Path) -> None:
    file = tmp_path / "chain.yaml"
    file.write_text("format: roboclimber-scenario/1\ntasks: [crawl, drill_hole]\n")
    task = load_scenario(file).task
    assert [part.kind for part in task.tasks] == ["crawl", "drill_hole"]  # type: ignore[union-attr]


@pytest.mark.parametrize(
    ("changes", "said"),
    [
        (["task={kind: chain, tasks: [stand, crawl]}"], "stand has no end .*for_s"),
        (["task={kind: chain, tasks: [drill, drill_hole]}"], "drills twice"),
        (["task={kind: chain, tasks: [crawl]}"], "at least 2|2 entries"),
        (["task={kind: stand, for_s: 3}"], "a task alone goes on"),
        (["task.waypoints_m=[[0.1, 0], [0.1, 0]]", "task.steps=4"], "same place"),
        (["task.waypoints_m=[[0.1, 0]]", "task.steps=7"], "steps beside waypoints_m"),
        (
            ["task={kind: stand}", "events=[{kind: stop, at_s: 1, duration_s: 1}]"],
            "nothing that walks",
        ),
    ],
)
def test_what_has_no_end_or_no_effect_is_refused(changes: list[str], said: str) -> None:
    with pytest.raises(InputError, match=said):
        _scenario(*changes)
