"""A run's folder while it is written: scenario, rows, pictures, and at the end the summary; what
the recording says of the machine, and what only the truth knows of it.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from testbed.errors import InputError
from testbed.estimation.commissioning import zero_name
from testbed.formats.arrays import Array, Columns
from testbed.formats.files import check_space, plain, write_text
from testbed.formats.yaml_files import write_yaml, yaml_text
from testbed.machine.model import Machine
from testbed.machine.names import AXES
from testbed.recording.robot_columns import described
from testbed.robot.model import RobotModel
from testbed.scenario.scenario import Scenario
from testbed.simulation.pictures import Album
from testbed.simulation.recorder import RunRecorder, size_bytes, write_summary
from testbed.simulation.runs import open_run
from testbed.world.summary import surveyed

if TYPE_CHECKING:
    from testbed.world.simulation import Simulation


# `recording.yaml` of a run of the whole robot: what each column is, and what the robot believes
# about itself.


def recording_meta(
    scenario: Scenario, belief: Machine, data_columns: list[str], surveyed: Mapping[str, Any]
) -> dict[str, Any]:
    """The contents of `recording.yaml`; `surveyed`: what was measured before the run, such as where
    the ropes lead.

    Holds what the robot knows: no truth, no undeclared effect, no changed number of the world.
    """
    ranges = transducer_ranges_pa(belief)
    return {
        "format": "roboclimber-recording/1",
        "rig": "robot",
        "data": "data.parquet",
        "sample_rate_hz": scenario.rates.record_hz,
        "scenario": scenario.name,
        "description": scenario.description,
        "seed": scenario.seed,
        "task": scenario.task.kind,
        "channels": {column: _channel(column, ranges) for column in data_columns},
        "surveyed": dict(surveyed),
        "known": known(belief),
    }


def known(machine: Machine) -> dict[str, Any]:
    """Every number of the machine as the robot believes it: dotted path -> value and unit."""
    return {
        path: {
            "value": list(quantity.value) if isinstance(quantity.value, tuple) else quantity.value,
            "unit": quantity.unit,
        }
        for path, quantity in machine.leaves()
    }


def transducer_ranges_pa(machine: Machine) -> dict[str, list[float]]:
    """Lowest and highest reading of every pressure channel, Pa gauge, as its data sheet has it."""
    return {
        f"pressure_{chamber}_{axis}": [0.0, machine.axes[axis].sensor.pressure_range_pa]
        for axis in AXES
        for chamber in "ab"
    }


def _channel(column: str, ranges_pa: Mapping[str, list[float]]) -> dict[str, Any]:
    found = described(column)
    unit, *meaning = ("1",) if found is None else found
    out: dict[str, Any] = {"column": column, "unit": unit}
    if column in ranges_pa:
        out["range_pa"] = ranges_pa[column]
    return out | ({"meaning": meaning[0]} if meaning else {})


# `truth_machine.yaml`: the machine that a run drew, under the names by which `testbed commission`
# finds its numbers.

TRUTH_MACHINE = "truth_machine.yaml"
FORMAT = "roboclimber-truth-machine/1"
WEIGHED = ("total_mass_kg", "centre_of_mass_x_m", "centre_of_mass_y_m", "centre_of_mass_z_m")
"""What a machine weighs, load in the rod store included, and where; its joints in the middle of
their ranges.
"""


def truth_machine(scenario: Scenario, simulation: Simulation) -> dict[str, Any]:
    """Every drawn number, and what they make of the whole machine's weight."""
    world = simulation.machine
    masses = [world.hidden.cylinders[axis].mass_kg for axis in AXES]
    weighed = zip(
        WEIGHED, weigh(world.kinematics, np.array(masses)), ("kg", "m", "m", "m"), strict=True
    )
    return {
        "format": FORMAT,
        "draw": scenario.machine.draw,
        "seed": scenario.machine.seed,
        "numbers": {name: {"value": float(value), "unit": unit} for name, value, unit in weighed}
        | zero_forces(simulation)
        | simulation.machines.drawn.numbers,
    }


def zero_forces(simulation: Simulation) -> dict[str, Any]:
    """What both sensors' zeros of each cylinder make together, N: one foot in the air shows no
    more.
    """
    out = {}
    for axis in AXES:
        hidden = simulation.machine.hidden.cylinders[axis]
        area_a, area_b = simulation.machines.belief.axes[axis].cylinder.areas_m2
        force_n = area_a * hidden.zero_a_pa - area_b * hidden.zero_b_pa
        out[zero_name(axis)] = {"value": force_n, "unit": "N"}
    return out


