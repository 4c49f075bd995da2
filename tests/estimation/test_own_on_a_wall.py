"""The own estimate where little is known: on a wall the feet bear a tenth of the weight, and
friction hides as much.
"""

from __future__ import annotations

from testbed.machine.names import LEGS
from testbed.scenario.scenario import load_scenario
from testbed.world.simulation import Simulation


def test_what_stuck_pistons_hide_is_not_taken_for_an_error_of_the_weight() -> None:
    """The balance of the body is known to about 300 N; what the feet bear in all may be off by no
    more for long.
    """
    world = Simulation(load_scenario("drill_wall_85", duration=10.0))
    data, truth = world.run_block(10_000)
    world.close()
    late = slice(7_000, None)
    own = sum(data[late, world.data_columns.index(f"estimate_own_{leg}")].mean() for leg in LEGS)
    true = sum(truth[late, world.truth_columns.index(f"foot_load_{leg}")].mean() for leg in LEGS)
    hidden = (
        sum(
            data[late, world.data_columns.index(f"estimate_one_chamber_{leg}")].mean()
            for leg in LEGS
        )
        - true
    )
    assert abs(own - true) < 600.0 < abs(hidden)
