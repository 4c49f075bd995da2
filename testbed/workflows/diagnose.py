"""One call for `testbed diagnose`: an axis' rig or a robot's run, findings, models and page
written.
"""

from __future__ import annotations

import json
from collections.abc import Callable, Iterable, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import TYPE_CHECKING, Any

from testbed.errors import InputError
from testbed.formats.files import check_file, owned, write_json, write_text

if TYPE_CHECKING:
    from testbed.diagnosis.robot.diagnose import RobotDiagnosis
    from testbed.diagnosis.robot.groups import Balances
    from testbed.formats.arrays import Array
    from testbed.recording.robot import RobotRecording
    from testbed.robot.robot import Robot


Table = tuple[list[str], list[list[str]]]
FINDINGS, PAGE = "findings.json", "report.html"


@dataclass(frozen=True)
class Diagnosed:
    """What a command shows of a diagnosis."""

    title: str
    tree: dict[str, Any]
    table: Table
    page: Path


@dataclass(frozen=True)
class Wanted:
    """What may be asked of a diagnosis beside its findings. `model`: file to start from; `suggest`:
    file for a motion that parts what cannot be distinguished; `also`: further recordings of
    the robot; `sound`: one from before, when nothing was wrong with it; `moved`: it stood elsewhere
    then.
    """

    model: Path | None = None
    suggest: Path | None = None
    also: tuple[Path, ...] = ()
    sound: Path | None = None
    moved: bool = False


def diagnose(
    folder: str | Path,
    out: str | Path,
    model: str | Path | None = None,
    also: str | Path | Sequence[str | Path] = (),
    sound: str | Path | None = None,
    moved: bool = False,
) -> Diagnosed:
    """Say which effect the machine recorded in `folder` has and its model lacks; `model`: one to
    start from.

    `folder` is an axis' rig (identify/ and verify/) or a robot's run, `also` a further run of the
    same robot or several, `sound` one from before, when nothing was wrong with it: what a model's
    effects stand for came after that; `moved`: the robot stood on other ground then. Into `out` go
    findings.json, the models (add `model.yaml` to a run by `simulate(.., model=..)`) and
    report.html; `.tree` of the answer is findings.json. Raises InputError for anything that cannot
    be used.
    """
    start, before = (None if path is None else Path(path) for path in (model, sound))
    others = (also,) if isinstance(also, str | Path) else also
    wanted = Wanted(start, also=tuple(map(Path, others)), sound=before, moved=moved)
    return diagnose_folder(Path(folder), Path(out), wanted)


def diagnose_folder(
    folder: Path, out: Path, wanted: Wanted, tell: Callable[[str], None] = lambda _: None
) -> Diagnosed:
    """Diagnose `folder` and write everything into `out`. Raises InputError for anything that cannot
    be used.
    """
    from testbed.workflows.estimate import is_robot

    folder = folder.parent if folder.name == "recording.yaml" else folder
    if wanted.moved and wanted.sound is None:
        raise InputError(
            "says where an earlier recording was made, and there is none",
            field="--moved",
            allowed="beside --sound",
        )
    kind = _robot if is_robot(folder) else _axis
    return kind(folder, out, wanted, tell)


def _axis(folder: Path, out: Path, wanted: Wanted, tell: Callable[[str], None]) -> Diagnosed:
    from testbed.diagnosis.leg.diagnose import diagnose
    from testbed.diagnosis.leg.experiments import write_motion
    from testbed.diagnosis.leg.findings import as_json, summary_rows, write_findings
    from testbed.effects import read_believed
    from testbed.recording.axis import RIG, read_rig
    from testbed.report.diagnosis_page import page

    suggest = wanted.suggest
    others = (*(("--also", path) for path in wanted.also), ("--sound", wanted.sound))
    for option, path in others:
        if path is not None:
            raise InputError(
                "is for a robot's run; a rig has all its recordings in one folder",
                field=option,
                value=str(path),
            )
    if suggest is not None:
        check_file(suggest, (".csv", ".parquet"), "--suggest", within=out)
    rig = read_rig(folder, f"{RIG}; or a robot's run")
    start = read_believed(wanted.model) if wanted.model is not None else None
    with owned(out):
        found = diagnose(rig, tell, start)
        write_findings(found, out)
        if suggest is not None:
            write_motion(suggest, rig.known)
        write_text(out / PAGE, page(found))
    return Diagnosed(
        f"{found.rig.name}: {found.verdict.kind}", as_json(found), summary_rows(found), out / PAGE
    )


