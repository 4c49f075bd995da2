"""Scenes as recordings: each is simulated once; estimators and detectors then work on what its
sensors read.

A scene's folder is an ordinary recording of the robot (`recording.yaml`, `data.parquet`), beside
`truth.parquet` with the true foot forces: `testbed detect FOLDER --reference contact_normal` reads
it as any other.
"""

from __future__ import annotations

import json
import shutil
from contextlib import suppress
from dataclasses import asdict, dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from testbed.benchmarks.contact_loss.scenes import (
    STRIDES_M,
    Drawn,
    Moves,
    Scene,
    draw,
    drifting_sensors,
)
from testbed.control.gait import Layered
from testbed.errors import InputError, SimulationFault
from testbed.estimation.contact_losses import LossRule, nominal_load_n
from testbed.estimation.detectors.sample import Sampler
from testbed.estimation.live.chain import ESTIMATED, belief_of
from testbed.estimation.live.joined import replay_rows
from testbed.formats.arrays import Array
from testbed.formats.files import write_json
from testbed.formats.table import read_columns
from testbed.machine.names import LEGS
from testbed.recording.robot import read_robot

if TYPE_CHECKING:
    from testbed.world.simulation import Simulation


Tree = dict[str, Any]
BLOCK_ROWS = 1000
FACTS = "facts.json"
"""What is known of a scene besides, in its folder."""
TRUE = (
    *(f"{kind}_{leg}" for kind in ("contact_normal", "foot_load") for leg in LEGS),
    *(f"friction_{leg}_vertical" for leg in LEGS),
)


@dataclass(frozen=True, eq=False)
class Tape:
    """One scene as its detectors see it: n samples, and the truth they are scored against."""

    samples: NDArray[Any]
    """`Sample` (n,), with the estimates of today."""
    normal_n: Array
    """True force along the ground's normal (n, 4), N."""
    load_n: Array
    """True force along the vertical joint's axis (n, 4), N."""
    friction_n: Array
    """True friction of the vertical cylinder, against extension (n, 4), N."""
    rule: LossRule
    """What a loss is, on the machine that the robot believes to be."""
    dt_s: float

    @property
    def carries(self) -> NDArray[np.bool_]:
        """Whether each foot is in contact, (n, 4)."""
        return np.stack([self.rule.carrying(n, self.time_s) for n in self.normal_n.T], axis=1)

    @property
    def time_s(self) -> Array:
        """Time (n,), s."""
        return np.asarray(self.samples["row"]["t"])


def record(scene: Scene, folder: Path) -> Tree:
    """Simulate a scene into `folder`; what is known of it besides. An earlier recording there is
    removed.
    """
    from testbed.simulation.recorder import RunRecorder
    from testbed.simulation.run_folder import recording_meta
    from testbed.world.summary import surveyed

    drawn, simulation = _within_reach(scene)
    try:
        shutil.rmtree(folder, ignore_errors=True)
        folder.mkdir(parents=True)
        simulation.machine.gait = Layered(simulation.machine.gait, (Moves(drawn),))
        data = [name for name in simulation.data_columns if name not in ESTIMATED]
        belief = simulation.machines.belief
        meta = recording_meta(drawn.scenario, belief, data, surveyed(simulation))
        recorder = RunRecorder(folder, data, ("t", *TRUE), meta)
        rows, fault = _rows(simulation, recorder, data)
        recorder.finish()
    finally:
        simulation.close()
    found = facts(scene, drawn) | {
        "verdict": str(simulation.verdict),
        "fault": fault,
        "simulated_s": round(rows * simulation.dt, 3),
    }
    write_json(folder / FACTS, found)
    return found


def _within_reach(scene: Scene) -> tuple[Drawn, Any]:
    """A scene with the longest of its strides that the machine can make, ready to run; one that
    cannot walk drills.
    """
    from testbed.world.simulation import Simulation

    for stride_m in STRIDES_M if scene.kind == "crawl" else ():
        drawn = draw(scene, stride_m)
        with suppress(InputError):
            return drawn, Simulation(drawn.scenario)
    drawn = draw(replace(scene, kind="drill") if scene.kind == "crawl" else scene)
    return drawn, Simulation(drawn.scenario)


def facts_of(folder: Path) -> Tree:
    """What `record` found."""
    found: Tree = json.loads((folder / FACTS).read_text(encoding="utf-8"))
    return found


def facts(scene: Scene, drawn: Drawn) -> Tree:
    """What is known of a scene before it runs."""
    terrain = drawn.scenario.terrain
    return {
        "scene": asdict(scene),
        "slope_deg": terrain.slope_deg,
        "hidden": [f"{u.effect} at {u.at}" for u in drawn.scenario.undeclared],
        "drifting": drifting_sensors(drawn.scenario),
        "upsets": [asdict(upset) for upset in drawn.upsets],
    }


def _rows(simulation: Simulation, recorder: Any, data: list[str]) -> tuple[int, str]:
    """How many rows were written, and what broke down."""
    kept = [simulation.data_columns.index(name) for name in data]
    true = [simulation.truth_columns.index(name) for name in ("t", *TRUE)]
    rows = 0
    while not simulation.finished:
        try:
            given, truth = simulation.run_block(BLOCK_ROWS)
        except SimulationFault as error:
            return rows, str(error)
        recorder.write(given[:, kept], truth[:, true])
        rows += len(given)
    return rows, ""


def read_tape(folder: Path, model: Path | None = None) -> Tape:
    """A recorded scene with the estimates of today. `model`: a model file that the estimators
    believe.
    """
    from testbed.workflows.estimate import robot_belief

    run = read_robot(folder)
    believed = robot_belief(run, model)
    truth = read_columns(folder / "truth.parquet", dict.fromkeys(TRUE, ""), folder)
    samples = Sampler(belief_of(believed)).samples(replay_rows(run.data, believed))
    columns = np.stack([truth[name] for name in TRUE], axis=1)
    rule = LossRule(nominal_load_n(run.machine))
    true = columns[:, :4], columns[:, 4:8], columns[:, 8:]
    return Tape(samples, *true, rule, believed.dt_s)
