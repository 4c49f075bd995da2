"""`testbed commission`: the robot moves as a crew would let it, and from the recordings alone
calibrates and weighs itself.

Two stages: on level ground without ropes (feet in the air, the body up, down and to the sides),
then on a slope on its ropes. What the first one found is what the second one believes.
"""

from __future__ import annotations

import shutil
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import TYPE_CHECKING, Any

import numpy as np

from testbed.diagnosis.robot.commissioning import (
    Evidence,
    evidence_of,
    levelled,
    lifts_every_foot,
    weighed,
)
from testbed.effects.robot_attitude import Attitude
from testbed.effects.robot_centre_of_mass import CentreOfMass
from testbed.effects.robot_payload import HiddenPayload
from testbed.effects.rope_attachment import RopeAttachment
from testbed.effects.rope_direction import RopeDirection
from testbed.effects.rope_tension_gain import TensionGain
from testbed.effects.sensor_zero import ZeroA
from testbed.errors import InputError
from testbed.estimation.commissioning import Number, Weighed
from testbed.formats.files import owned, write_text
from testbed.formats.intervals import rounded, unit_name
from testbed.machine.model import Machine
from testbed.machine.names import SIDES
from testbed.recording.leg_model import Parameter
from testbed.recording.robot_model import PlacedEffect, RobotModelFile, write_robot_model
from testbed.report.page import Table, render
from testbed.robot.robot import Robot
from testbed.workflows.estimate import survey_of
from testbed.workflows.own_files import check_answer

if TYPE_CHECKING:
    from testbed.recording.robot import RobotRecording
    from testbed.scenario.scenario import Scenario

LONGEST_S = 600.0
"""Of all recordings of a commissioning together."""
ROPES_STAGE = "commissioning_slope"
"""The second stage of a commissioning that is given as a scenario on level ground."""
ROPES_PULL_AT = {f"traction_{side}" for side in SIDES}
"""Links that a machine without ropes lacks."""
NEVER_SHOWN = (
    "zeros of either chamber's sensor by itself",
    "bows and hystereses of pressure sensors",
)
"""What neither stage can show."""
OF_THE_ROPES = ("rope directions", "load pins", "heights of the ropes' attachments")
"""What level ground cannot show."""


def commission(recordings: Sequence[Path], out: str | Path) -> dict[str, Any]:
    """Calibrate and weigh from recordings of the programme; writes the model file and returns what
    was found.

    The first recording is of level ground, a second one of the ropes. Raises InputError for
    recordings that cannot serve; then nothing is written.
    """
    from testbed.diagnosis.robot.diagnose import check_duration
    from testbed.recording.robot import read_robot

    out = check_answer(out, (".yaml", ".yml"))
    check_each_once(recordings)
    runs = [read_robot(folder) for folder in recordings]
    for run in runs:
        check_duration(run.data["t"], run.file)
    seconds = sum(float(run.data["t"][-1] - run.data["t"][0]) for run in runs)
    if seconds > LONGEST_S:
        raise InputError("is too long", file=out, value=seconds, allowed=f"{LONGEST_S:g} s in all")
    found = weighed(list(_evidence(runs)), _robot(runs[0]))
    numbers, file = found.numbers, believed(found, runs[0].machine, seconds)
    write_robot_model(out, file)
    hidden = [name for name, n in numbers.items() if not n.shown]
    never = NEVER_SHOWN if len(runs) > 1 else (*NEVER_SHOWN, *OF_THE_ROPES)
    result = {
        "numbers": {name: n.tree() for name, n in numbers.items() if n.shown},
        "not_shown": [*hidden, *never],
        "simulated_s": seconds,
    }
    write_text(out.with_suffix(".html"), page(numbers, result))
    return result


def check_each_once(recordings: Sequence[Path]) -> None:
    """Raises InputError where a recording is given twice: it would count as two witnesses of the
    same.
    """
    seen: set[Path] = set()
    for folder in recordings:
        if folder.resolve() in seen:
            raise InputError("is given twice", file=folder, allowed="each recording once")
        seen.add(folder.resolve())


