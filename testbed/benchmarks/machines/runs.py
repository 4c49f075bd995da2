"""One task on one drawn machine, and what the robot may believe of that machine: its truth, its
drawing, what it found.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from testbed.benchmarks.estimators.trials import MEASURED, Series, simulate
from testbed.benchmarks.machines import moving_horizon
from testbed.diagnosis.robot.commissioning import evidence_of, levelled, weighed
from testbed.effects import by_name
from testbed.estimation.live.believed import Believed
from testbed.estimation.live.joined import replay_rows
from testbed.estimation.live.own_tuning import OwnTuning, without
from testbed.estimation.live.uncertainty import Uncertainty
from testbed.formats.arrays import Array
from testbed.formats.intervals import Z90
from testbed.machine.names import LEGS
from testbed.recording.leg_model import EffectEntry
from testbed.recording.robot_model import write_robot_model
from testbed.robot.robot import Robot
from testbed.robot.rope_bearings import SurveyedRopes
from testbed.scenario.machines import machines_of
from testbed.scenario.scenario import Scenario, load_scenario
from testbed.simulation.run_folder import truth_machine
from testbed.workflows.commission import believed, stages
from testbed.world.believed_robot import BelievedRobot, believed_robot
from testbed.world.undeclared import hidden_of

RAISE = "task={kind: raise, start_s: 2, to_m: 0.35, step_m: 0.03, every_s: 4, speed_m_s: 0.02}"
TASKS: dict[str, tuple[str, tuple[str, ...]]] = {
    "stand": ("stand_slope_45", ("duration_s=20",)),
    "raise": ("stand_slope_45", ("duration_s=18", RAISE)),
    "drill": ("drill_slope_45", ("duration_s=20",)),
    "heavy drill": ("drill_slope_45", ("duration_s=20", "robot.payload_kg=1300")),
    "crawl": ("crawl_slope_45", ("duration_s=26",)),
}
"""Task -> shipped scenario and changes."""


@dataclass(frozen=True)
class Tried:
    """What a shipped machine does: its tasks, and what it needs changed of commissioning_flat."""

    tasks: Mapping[str, tuple[str, tuple[str, ...]]]
    commissioning: tuple[str, ...] = ()


ROBOCLIMBER = "roboclimber"
MACHINES = {
    ROBOCLIMBER: Tried(TASKS),
    "climber_8t": Tried(
        {
            "stand": ("climber_8t_stand", ("duration_s=20",)),
            "raise": (
                "climber_8t_stand",
                ("duration_s=18", RAISE, "task.to_m=0.42", "task.step_m=0.04"),
            ),
            "drill": ("climber_8t_drill", ()),
            "crawl": ("climber_8t_crawl", ()),
        },
        ("machine.folder=climber_8t", "robot.vertical_m=0.32", "robot.radial_m=0.21"),
    ),
    "quarter_model": Tried(
        {
            "stand": ("quarter_model_stand", ("duration_s=20",)),
            "raise": (
                "quarter_model_stand",
                ("duration_s=18", RAISE, "task.to_m=0.0875", "task.step_m=0.0075"),
            ),
            "crawl": ("quarter_model_crawl", ()),
        },
        (
            "machine.folder=quarter_model",
            "robot.vertical_m=0.0625",
            "robot.radial_m=0.045",
            "rates.physics_hz=2000",
        ),
    ),
}
"""Shipped machine -> what it does."""
PERFECT, BOARD, COMMISSIONED = "perfect", "drawing board", "commissioned"
HORIZON = "commissioned, moving horizon"
"""The rival of moving_horizon.py."""
ABLATIONS: dict[str, tuple[str, ...]] = {
    "without weight and ropes learnt": ("weighs",),
    "without friction learnt": ("friction",),
    "without feet in the air": ("swing",),
    "without balance of the body": ("balance",),
    "without the body's acceleration": ("shakes",),
    "without what friction depends on": ("rich",),
}
"""The drawing board's belief with one idea of the estimate switched off."""
PUBLISHED = ("friction", "modified_kbf")
"""The paper's (7), and its filter on it, beside every belief's own estimate on the drawing
board.
"""
LEFT_OUT_S, MOVING_M_S, AROUND = 1.0, 3.0e-3, 25
"""The first second, in which everything starts from nothing, is not scored. A piston moves where it
does so over as many samples to both sides."""


