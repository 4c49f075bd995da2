"""Gymnasium environments; importing this package registers them.

    import gymnasium, testbed.envs
    env = gymnasium.make("Roboclimber/Drill-v0")

Without the import the id is "testbed.envs:Roboclimber/Drill-v0".
"""

from __future__ import annotations

import re
from typing import Any

import gymnasium

from testbed.errors import InputError

ENVIRONMENTS: dict[str, tuple[str, dict[str, Any]]] = {
    "Roboclimber/Stand-v0": ("testbed.envs.holding:StandEnv", {"scenario": "stand_slope_45"}),
    "Roboclimber/Climb-v0": ("testbed.envs.climb:ClimbEnv", {"scenario": "crawl_slope_30"}),
    "Roboclimber/Drill-v0": ("testbed.envs.holding:DrillEnv", {"scenario": "drill_slope_45"}),
    "Roboclimber/ForceDistribution-v0": (
        "testbed.envs.force_distribution:ForceDistributionEnv",
        {"scenario": "drill_slope_45", "randomisation": "distribution"},
    ),
    "Roboclimber/Climb-v1": (
        "testbed.envs.climb:ClimbStepsEnv",
        {
            "scenario": "crawl_slope_45",
            "overrides": ["rates.record_hz=100", "task.steps=1000"],
            "duration_s": 60.0,
            "randomisation": "climb",
            "step_ms": 100,
        },
    ),
    "Roboclimber/Keep-v0": (
        "testbed.envs.keep:KeepEnv",
        {
            "scenario": "stand_slope_45",
            "overrides": ["rates.record_hz=100"],
            "duration_s": 4.0,
            "randomisation": "keep",
            "step_ms": 50,
        },
    ),
    "Roboclimber/DrillHole-v0": (
        "testbed.envs.drill_hole:DrillHoleEnv",
        {"scenario": "drill_unknown_rock", "randomisation": "drill_hole", "step_ms": 1000},
    ),
}
"""Id -> entry point and keyword arguments, all plain JSON values."""

make, make_vec = gymnasium.make, gymnasium.make_vec
"""gymnasium's own, for rooms that do not import gymnasium."""


def _short(full: str) -> str:
    """Roboclimber/ForceDistribution-v0 -> force-distribution."""
    words = full.removeprefix("Roboclimber/").rpartition("-v")[0]
    return re.sub(r"(?<=[a-z])(?=[A-Z])", "-", words).lower()


NAMES: dict[str, str] = {
    **{_short(full): full for full in sorted(ENVIRONMENTS)},
    **{f"{_short(full)}-{full.rpartition('-')[2]}": full for full in ENVIRONMENTS},
}
"""stand, climb, climb-v0, ... -> id; a name without a version is that of the newest one."""


def named(name: str, field: str = "name") -> str:
    """The id of an environment by its name, or by its id. Raises InputError, naming `field`, for
    none of these.
    """
    if name in ENVIRONMENTS:
        return name
    if name not in NAMES:
        allowed = ", ".join(short for short in NAMES if not re.search(r"-v\d+$", short))
        raise InputError("no such environment", field=field, value=name, allowed=allowed)
    return NAMES[name]


def make_env(name: str, **options: Any) -> Any:
    """An environment by its id ("Roboclimber/Drill-v0") or its name alone ("drill"); `options` as
    of its class.

    Raises InputError for a name that is none.
    """
    return gymnasium.make(named(name), **options)


def make_in_processes(name: str, count: int, **options: Any) -> Any:
    """So many environments, each in a process of its own with one thread, that step together: a
    gymnasium `VectorEnv`. Arguments and errors as of `make_env`.
    """
    from testbed.simulation.workers import single_threaded

    single_threaded()
    return gymnasium.make_vec(
        named(name),
        count,
        vectorization_mode="async",
        vector_kwargs={"context": "spawn"},
        **options,
    )


for _id, (_entry, _kwargs) in ENVIRONMENTS.items():
    gymnasium.register(id=_id, entry_point=_entry, kwargs=_kwargs)
