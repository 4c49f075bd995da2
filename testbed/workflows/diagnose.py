"""One call for `testbed diagnose`: an axis' rig or a robot's run, findings, models and page
written.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

from testbed.errors import InputError
from testbed.formats.files import check_file, write_text
from testbed.formats.ownership import owned

if TYPE_CHECKING:
    from testbed.diagnosis.robot.diagnose import RobotDiagnosis
    from testbed.recording.robot import RobotRecording

Table = tuple[list[str], list[list[str]]]
PAGE = "report.html"


@dataclass(frozen=True)
class Diagnosed:
    """What a command shows of a diagnosis."""

    title: str
    tree: dict[str, Any]
    table: Table
    page: Path


def diagnose(folder: str | Path, out: str | Path, model: str | Path | None = None) -> Diagnosed:
    """Say which effect the machine recorded in `folder` has and its model lacks; `model`: one to
    start from.

    `folder` is an axis' rig (identify/ and verify/) or a robot's run. Into `out` go findings.json,
    the models (add `model.yaml` to a run by `simulate(.., model=..)`) and report.html; `.tree` of
    the answer is findings.json. Raises InputError for anything that cannot be used.
    """
    start = None if model is None else Path(model)
    return diagnose_folder(Path(folder), Path(out), start, None, lambda _: None)


def diagnose_folder(
    folder: Path, out: Path, model: Path | None, suggest: Path | None, tell: Callable[[str], None]
) -> Diagnosed:
    """Diagnose `folder` and write everything into `out`. Raises InputError for anything that cannot
    be used.
    """
    from testbed.workflows.estimate import is_robot

    folder = folder.parent if folder.name == "recording.yaml" else folder
    return (
        _robot(folder, out, model, suggest, tell)
        if is_robot(folder)
        else _axis(folder, out, model, suggest, tell)
    )


def _axis(
    folder: Path, out: Path, model: Path | None, suggest: Path | None, tell: Callable[[str], None]
) -> Diagnosed:
    from testbed.diagnosis.leg.diagnose import diagnose
    from testbed.diagnosis.leg.experiments import write_motion
    from testbed.diagnosis.leg.findings import as_json, summary_rows, write_findings
    from testbed.effects import read_believed
    from testbed.recording.axis import read_rig
    from testbed.report.diagnosis_page import page

    if suggest is not None:
        check_file(suggest, (".csv", ".parquet"), "--suggest", within=out)
    rig = read_rig(folder)
    start = read_believed(model) if model is not None else None
    with owned(out):
        found = diagnose(rig, tell, start)
        write_findings(found, out)
        if suggest is not None:
            write_motion(suggest, rig.known)
        write_text(out / PAGE, page(found))
    return Diagnosed(
        f"{found.rig.name}: {found.verdict.kind}", as_json(found), summary_rows(found), out / PAGE
    )


def _robot(
    folder: Path, out: Path, model: Path | None, suggest: Path | None, tell: Callable[[str], None]
) -> Diagnosed:
    from testbed.diagnosis.robot.diagnose import check_duration
    from testbed.diagnosis.robot.findings import as_json, summary_rows, write_findings
    from testbed.diagnosis.robot.rig import NEEDED
    from testbed.recording.robot import read_robot
    from testbed.recording.robot_model import RobotModelFile, read_robot_model
    from testbed.report.robot_diagnosis_page import page

    if suggest is not None:
        raise InputError(
            "is for one axis; of a robot's run, let the body sway",
            field="--suggest",
            value=str(suggest),
        )
    run = read_robot(folder, NEEDED)
    check_duration(run.data["t"], run.folder / run.header.data)
    believed = RobotModelFile() if model is None else read_robot_model(model)
    with owned(out):
        found = diagnose_recording(run, model, tell)
        write_findings(found, believed, out)
        write_text(out / PAGE, page(found))
    return Diagnosed(
        f"{found.name}: {found.verdict.kind}", as_json(found), summary_rows(found), out / PAGE
    )


def diagnose_recording(
    run: RobotRecording, model: Path | None, tell: Callable[[str], None] | None = None
) -> RobotDiagnosis:
    """What a recording shows that the robot's model, with what a model file adds, lacks.

    Raises InputError for a model or a survey that cannot be understood.
    """
    from testbed.diagnosis.robot.diagnose import diagnose_robot
    from testbed.effects.base import MARK
    from testbed.recording.robot_model import read_robot_model
    from testbed.robot.robot import Robot
    from testbed.workflows.estimate import survey_of
    from testbed.world.believed import own_belief

    ropes, carried_kg = survey_of(run.header.surveyed, run.file)
    believed = own_belief(run.machine, model)
    entries = () if model is None else read_robot_model(model).effects
    granted = {
        f"{entry.name}{MARK}{entry.place}": {
            name: parameter.value for name, parameter in entry.parameters.items()
        }
        for entry in entries
    }
    robot = Robot.of(believed.machine, carried_kg)
    return diagnose_robot(run.name, run.data, robot, ropes, granted, tell)
