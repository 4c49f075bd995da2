"""ROBOCLIMBER testbed: heavy hydraulic legged machines on steep ground.

    import testbed

    with testbed.simulate(testbed.load_scenario("drill_slope_45", duration=5.0)) as run:
        while not run.finished:
            run.step(100)
    run.rows["estimate"]["own"]         # estimated foot loads (n, 4), N
    run.truth["foot_load"]              # true ones

Each name below is imported when it is first asked for.
"""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from testbed.envs import make_env
    from testbed.errors import InputError, SimulationFault, UserCodeError
    from testbed.scenario.scenario import Scenario, load_scenario
    from testbed.simulation.live_run import Run, simulate
    from testbed.simulation.runs import RecordedRun, read_run
    from testbed.workflows.diagnose import Diagnosed, diagnose
    from testbed.workflows.identify import identify

__version__ = "0.35.0"
__all__ = [
    "Diagnosed",
    "InputError",
    "RecordedRun",
    "Run",
    "Scenario",
    "SimulationFault",
    "UserCodeError",
    "diagnose",
    "identify",
    "load_scenario",
    "make_env",
    "read_run",
    "simulate",
]
_HOMES = {
    "errors": ("InputError", "SimulationFault", "UserCodeError"),
    "scenario.scenario": ("Scenario", "load_scenario"),
    "simulation.live_run": ("Run", "simulate"),
    "simulation.runs": ("RecordedRun", "read_run"),
    "workflows.diagnose": ("Diagnosed", "diagnose"),
    "workflows.identify": ("identify",),
    "envs": ("make_env",),
}
"""Module within the package -> the names that it gives."""


def __getattr__(name: str) -> Any:
    """Import a name of the front door where it is first used."""
    for module, names in _HOMES.items():
        if name in names:
            value = getattr(import_module(f"testbed.{module}"), name)
            globals()[name] = value
            return value
    raise AttributeError(f"module 'testbed' has no attribute {name!r}")


def __dir__() -> list[str]:
    return sorted([*globals(), *__all__])