@dataclass(frozen=True)
class DrawnMachine:
    """A machine as it is drawn with `seed` from the tolerances `draw` of a shipped one.

    `stuck_seals`: the largest share of its break-away force with which a seal is stuck when a run
    begins, each by its own share and either way. At 1 friction begins anywhere in its set, as in a
    machine that has stood for a while; at 0 all seals begin loose, in the middle of it.
    """

    seed: int
    draw: str
    machine: str = ROBOCLIMBER
    stuck_seals: float = 1.0

    @property
    def name(self) -> str:
        """Among files and cases; ROBOCLIMBER's is its seed."""
        seals = "" if self.stuck_seals == 1.0 else f" seals {self.stuck_seals:g}"
        shipped = "" if self.machine == ROBOCLIMBER else f"{self.machine} "
        return f"{shipped}{self.seed}{seals}"

    @property
    def changes(self) -> tuple[str, ...]:
        """Overrides that put a scenario onto it."""
        return (
            f"machine.draw={self.draw}",
            f"machine.seed={self.seed}",
            f"hydraulics.stuck_seals={self.stuck_seals:g}",
        )

    def task(self, task: str, *more: str) -> Scenario:
        """One of its tasks as a scenario, with `more` overrides; the seed draws its noise too."""
        name, changes = MACHINES[self.machine].tasks[task]
        return load_scenario(name, [*changes, *self.changes, *more], seed=self.seed)


def truth_as_belief(scenario: Scenario) -> BelievedRobot:
    """All of the scenario's machine that a belief can hold, believed exactly."""
    machines = machines_of(scenario)
    hidden = machines.drawn.undeclared
    cylinders = tuple(
        EffectEntry(
            name=entry.effect,
            place=entry.at,
            parameters={name: {"value": parameter} for name, parameter in entry.parameters.items()},  # type: ignore[misc]
        )
        for entry in hidden
        if by_name(entry.effect).live
    )
    return BelievedRobot(machines.truth, None, cylinders, hidden_of(hidden), sure=Uncertainty(None))


def beliefs(scenario: Scenario, model: Path | None) -> dict[str, BelievedRobot]:
    """What the robot may believe: by name; `model`: what its commissioning found."""
    board = machines_of(scenario).belief
    found = {
        PERFECT: truth_as_belief(scenario),
        BOARD: believed_robot(board, None, scenario.tolerances),
    }
    if model is not None:
        found[COMMISSIONED] = believed_robot(board, model, scenario.tolerances)
    return found


def commissioned(
    drawn: DrawnMachine, model: Path, recordings: Path | None = None
) -> dict[str, dict[str, float]]:
    """Let a drawn machine commission itself into a model file, as `testbed commission` does: each
    number found, its interval, and the truth. `recordings`: as for `recorder`.
    """
    changes = (*MACHINES[drawn.machine].commissioning, *drawn.changes)
    programme = stages("commissioning_flat", changes, drawn.seed)
    evidence, seconds = [], 0.0
    only = partial(simulate, measured=(*MEASURED, "supply_pressure"), true=())
    for stage in programme:
        kept_as = f"commissioning {stage.name} {drawn.name}"
        series = recorder(recordings, kept_as, only)(stage)
        robot = Robot.of(
            machines_of(stage).belief, stage.carried_kg, stage.ropes.attachment_height_m
        )
        if stage is programme[0]:
            evidence.append(levelled(series.data, robot))
        evidence.append(evidence_of(series.data, robot, series.ropes.directions))
        seconds += stage.duration_s
    found = weighed(evidence, robot)
    write_robot_model(model, believed(found, robot.machine, seconds))
    truth = truth_of(programme[0])
    return {
        name: {
            "value": number.value,
            "low": number.interval90[0],
            "high": number.interval90[1],
            "truth": truth[name]["value"],
        }
        for name, number in found.numbers.items()
        if number.shown and name in truth
    }


def truth_of(scenario: Scenario) -> dict[str, Any]:
    """The machine that a scenario draws, by the names of a commissioning."""
    from testbed.world.simulation import Simulation

    world = Simulation(scenario)
    try:
        numbers: dict[str, Any] = truth_machine(scenario, world)["numbers"]
    finally:
        world.close()
    return numbers


def chain_belief(
    own: BelievedRobot, scenario: Scenario, ropes: SurveyedRopes, tuning: OwnTuning | None = None
) -> Believed:
    """What the estimators' chain is built from; ropes: as surveyed, world frame."""
    belief = own.legs(1.0 / scenario.rates.estimator_hz)
    with own.bodies() as urdf:
        robot = Robot.of(own.machine, scenario.carried_kg, scenario.ropes.attachment_height_m, urdf)
        return own.with_body(belief, robot.model, ropes, tuning)