def page(numbers: Mapping[str, Number], result: Mapping[str, Any]) -> str:
    """Before and after as a page: each number, its intervals, and what the motion could not
    show.
    """
    rows = []
    for name, n in numbers.items():
        if not n.shown:
            continue
        known = n.before90()
        before = "" if known is None else " to ".join(rounded(n.value, known)[1:])
        value, low, high = rounded(n.value, n.interval90)
        share = "" if n.before is None else f"{100.0 * n.sd / n.before[1]:.0f} %"
        rows.append([name, unit_name(n.unit), before, value, f"{low} to {high}", share])
    contents = {"rows": rows, "hidden": result["not_shown"], "seconds": result["simulated_s"]}
    return render("commission.html.j2", contents)


def _robot(run: RobotRecording) -> Robot:
    """The drawing-board robot with what was loaded; its ropes lead as at the start of a recording,
    under which the weighing's intervals were found.
    """
    robot = survey_of(run.header.surveyed, run.file).robot(run.machine)
    return replace(robot, rope_lengths_m=None)


def _evidence(runs: Sequence[RobotRecording]) -> Iterator[Evidence]:
    """What the recordings say, the first of level ground, others of the ropes."""
    for run in runs:
        robot = _robot(run)
        ropes = survey_of(run.header.surveyed, run.file).ropes_in_world
        if run is runs[0]:
            if not lifts_every_foot(run.data, robot):
                raise InputError(
                    "shows no foot in the air",
                    file=run.file,
                    field="carrying",
                    allowed="the programme of commissioning_flat: every foot lifted by 2 cm and more",
                )
            yield levelled(run.data, robot)
        elif not any(np.any(run.data.get(f"rope_tension_{side}", 0.0)) for side in SIDES):
            raise InputError(
                "shows no rope that pulls",
                file=run.file,
                allowed="a recording of the ropes' programme",
            )
        yield evidence_of(run.data, robot, ropes)


def commission_any(
    given: Sequence[str], out: str | Path, overrides: Sequence[str] = (), seed: int | None = None
) -> dict[str, Any]:
    """As `commission`, from recordings, or from a scenario that is run first on its (perhaps drawn)
    machine.
    """
    check_answer(out, (".yaml", ".yml"))
    folders = [Path(g).parent if Path(g).name == "recording.yaml" else Path(g) for g in given]
    if all(map(_recorded, folders)):
        if overrides or seed is not None:
            raise InputError("would have no effect on a recording", field="--set, --seed")
        return commission(folders, out)
    if len(given) > 1:
        first = next(name for name, at in zip(given, folders, strict=True) if not _recorded(at))
        raise InputError("is no recording", file=first, allowed="recordings, or one scenario")
    with recorded(given[0], overrides, seed, stages_of(Path(out))) as runs:
        try:
            return commission(runs, out)
        except InputError as error:  # nobody knows the folders in which its stages were recorded
            if error.file is None or stages_of(Path(out)) not in Path(error.file).parents:
                raise
            raise InputError(
                error.problem,
                file=given[0],
                field=error.field,
                value=error.value,
                allowed=error.allowed,
            ) from error


def _recorded(folder: Path) -> bool:
    return (folder / "recording.yaml").is_file()


def stages_of(out: Path) -> Path:
    """Where a commissioning keeps its stages until its model file is written: killed, it goes on
    with those that it finds there.
    """
    return out.with_name(f".{out.name}.stages")


@contextmanager
def recorded(
    name: str, overrides: Sequence[str] = (), seed: int | None = None, place: Path | None = None
) -> Iterator[list[Path]]:
    """Recordings of a scenario's programme and, where it is on level ground and the machine has
    ropes, of theirs, for as long as needed.

    `place`: folder for them, gone at the end; what a killed process has finished there is taken
    over. None: a temporary one. Raises OccupiedError where another process is at work there.
    """
    scenarios = stages(name, overrides, seed)
    seconds = sum(scenario.duration_s for scenario in scenarios)
    if seconds > LONGEST_S:
        allowed = f"at most {LONGEST_S:g} s in all"
        raise InputError(
            "is too long", file=name, field="duration_s", value=seconds, allowed=allowed
        )
    with _folder(place) as held:
        folders = [held / str(k) for k in range(len(scenarios))]
        for scenario, folder in zip(scenarios, folders, strict=True):
            _record(scenario, folder)
        yield folders


def stages(name: str, overrides: Sequence[str] = (), seed: int | None = None) -> list[Scenario]:
    """A scenario's programme and, where it is on level ground and the machine has ropes, theirs."""
    from testbed.scenario.scenario import lacks, load_scenario

    first = load_scenario(name, list(overrides), seed)
    if first.ropes.enabled or lacks(first) & ROPES_PULL_AT:
        return [first]
    return [first, _on_ropes(first)]


