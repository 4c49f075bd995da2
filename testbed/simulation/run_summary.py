"""The summary of a run (`summary.json`), from its recorded columns and from what only the world
knows; with its smallest margins against tipping and sliding.

Wrench and energy margin (robot/stability.py) are looked at twice a second at most. The standing
feet, the ropes' pulls, the drill's reaction, masses and friction are the true ones; the ropes keep
their tension, the feet may share their load out as friction allows.
"""

from __future__ import annotations

import json
from collections.abc import Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from testbed import __version__
from testbed.estimation.contact_losses import LossRule, nominal_load_n
from testbed.formats.arrays import Array, Columns
from testbed.formats.files import plain
from testbed.machine.names import AXES, GRAVITY_M_S2, LEGS, SIDES
from testbed.robot.loads.foot_loads import external_wrench, point_wrench
from testbed.robot.model import RobotModel, rotations_of
from testbed.robot.stability import tipping_work_j, wrench_margin_n
from testbed.scenario.events import Bound, Expect
from testbed.scenario.scenario import Scenario, load_scenario
from testbed.simulation.metrics import run_metrics
from testbed.simulation.runs import same_rows
from testbed.world.summary import world_summary

if TYPE_CHECKING:
    from testbed.world.simulation import Simulation


# Compares a run's summary with what its scenario expects, and tells what the scenario hid from the
# model.


def unmet(expect: Expect, summary: Mapping[str, Any]) -> list[str]:
    """One line for each expectation that the summary does not meet; empty where all are met."""
    lines = []
    if expect.verdict is not None and summary.get("verdict") != expect.verdict:
        lines.append(f"verdict is {summary.get('verdict')!r}, expected {expect.verdict!r}")
    for path, bound in expect.summary.items():
        lines += _broken(path, bound, lookup(summary, path))
    return lines


def lookup(tree: Any, path: str) -> Any:
    """The value at a dotted path, None where there is none; a number counts a list's entries."""
    for key in path.split("."):
        if isinstance(tree, Mapping):
            tree = tree.get(key)
        elif isinstance(tree, (list, tuple)) and key.isdigit() and int(key) < len(tree):
            tree = tree[int(key)]
        else:
            return None
    return tree


def _broken(path: str, bound: Bound, value: Any) -> list[str]:
    if bound.equals is not None:
        return [] if value == bound.equals else [f"{path} is {value!r}, expected {bound.equals!r}"]
    if isinstance(value, bool) or not isinstance(value, (int, float)):
        return [f"{path} is {value!r}, expected a number"]
    lines = []
    if bound.min is not None and not value >= bound.min:
        lines.append(f"{path} is {value:g}, expected at least {bound.min:g}")
    if bound.max is not None and not value <= bound.max:
        lines.append(f"{path} is {value:g}, expected at most {bound.max:g}")
    return lines


def hidden_effects(scenario: Scenario) -> str:
    """What a scenario hides from the model, for a result that is set beside it: "effect at place,
    ..." or "nothing".
    """
    return (
        ", ".join(
            f"{hidden_.effect} at {hidden_.at.replace('_', ' ')}" for hidden_ in scenario.undeclared
        )
        or "nothing"
    )


def hidden_numbers(scenario: Scenario) -> list[dict[str, Any]]:
    """What is hidden in a scenario: name, place and parameters of each effect."""
    return [
        {"name": hidden_.effect, "place": hidden_.at, "parameters": dict(hidden_.parameters)}
        for hidden_ in scenario.undeclared
    ]


def elsewhere(scenario: Scenario, name: str, seed: int) -> Scenario:
    """Scenario `name` with the machine of another one and the effects that it hides."""
    machine = scenario.machine.model_dump(mode="json", exclude_none=True)
    hidden = [one.model_dump(mode="json") for one in scenario.undeclared]
    overrides = [f"undeclared={json.dumps(hidden)}"]
    overrides += [f"machine.{key}={json.dumps(value)}" for key, value in machine.items()]
    return load_scenario(name, overrides, seed)


EVERY_S, MOST_LOOKS = 0.5, 240
SETTLED_S = 0.5
"""The first contacts of a run form within this time."""
HEADS = (
    "position_",
    "rods_stored",
    "contact_normal_",
    "body_pose_",
    "rope_force_",
    "drill_wrench_",
)
TOUCHING_N = 20.0
"""A foot of ROBOCLIMBER with more normal force than this stands: it can carry more."""