def weigh(model: RobotModel, link_masses_kg: Array) -> tuple[float, ...]:
    """Total mass and centre of mass, body frame, with `link_masses_kg` (12) added at the centres of
    the axes' links.
    """
    joints = model.limits.mean(axis=1)
    total = model.total_mass_kg + float(np.sum(link_masses_kg))
    moment = model.total_mass_kg * model.centre_of_mass_m(joints)
    moment = moment + link_masses_kg @ model.link_centres_m(joints)
    return (total, *(moment / total).tolist())


LEAST_ROWS_A_PART, LONGEST_WAIT_S = 200, 5.0
"""A part is a simulated second of rows, but at least so many, for its head alone takes 100 kB; rows
that have waited for so long, s on the clock, are written anyhow.
"""


def spelt(scenario: Any) -> str:
    """A scenario with all its values, as its run's folder holds it."""
    return yaml_text(plain(scenario.model_dump(mode="json")))


class RunFolder:
    """Takes a Simulation's rows as they come, with pictures unless nobody is to look at them.
    Raises InputError where the disk has no room for the rows.
    """

    def __init__(self, folder: Path, simulation: Simulation, pictures: bool = True) -> None:
        scenario = simulation.scenario
        self.folder = folder
        self._columns = list(simulation.data_columns), list(simulation.truth_columns)
        rows = round(scenario.duration_s * scenario.rates.record_hz)
        check_space(folder, size_bytes(rows, self._columns))
        write_text(folder / "scenario.yaml", spelt(scenario))
        if scenario.machine.draw is not None:
            write_yaml(folder / TRUTH_MACHINE, truth_machine(scenario, simulation))
        meta = recording_meta(
            scenario, simulation.machines.belief, self._columns[0], surveyed(simulation)
        )
        copies = not simulation.has_window
        self._album = None
        if pictures:
            self._album = Album(folder, simulation.machine, scenario.duration_s, copies=copies)
        self._recorder = RunRecorder(folder, *self._columns, meta)
        self._rows_a_part = max(scenario.rates.record_hz, LEAST_ROWS_A_PART)
        self._waiting: list[tuple[Array, Array]] = []
        self._written_s = time.monotonic()
        if self._album is not None:
            self._album.take(0.0)

    def take(self, data: Array, truth: Array) -> None:
        """The next rows, and a picture where one is due."""
        self.keep(data, truth)
        waiting = sum(len(rows) for rows, _ in self._waiting)
        if waiting >= self._rows_a_part or time.monotonic() - self._written_s > LONGEST_WAIT_S:
            self._write()
        if len(truth) and self._album is not None:
            self._album.take(float(truth[-1, 0]))

    def take_last(self, now_s: float) -> None:
        """The large picture at the run's end."""
        if self._album is not None:
            self._album.take_large(now_s)

    def keep(self, data: Array, truth: Array) -> None:
        """The next rows, of which no picture is taken."""
        self._waiting.append((data, truth))

    def _write(self) -> None:
        """Hand the rows to the recorder, however small the pieces that they came in."""
        self._written_s = time.monotonic()
        if self._waiting:
            data, truth = (np.concatenate(tables) for tables in zip(*self._waiting, strict=True))
            self._waiting = []
            self._recorder.write(data, truth)

    def finish(self, summary: Callable[[InputError | None], dict[str, Any]]) -> None:
        """Make single files of the rows, and write the summary that is worked out then, told why
        rows are lost.

        Both are tried, even where the disk is too full for one, while the last picture is taken
        beside them; raises the first InputError.
        """
        lost = [*_failing(self._write), *_failing(self._recorder.close)]
        unjoined = _failing(self._recorder.finish)
        reason = lost[0] if lost else None
        unsaid = _failing(lambda: write_summary(self.folder, summary(reason)))
        untaken = _failing(self._album.finish) if self._album is not None else []
        for error in (*lost, *unjoined, *unsaid, *untaken):
            raise error

    def series(self) -> tuple[Columns, Columns]:
        """The recorded columns: data and truth."""
        run = open_run(self.folder)
        return run.data, run.truth


def _failing(step: Callable[[], object]) -> list[InputError]:
    """Why it could not be done; empty: it was."""
    try:
        step()
    except InputError as error:
        return [error]
    return []
