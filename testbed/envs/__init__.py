"""Gymnasium environments; importing this package registers them.

import gymnasium, testbed.envs
env = gymnasium.make("Roboclimber/Drill-v0")          # or without the import: "testbed.envs:Roboclimber/Drill-v0"
"""

from __future__ import annotations

from typing import Any

import gymnasium

ENVIRONMENTS: dict[str, tuple[str, dict[str, Any]]] = {
    "Roboclimber/Stand-v0": ("testbed.envs.stand:StandEnv", {"scenario": "stand_slope_45"}),
    "Roboclimber/Climb-v0": ("testbed.envs.climb:ClimbEnv", {"scenario": "crawl_slope_30"}),
    "Roboclimber/Drill-v0": ("testbed.envs.drill:DrillEnv", {"scenario": "drill_slope_45"}),
    "Roboclimber/ForceDistribution-v0": (
        "testbed.envs.force_distribution:ForceDistributionEnv",
        {"scenario": "drill_slope_45", "randomisation": "distribution"},
    ),
}
"""Id -> entry point and keyword arguments, all plain JSON values."""

make, make_vec = gymnasium.make, gymnasium.make_vec
"""gymnasium's own, for rooms that do not import gymnasium."""

for _id, (_entry, _kwargs) in ENVIRONMENTS.items():
    gymnasium.register(id=_id, entry_point=_entry, kwargs=_kwargs)
