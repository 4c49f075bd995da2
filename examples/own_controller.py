"""A controller of your own shares the load out between feet and ropes: least squares, ropes
cheap.
"""

import numpy as np

import testbed
from testbed.control.distribution.distribution import Plan
from testbed.control.distribution.statics import FEET, NORMALS, ROPES, UNKNOWNS


class CheapRopes:
    """Asked for a plan a hundred times a second."""

    def plan(self, now):
        """The wanted forces z that balance the load: now.balance @ z + now.load = 0."""
        cost = np.full(UNKNOWNS, 4.0)
        cost[NORMALS] = np.where(now.stance, 1.0, 1e6)
        cost[ROPES] = 0.02
        reach = now.balance / cost
        wanted = -reach.T @ np.linalg.solve(reach @ now.balance.T, now.load)
        return Plan(wanted, feasible=bool((wanted[:FEET:3] > 0.0).all()))


scenario = testbed.load_scenario("stand_slope_45", duration=2.0)
for controller in ("position_hold", "qp", CheapRopes):
    with testbed.simulate(scenario, controller=controller) as run:
        while not run.finished:
            run.step(1000)
    loads = run.truth["foot_load"][-500:].mean(axis=0)
    pulls = run.rows["rope_tension"][-500:].mean(axis=0)
    name = controller if isinstance(controller, str) else controller.__name__
    print(f"{name:14} feet {loads.round(-1)} N, ropes {pulls.round(-1)} N")
