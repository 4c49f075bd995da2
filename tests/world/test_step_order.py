"""The order of one step is the one that is written down: in the calls, and inside the compiled
one.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np

from testbed.scenario.scenario import load_scenario
from testbed.world import compiled_step
from testbed.world.simulation import Simulation

COMPILED = ("move", "feet", "sense", "estimate", "record", "control", "plant")
FLAGS = {name: getattr(compiled_step, name.upper()) for name in COMPILED}
"""Parts that compiled code does, as many at once as follow one another."""
STEPS = 200


def _scenario(*changes: str) -> Any:
    return load_scenario("soft_patch", list(changes), duration=1.0)


def _spied(simulation: Simulation) -> list[str]:
    """A list that grows by the name of every part of a step when it is done."""
    said: list[str] = []
    machine = simulation.machine

    def spy(owner: Any, method: str, name: str) -> None:
        done: Callable[..., Any] = getattr(owner, method)

        def told(*arguments: Any, **named: Any) -> Any:
            said.append(name)
            return done(*arguments, **named)

        setattr(owner, method, told)

    for owner, method, name in (
        (machine.engine, "apply", "give"),
        (machine.engine, "step", "advance"),
        (machine.engine, "read", "read"),
        (simulation, "_expect", "expect"),
        (simulation, "_tell", "happen"),
        (simulation._hold, "update", "drill"),
        (machine.gait, "command", "gait"),
        (machine.judge, "look", "judge"),
        (machine.footing, "update", "ground"),
    ):
        spy(owner, method, name)
    do = simulation._do

    def told(due: int, *rest: Any) -> None:
        said.extend(name for name, flag in FLAGS.items() if due & flag)
        do(due, *rest)

    simulation._do = told  # type: ignore[method-assign]
    return said


def test_a_step_does_its_parts_in_the_order_that_is_written_down() -> None:
    changes = ("events=[{kind: cut_rope, at_s: 0.5, rope: left}]", "rates.record_hz=1000")
    simulation = Simulation(_scenario(*changes))
    try:
        said = _spied(simulation)
        simulation.run_block(510)
    finally:
        simulation.close()
    steps = " ".join(said).split("give ")[1:]
    assert len(steps) == 510
    for step in steps:
        places = [Simulation.STEP.index(part) for part in step.split()]
        assert places == sorted(places)
    assert any(step.split() == list(Simulation.STEP[1:]) for step in steps), (
        "a step at which everything is due"
    )


def _rows(order: tuple[str, ...] | None) -> np.ndarray:
    """Rows of a run in which compiled parts are called one by one in this order (None: as they
    are).
    """
    simulation = Simulation(_scenario())
    if order is not None:
        do = simulation._do

        def one_by_one(due: int, *rest: Any) -> None:
            for name in order:
                # The foot forces follow from how far the body has just moved: these two are one
                # part.
                part = due & (FLAGS["move"] | FLAGS["feet"] if name == "move" else FLAGS[name])
                if part:
                    do(part, *rest)

        simulation._do = one_by_one  # type: ignore[method-assign]
    try:
        return np.hstack(simulation.run_block(STEPS))
    finally:
        simulation.close()


def test_the_compiled_parts_come_in_that_order_too() -> None:
    """Called one by one in the written order they give the same bits; in another order they do
    not.
    """
    written = tuple(part for part in Simulation.STEP if part in COMPILED and part != "feet")
    as_they_are = _rows(None)
    np.testing.assert_array_equal(_rows(written), as_they_are)
    early = ("control", *(part for part in written if part != "control"))
    assert not np.array_equal(_rows(early), as_they_are)