def _robot(folder: Path, out: Path, wanted: Wanted, tell: Callable[[str], None]) -> Diagnosed:
    from testbed.diagnosis.robot.findings import as_json, summary_rows, write_findings
    from testbed.recording.robot_model import RobotModelFile, read_robot_model
    from testbed.report.robot_diagnosis_page import page
    from testbed.workflows.commission import check_each_once

    check_each_once((folder, *wanted.also))
    runs = _read_runs((folder, *wanted.also))
    before = None
    if wanted.sound is not None:
        before = Before(_read_runs([wanted.sound])[0], wanted.moved)
    believed = (
        RobotModelFile(drawing_mass_kg=runs[0].machine.total_mass_kg)
        if wanted.model is None
        else read_robot_model(wanted.model)
    )
    if wanted.suggest is not None:
        check_file(wanted.suggest, (".yaml",), "--suggest", within=out)
    with owned(out):
        found = diagnose_recordings(runs, wanted.model, before, tell)
        write_findings(found, believed, out)
        write_text(out / PAGE, page(found))
        tree = as_json(found)
        if wanted.suggest is not None:
            tree["next_motion"] = suggest_motion(found, folder, wanted.suggest, tell)
            write_json(out / FINDINGS, tree)
    return Diagnosed(f"{found.name}: {found.verdict.kind}", tree, summary_rows(found), out / PAGE)


def _read_runs(folders: Iterable[Path]) -> list[RobotRecording]:
    """Recordings that are weighed together. Raises InputError where that cannot be done."""
    from testbed.diagnosis.robot.diagnose import check_duration, check_memory
    from testbed.diagnosis.robot.rig import NEEDED
    from testbed.recording.robot import read_robot

    runs = [read_robot(folder, NEEDED) for folder in folders]
    files = [run.folder / run.header.data for run in runs]
    check_memory(
        (check_duration(run.data["t"], file), file) for run, file in zip(runs, files, strict=True)
    )
    return runs


@dataclass(frozen=True)
class Before:
    """An earlier recording of the robot, when nothing was wrong with it; `moved`: it stood on other
    ground then, whatever the surveys say.
    """

    run: RobotRecording
    moved: bool = False


def diagnose_recordings(
    runs: Sequence[RobotRecording],
    model: Path | None,
    sound: Before | None = None,
    tell: Callable[[str], None] = lambda _: None,
) -> RobotDiagnosis:
    """What one recording, or several together, show that the robot's model, with what a model file
    adds, lacks; `sound`: a recording of it from before, when nothing was wrong with it.

    Raises InputError for a model or a survey that cannot be understood.
    """
    from testbed.diagnosis.robot.diagnose import judged
    from testbed.diagnosis.robot.several_recordings import together
    from testbed.effects.base import MARK
    from testbed.recording.robot_model import read_robot_model

    believed = None if model is None else read_robot_model(model)
    entries = () if believed is None else believed.effects
    granted = {
        f"{entry.name}{MARK}{entry.place}": {
            name: parameter.value for name, parameter in entry.parameters.items()
        }
        for entry in entries
    }
    if sound is not None and believed is not None and believed.machine:
        raise InputError(
            "says the same twice beside a model with the machine's own numbers: both tell how it lies "
            "from its drawing",
            file=sound.run.file,
            field="--sound",
            allowed="one of the two",
        )
    if sound is not None and sound.run.machine.scale != runs[0].machine.scale:
        raise InputError("is of a machine of another size", file=sound.run.file, field="--sound")
    tell("holding the measurements against the machine")
    balances = [balances_of_run(run, model, granted, sound) for run in runs]
    tell("weighing hypotheses")
    return judged(runs[0].name, together(*balances), granted)