def stability_summary(simulation: Simulation, data: Columns, truth: Columns) -> dict[str, Any]:
    """Lowest wrench margin [N] and energy margin [J] of a Simulation's run and their times; empty
    where columns are missing.
    """
    if f"position_{AXES[0]}" not in data or len(truth["t"]) < 2:
        return {}
    rows = min(len(data["t"]), len(truth["t"]))
    step = max(round(EVERY_S / float(np.median(np.diff(truth["t"])))), rows // MOST_LOOKS, 1)
    looks = np.arange(min(round(SETTLED_S / EVERY_S) * step, rows - 1), rows, step)
    data, truth = _at(looks, data), _at(looks, truth)
    normals = np.array([truth[f"contact_normal_{leg}"] for leg in LEGS])
    stands = simulation.machines.truth.scale.force * TOUCHING_N <= normals.T
    first = int(np.argmax(stands.any(axis=1)))  # what lies does not tip
    found = np.array(
        [
            _margins(simulation, data, truth, look, np.flatnonzero(stands[look]))
            for look in range(first, len(stands))
        ]
    )
    wrench, energy = (first + int(np.argmin(found[:, measure])) for measure in (0, 1))
    return {
        "lowest_wrench_margin_n": float(found[wrench - first, 0]),
        "lowest_wrench_margin_at_s": float(truth["t"][wrench]),
        "lowest_energy_margin_j": float(found[energy - first, 1]),
        "lowest_energy_margin_at_s": float(truth["t"][energy]),
    }


def _at(looks: NDArray[np.intp], series: Columns) -> Columns:
    """The columns that the margins need, at some rows."""
    return {name: series[name][looks] for name in series if name == "t" or name.startswith(HEADS)}


def _put_on_kg(simulation: Simulation, t: float) -> float:
    """What events have put on the rod store by then, kg."""
    loads = (event for event in simulation.events if event["kind"] == "payload")
    return float(sum(event["mass_kg"] for event in loads if event["t"] <= t))


def _friction(simulation: Simulation, t: float, feet_in_world: Array) -> Array:
    """Friction under the feet (4) at these places (4, 3), m, as events have left it by then."""
    footing, ground = simulation.machine.footing, simulation.scenario.terrain.friction
    for event in simulation.events:
        if event["kind"] == "set_friction" and event["t"] <= t:
            ground = event["friction"]
    own = footing.own_friction(feet_in_world) if footing is not None else np.full(4, np.nan)
    return np.where(np.isnan(own), ground, own)


def _margins(
    simulation: Simulation,
    data: Columns,
    truth: Columns,
    row: int,
    standing: NDArray[np.intp],
) -> tuple[float, float]:
    """Wrench margin, N, and energy margin, J, at one row with these feet on the ground; all in the
    body frame, with the true masses, friction and places where ropes pull.
    """
    model: RobotModel = simulation.machine.kinematics
    attachments = np.array(simulation.machine.board.ropes["attachment"])
    t, origin = (
        float(truth["t"][row]),
        np.array([truth[f"body_pose_in_world_{axis}"][row] for axis in "xyz"]),
    )
    joints = np.array([data[f"position_{axis}"][row] for axis in AXES])
    to_body = rotations_of([truth[f"body_pose_in_world_q{axis}"][row] for axis in "xyzw"]).T
    gravity = to_body @ np.array([0.0, 0.0, -GRAVITY_M_S2])
    feet = model.foot_positions_m(joints)
    pulls = (
        np.array(
            [[truth[f"rope_force_in_world_{side}_{axis}"][row] for axis in "xyz"] for side in SIDES]
        )
        @ to_body.T
    )
    drill = to_body @ np.array([truth[f"drill_wrench_in_world_f{axis}"][row] for axis in "xyz"])
    turn = to_body @ np.array([truth[f"drill_wrench_in_world_t{axis}"][row] for axis in "xyz"])
    load = external_wrench(
        model, joints, gravity, None, None, point_wrench(drill, model.drill_mount_m)
    )
    load[3:] += turn
    for pull, attachment in zip(pulls, attachments, strict=True):
        load += point_wrench(pull, attachment)
    rods_kg = float(data["rods_stored"][row]) if "rods_stored" in data else 0.0
    stored = (rods_kg + _put_on_kg(simulation, t)) * gravity
    load += point_wrench(stored, model.rod_store_m)
    centre = model.centre_of_mass_m(joints)
    forces = np.vstack([model.total_mass_kg * gravity, pulls, drill, stored])
    points = np.vstack([centre, attachments, model.drill_mount_m, model.rod_store_m])
    up = np.tile([0.0, 0.0, 1.0], (len(standing), 1))
    friction = _friction(simulation, t, origin + feet @ to_body)[standing]
    wrench = wrench_margin_n(feet[standing], up, friction, load, centre) if len(standing) else 0.0
    return wrench, tipping_work_j(feet[standing], forces, points)


OFF_S = 0.05
"""A machine is off its feet where none has borne for longer when the run ends (E)."""
UNLOADED_S, UNLOADED_SHARE, UNLOADED_ANYHOW_S = 5.0, 0.5, 10.0
"""A machine has not stood where a foot that was meant to carry bore nothing for so long in a row
and for this share of its time, or for the longer time in a row anyhow (E)."""
SUMMARY_FORMAT = "roboclimber-summary/1"
MADE_BY = f"roboclimber-testbed {__version__}"


@dataclass
class Ending:
    """How a run came to its end."""

    wall_s: float
    interrupted: bool = False
    """Stopped from outside."""
    fault: BaseException | None = None
    """What broke down, if anything did."""

    def verdict(self, of_world: str, figures: Mapping[str, Any]) -> str:
        """The verdict in words (docs/verdicts.md): the world's, but for feet that hung in the air,
        or what broke down.
        """
        if self.fault is not None:
            return f"fault: {self.fault or type(self.fault).__name__}"
        if of_world == "stood" and figures.get("off_its_feet_s", 0.0) > OFF_S:
            return "off its feet"
        if of_world == "stood" and _hung(figures):
            return "lost footing"
        return of_world


def _hung(figures: Mapping[str, Any]) -> bool:
    """Whether a foot that was meant to carry bore nothing for too long."""
    longest_s = figures.get("longest_unloaded_s") or {}
    return any(
        seconds > UNLOADED_ANYHOW_S
        or (seconds > UNLOADED_S and figures["unloaded_share"][leg] > UNLOADED_SHARE)
        for leg, seconds in longest_s.items()
    )


def loss_rule(simulation: Simulation) -> LossRule:
    """What the scenario calls a loss of contact, on the machine that is believed."""
    rule = simulation.scenario.estimator
    return LossRule(nominal_load_n(simulation.machines.belief), rule.loss_share, rule.loss_s)


def world_part(simulation: Simulation) -> dict[str, Any]:
    """What a Simulation's summary holds of the slope, the world and the events, which no recorded
    column is read for.
    """
    part = {
        "slope_deg": simulation.scenario.terrain.slope_deg,
        **world_summary(simulation),
        "events": list(simulation.events),
    }
    return dict(plain(part))


def summary_of_run(
    simulation: Simulation, data: Columns, truth: Columns, ending: Ending
) -> dict[str, Any]:
    """The summary of a Simulation as far as it came; `data` and `truth` are its recorded columns,
    (n,) each.
    """
    scenario = simulation.scenario
    data, truth = same_rows(data, truth)
    figures: dict[str, Any] = {}
    if len(truth["t"]) > 0:
        rule = loss_rule(simulation)
        figures = run_metrics(data, truth, scenario.terrain.slope_deg, rule)
        figures |= stability_summary(simulation, data, truth)
    summary: dict[str, Any] = {
        "format": SUMMARY_FORMAT,
        "made_by": MADE_BY,
        "scenario": scenario.name,
        "description": scenario.description,
        "seed": scenario.seed,
        "verdict": ending.verdict(str(simulation.verdict), figures),
        "interrupted": ending.interrupted,
        "planned_s": scenario.duration_s,
        "simulated_s": float(truth["t"][-1]) if len(truth["t"]) else 0.0,
        "wall_s": ending.wall_s,
        "task": scenario.task.kind,
        "undeclared": [effect.model_dump() for effect in scenario.undeclared],
        "machine": scenario.machine.model_dump(),
    }
    for part in (figures, world_part(simulation)):
        twice = summary.keys() & part.keys()
        assert not twice, f"{sorted(twice)} of a summary are worked out in two places"
        summary |= part
    if scenario.expect != Expect() and not ending.interrupted and ending.fault is None:
        broken = unmet(scenario.expect, plain(summary))
        summary["expectations"] = {"met": not broken, "unmet": broken}
    return dict(plain(summary))
