"""Gymnasium environments; importing this package registers them.

    import gymnasium, testbed.envs
    env = gymnasium.make("Roboclimber/Drill-v0")          # or without the import: "testbed.envs:Roboclimber/Drill-v0"
"""

from __future__ import annotations

from typing import Any

import gymnasium

_ENVIRONMENTS: dict[str, tuple[str, dict[str, Any]]] = {
    "Roboclimber/Drill-v0": ("testbed.envs.drill:DrillEnv", {"scenario": "drill_slope_45"}),
}
"""Id -> entry point and keyword arguments, all plain JSON values."""

for _id, (_entry, _kwargs) in _ENVIRONMENTS.items():
    gymnasium.register(id=_id, entry_point=_entry, kwargs=_kwargs)
