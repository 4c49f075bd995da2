"""Gymnasium environments; importing this package registers them.

import gymnasium, testbed.envs
env = gymnasium.make("Roboclimber/Drill-v0")          # or without the import: "testbed.envs:Roboclimber/Drill-v0"
"""

from __future__ import annotations

import re
from typing import Any

import gymnasium

from testbed.errors import InputError

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


def make_env(name: str, **options: Any) -> Any:
    """An environment by its id ("Roboclimber/Drill-v0") or its name alone ("drill"); `options` as of its class.

    Raises InputError for a name that is none.
    """
    found = {_short(full): full for full in ENVIRONMENTS} | {full: full for full in ENVIRONMENTS}
    if name not in found:
        raise InputError("no such environment", field="name", value=name, allowed=", ".join(found))
    return gymnasium.make(found[name], **options)


def _short(full: str) -> str:
    """Roboclimber/ForceDistribution-v0 -> force-distribution."""
    words = full.removeprefix("Roboclimber/").removesuffix("-v0")
    return re.sub(r"(?<=[a-z])(?=[A-Z])", "-", words).lower()


for _id, (_entry, _kwargs) in ENVIRONMENTS.items():
    gymnasium.register(id=_id, entry_point=_entry, kwargs=_kwargs)