def balances_of_run(
    run: RobotRecording,
    model: Path | None,
    granted: dict[str, dict[str, float]],
    sound: Before | None = None,
) -> Balances:
    """A recording held against the machine as it believes itself to be; see diagnose_recordings."""
    from testbed.diagnosis.robot.groups import GROUND, raw_groups
    from testbed.diagnosis.robot.noise_levels import balances_at_level

    known = None if sound is None else raw_groups(*_measured(sound.run, model))[2]
    if known is not None and sound is not None and sound.moved:
        known.pop(GROUND, None)
    return balances_at_level(*_measured(run, model), granted, known)


def _measured(run: RobotRecording, model: Path | None) -> tuple[Mapping[str, Array], Robot, Array]:
    """A recording's columns, the robot as it believes itself to be, its surveyed ropes (2, 3)."""
    from testbed.workflows.estimate import survey_of
    from testbed.world.believed_robot import believed_robot

    survey = survey_of(run.header.surveyed, run.file)
    robot = survey.robot(believed_robot(run.machine, model).machine)
    return run.data, robot, survey.ropes_in_world


# The motion that a robot's diagnosis asks for where it cannot decide, as a scenario to run.

SECONDS = 16.0
"""How long a motion of the catalogue takes."""
AS_BELIEVED = ("undeclared=[]", 'machine={"draw": null}')
"""A rehearsal knows nothing of what the world hides."""
NOTHING_EXPECTED = ("expect={}", "mutation=null")
"""What the first motion was expected to do is nothing that the second must."""


def suggest_motion(
    found: RobotDiagnosis, run: Path, file: Path, tell: Callable[[str], None]
) -> dict[str, Any] | None:
    """Rehearse the catalogue of motions as the run in `run` stood, and write the scenario of the
    one that promises most into `file`; None, and no file, where nothing is to be parted. No file
    either where none of them would part the two: the text says what would.

    Raises InputError where the run has no scenario beside it.
    """
    from testbed.diagnosis.robot.hypotheses import Ledger
    from testbed.diagnosis.robot.motions import (
        instead_of_a_motion,
        made,
        motions_for,
        parted_sets,
        parting,
        promises,
        undecided,
    )
    from testbed.formats.yaml_files import yaml_text
    from testbed.scenario.scenario import load_scenario

    two, parted = undecided(found), parted_sets(found)
    if two is None:
        return None
    stood = run / "scenario.yaml"
    if not stood.is_file():
        raise InputError(
            "is not there: a motion is suggested as a change of it", file=stood, field="--suggest"
        )
    ways, rehearsed = {}, {}
    for motion in motions_for(parted):
        tell(f"rehearsing: {motion.text}")
        with suppress(InputError):  # from here it cannot make this one
            way, balances = made(motion, partial(_rehearsal, stood))
            ways[way.name], rehearsed[way.name] = way, balances
    promised = promises(Ledger(found.balances), parted, rehearsed)
    if not promised:
        raise InputError("no motion of the catalogue can be made from here", field="--suggest")
    sets_and_gains = {"parts": [list(names) for names in two], "promised": promised}
    best_first = parting(promised, parted)
    if not best_first:
        one, other, *_ = parted
        instead = instead_of_a_motion((one, other))
        tell(instead)
        return {**sets_and_gains, "motion": None, "text": instead}
    best = ways[best_first[0]]
    said = [f"description={json.dumps(best.text)}", *NOTHING_EXPECTED]
    scenario = load_scenario(stood, [*best.overrides(), *said], duration=SECONDS)
    write_text(file, yaml_text(json.loads(scenario.model_dump_json(exclude_defaults=True))))
    return {**sets_and_gains, "motion": best.name, "text": best.text}


def _rehearsal(stood: Path, overrides: list[str]) -> Balances:
    """The balances of a motion of the believed machine."""
    from testbed.diagnosis.robot.noise_levels import rehearsed_balances
    from testbed.recording.robot import read_robot
    from testbed.scenario.scenario import load_scenario
    from testbed.simulation.run import run_scenario

    scenario = load_scenario(stood, [*AS_BELIEVED, *overrides], duration=SECONDS)
    with TemporaryDirectory() as folder:
        run_scenario(scenario, Path(folder) / "run")
        return rehearsed_balances(*_measured(read_robot(Path(folder) / "run"), None))