def estimates(
    scenario: Scenario, series: Series, model: Path | None, ablations: bool
) -> Iterator[tuple[str, Array, Array | None]]:
    """Name of a belief or of a method, its foot loads (4, n), and their standard deviation (4, n)
    where it says one.
    """
    for name, own in beliefs(scenario, model).items():
        rows = replay_rows(series.data, chain_belief(own, scenario, series.ropes))
        yield name, rows["estimate"]["own"].T, rows["estimate_own"]["sd"].T
        if name == COMMISSIONED:
            alone = without(OwnTuning(), "swing", "balance", "friction", "weighs", "shakes")
            belief = chain_belief(own, scenario, series.ropes, alone)
            yield HORIZON, *moving_horizon.loads(series.data, belief)
        if name != BOARD:
            continue
        for method in PUBLISHED:
            yield method, rows["estimate"][method].T, None
        for label, ideas in ABLATIONS.items() if ablations else ():
            tuning = without(OwnTuning(), *ideas)
            belief = chain_belief(own, scenario, series.ropes, tuning)
            rows = replay_rows(series.data, belief)
            yield label, rows["estimate"]["own"].T, rows["estimate_own"]["sd"].T


def sums(error: Array, sd: Array | None, moving: NDArray[np.bool_]) -> dict[str, float]:
    """Samples, squared error, and how many the 90 % interval holds; those of moving pistons apart;
    all (4, n).
    """
    out: dict[str, float] = {}
    for prefix, mask in (("", np.ones_like(moving)), ("moving_", moving)):
        out[f"{prefix}samples"] = int(mask.sum())
        out[f"{prefix}square"] = float((error[mask] ** 2).sum())
        if sd is not None:
            out[f"{prefix}held"] = int((np.abs(error[mask]) <= Z90 * sd[mask]).sum())
    return out


def scores(
    scenario: Scenario,
    model: Path | None,
    ablations: bool,
    record: Callable[[Scenario], Series] = simulate,
) -> Mapping[str, dict[str, float]]:
    """`sums` of every belief and method over one run."""
    series = record(scenario)
    late = series.data["t"] > LEFT_OUT_S
    true = np.array([series.truth[f"foot_load_{leg}"] for leg in LEGS])
    place = np.array([series.data[f"position_{leg}_vertical"] for leg in LEGS])
    way = np.zeros_like(place)
    way[:, AROUND:-AROUND] = np.abs(place[:, 2 * AROUND :] - place[:, : -2 * AROUND])
    step_s = 1.0 / scenario.rates.record_hz
    moving = (way > MOVING_M_S * 2 * AROUND * step_s)[:, late]
    return {
        name: sums((load - true)[:, late], None if sd is None else sd[:, late], moving)
        | {"moving_s": float(moving.sum()) * step_s}
        for name, load, sd in estimates(scenario, series, model, ablations)
    }


def kept(series: Series, file: Path) -> None:
    """Write what a run left, in single precision."""
    columns: dict[str, Any] = {
        f"data_{name}": value.astype(np.float32) for name, value in series.data.items()
    }
    columns |= {f"truth_{name}": value.astype(np.float32) for name, value in series.truth.items()}
    file.parent.mkdir(parents=True, exist_ok=True)
    whole = file.with_suffix(".part.npz")
    np.savez(whole, ropes=series.ropes.table, time=series.data["t"], **columns)
    whole.replace(file)


def read_kept(file: Path) -> Series:
    """The series that was kept in a file."""
    with np.load(file, allow_pickle=False) as stored:
        parts: dict[str, dict[str, Array]] = {"data": {}, "truth": {}}
        for name in stored.files:
            part, _, column = name.partition("_")
            if part in parts:
                parts[part][column] = stored[name].astype(np.float64)
        parts["data"]["t"] = stored["time"]
        return Series(parts["data"], parts["truth"], SurveyedRopes.of_table(stored["ropes"]))


def recorder(
    folder: Path | None, name: str, run: Callable[[Scenario], Series] = simulate
) -> Callable[[Scenario], Series]:
    """Simulates by `run`, or reads what a former run of that name left in the folder; None: nothing
    is kept.
    """
    if folder is None:
        return run
    file = folder / f"{name}.npz"

    def record(scenario: Scenario) -> Series:
        if not file.is_file():
            kept(run(scenario), file)
        return read_kept(file)

    return record