@contextmanager
def _folder(place: Path | None) -> Iterator[Path]:
    """A folder of one's own, gone once its work is done or cannot be."""
    if place is None:
        with TemporaryDirectory() as made:
            yield Path(made)
        return
    with owned(place):
        try:
            yield place
        except InputError:
            shutil.rmtree(place)
            raise
        shutil.rmtree(place)


def _record(scenario: Scenario, folder: Path) -> None:
    """Run a stage, unless the folder holds all of this very run."""
    from testbed.simulation.run import run_scenario
    from testbed.simulation.sweep import holds_run

    if not holds_run(folder, scenario) and run_scenario(scenario, folder).interrupted:
        raise KeyboardInterrupt


def _on_ropes(level: Scenario) -> Scenario:
    """The second stage of the machine of the first."""
    from testbed.scenario.scenario import load_scenario

    slope = load_scenario(ROPES_STAGE, seed=level.seed)
    same = ("machine", "model", "hydraulics", "sensors", "undeclared", "estimator", "rates")
    return slope.model_copy(update={name: getattr(level, name) for name in same})


def table(result: Mapping[str, Any]) -> Table:
    """What was found, for the console."""
    rows = []
    for name, n in result["numbers"].items():
        value, low, high = rounded(n["value"], n["interval90"])
        rows.append([name, value, f"{low} to {high}", n["unit"]])
    title = f"Found in {result['simulated_s']:.0f} s of moving"
    return Table(title, ["number", "value", "90 % interval", "unit"], rows)


def believed(found: Weighed, machine: Machine, seconds: float) -> RobotModelFile:
    """What the robot is to believe of what was shown: friction by path; zeros, weight, the inertial
    unit and the ropes as effects.
    """
    numbers = {name: n for name, n in found.numbers.items() if n.shown}
    total, body_kg = found.numbers["total_mass_kg"], machine.body.mass_kg
    whole = {
        f"{HiddenPayload.kind}@body.mass": Number(found.mass_kg, "kg", total.sd),
        **{f"{HiddenPayload.kind}@body.{k}": Number(0.0, "m", 0.0) for k in "xyz"},
    }
    for k, axis in enumerate("xyz"):
        spread = found.numbers[f"centre_of_mass_{axis}_m"].sd * total.value / body_kg
        shift = float(found.moment_kg_m[k]) / body_kg
        whole[f"{CentreOfMass.kind}@body.{axis}"] = Number(shift, "m", spread)
    for axis, force in found.zeros.items():
        area_a, _ = machine.axes[axis].cylinder.areas_m2
        zero = Number(force.value / area_a, "Pa", force.sd / area_a)
        whole[f"{ZeroA.kind}@{axis}.zero"] = zero
    entries = {name.rpartition(".")[0] for name in numbers if name.partition("@")[0] in LIVE}
    live = {name: n for name, n in found.numbers.items() if name.rpartition(".")[0] in entries}
    paths = {p: n for p, n in numbers.items() if p.startswith("axes.") and "zero_force" not in p}
    return RobotModelFile(
        description=f"found by the robot itself in {seconds:.0f} s of its commissioning programme",
        drawing_mass_kg=machine.total_mass_kg,
        machine={
            path: Parameter(value=_possible(path, n.value), unit=n.unit, interval90=n.interval90)
            for path, n in paths.items()
        },
        effects=tuple(_effects(live | whole)),
    )


LIVE = (
    Attitude.kind,
    RopeDirection.kind,
    RopeAttachment.kind,
    TensionGain.kind,
)
"""Effects that the robot believes as they were found: all numbers of one that shows any."""


def _possible(path: str, value: float) -> float:
    """A slope has either sign, friction has one."""
    return value if path.endswith("slope") else max(value, 0.0)


def _effects(numbers: Mapping[str, Number]) -> Iterator[PlacedEffect]:
    """Numbers named effect@place.parameter as entries of a model file."""
    entries: dict[tuple[str, str], dict[str, Parameter]] = {}
    for name, n in numbers.items():
        effect, _, rest = name.partition("@")
        place, _, parameter = rest.partition(".")
        value = Parameter(value=n.value, unit=n.unit, interval90=n.interval90)
        entries.setdefault((effect, place), {})[parameter] = value
    for (effect, place), parameters in entries.items():
        yield PlacedEffect(name=effect, place=place, parameters=parameters)
