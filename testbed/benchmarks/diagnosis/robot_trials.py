"""The whole robot's diagnosis on one random run, and what believing it does on another motion of
the same machine.
"""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from tempfile import TemporaryDirectory
from time import perf_counter
from typing import TYPE_CHECKING, Any

import numpy as np
import numpy.typing as npt

from testbed.benchmarks.diagnosis.robot_draws import MOTIONS, Drawn, drawn
from testbed.benchmarks.diagnosis.scores import Trial
from testbed.machine.build import build_machine
from testbed.machine.names import LEGS
from testbed.scenario.scenario import Scenario

if TYPE_CHECKING:
    from testbed.diagnosis.robot.diagnose import RobotDiagnosis

Array = npt.NDArray[np.float64]
VISIBLE = 6.0
"""An effect is visible in a run where knowing its name raises ln of the evidence by so much."""
SETTLED_S = 1.0
"""Errors are scored after the start's transients."""


def simulate(scenario: Scenario) -> tuple[dict[str, Array], dict[str, Array], dict[str, Any]]:
    """What the sensors of a run read and what is true, column -> (n,), and what was surveyed before
    it.
    """
    from testbed.world.simulation import Simulation

    world = Simulation(scenario)
    try:
        data, truth = [], []
        while not world.finished:
            measured, true = world.run_block(1000)[:2]
            data.append(measured)
            truth.append(true)
        tables = (
            (world.data_columns, np.concatenate(data)),
            (world.truth_columns, np.concatenate(truth)),
        )
        columns = [
            {name: np.ascontiguousarray(table[:, k]) for k, name in enumerate(names)}
            for names, table in tables
        ]
        return columns[0], columns[1], world.surveyed()
    finally:
        world.close()


def diagnosed(name: str, data: Mapping[str, Array], surveyed: Any) -> RobotDiagnosis:
    """The diagnosis of a run with the shipped machine as what the robot believes."""
    from testbed.diagnosis.robot.diagnose import diagnose_robot
    from testbed.robot.robot import Robot
    from testbed.workflows.estimate import survey_of

    ropes, carried_kg = survey_of(surveyed, Path(name))
    return diagnose_robot(name, data, Robot.of(build_machine(), carried_kg), ropes)


def trial(seed: int) -> Trial:
    """One run: simulate it, diagnose it, compare with what was hidden."""
    from testbed.diagnosis.robot.findings import as_json
    from testbed.diagnosis.robot.hypotheses import Ledger

    case = drawn(seed)
    data, _, surveyed = simulate(case.scenario())
    began = perf_counter()
    found = diagnosed(f"seed-{seed}", data, surveyed)
    seconds = perf_counter() - began
    said = as_json(found)
    return {
        "seed": seed,
        "motion": case.motion,
        "kind": case.kind,
        "truth": list(case.truth),
        "hidden": list(case.hidden),
        "visible": _visible(Ledger(found.balances), case),
        "verdict": said["verdict"],
        "names": [f"{e['name']}@{e['place']}" for e in said["effects"]],
        "effects": said["effects"],
        "hypotheses": said["hypotheses"],
        "signs": found.signs.as_json(),
        "closed": _closed(found, case),
        "seconds": seconds,
    }


def _visible(ledger: Any, case: Drawn) -> bool:
    """Whether all that is hidden can be seen: each name raises the evidence of the set of them.
    What no name covers is visible where leaving a sound machine is worth as much.
    """
    if case.kind == "outside":
        return bool(ledger.best()[0].log_factor >= VISIBLE)
    if not case.truth or any(name not in ledger.names for name in case.truth):
        return False
    whole = ledger.hypothesis(case.truth).log_factor
    rests = [tuple(n for n in case.truth if n != name) for name in case.truth]
    return all(whole - ledger.hypothesis(rest).log_factor >= VISIBLE for rest in rests)


def _closed(found: RobotDiagnosis, case: Drawn) -> dict[str, float]:
    """Foot-force error, N RMS over the feet, on another motion: as believed, with what was found,
    and of the machine without what is hidden.
    """
    from testbed.diagnosis.robot.findings import models
    from testbed.recording.robot_model import RobotModelFile, write_robot_model

    if found.verdict.kind != "effect":
        return {}
    names = list(MOTIONS)
    other = names[(names.index(case.motion) + 1) % len(names)]
    sound = Drawn(case.seed, case.motion, "clean", (), case.overrides[:-1])
    with TemporaryDirectory() as folder:
        path = Path(folder) / "model.yaml"
        write_robot_model(path, models(found, RobotModelFile())["after"])
        data, truth, surveyed = simulate(case.scenario(other))
        return {
            "before": force_error_n(data, truth, surveyed, None),
            "after": force_error_n(data, truth, surveyed, path),
            "sound": force_error_n(*simulate(sound.scenario(other)), None),
        }


def force_error_n(
    data: Mapping[str, Array], truth: Mapping[str, Array], surveyed: Any, model: Path | None
) -> float:
    """Root mean square error of the own estimate over the four feet, N, with what a model file adds
    to the belief.
    """
    from testbed.estimation.live.chain import forces
    from testbed.workflows.estimate import with_body
    from testbed.world.believed import own_belief

    believed = own_belief(build_machine(), model)
    belief = believed.legs(float(np.median(np.diff(data["t"]))))
    told = forces(data, with_body(belief, believed, surveyed, Path("run")))
    later = data["t"] > data["t"][0] + SETTLED_S
    errors = [told[f"force_{leg}_n"] - truth[f"foot_load_{leg}"] for leg in LEGS]
    return float(np.sqrt(np.mean(np.square(errors)[:, later])))
