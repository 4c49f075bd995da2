"""`testbed estimate`: the external force of a recorded leg, or the foot loads of a recorded robot,
as a table.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from testbed.errors import InputError, naming
from testbed.formats.arrays import Array
from testbed.machine.names import LEGS, SIDES
from testbed.workflows.own_files import check_answer, header_of

if TYPE_CHECKING:
    from testbed.estimation.live.believed import Believed
    from testbed.estimation.live.own_tuning import OwnTuning
    from testbed.machine.model import Machine
    from testbed.recording.axis import Recording
    from testbed.recording.leg_model import LegModel
    from testbed.recording.robot import RobotHeader, RobotRecording
    from testbed.recording.survey import Surveyed
    from testbed.robot.robot import Robot
    from testbed.robot.rope_bearings import SurveyedRopes
    from testbed.world.believed_robot import BelievedRobot

SHIPPED = "own"
"""The estimate of a robot's feet that is written unless another is named."""
DRILLS = (None, "drill", "drill_hole")
"""Tasks of a recording in which the drill may push."""
BY_ITSELF = "each leg is estimated by itself, with wider intervals"
UNSURVEYED = f"no surveyed (rope_directions_in_world, payload_kg): {BY_ITSELF}"
UNKNOWN_THRUST = (
    f"no ordered_thrust, and surveyed does not say that nobody drills (drills: false): {BY_ITSELF}"
)


def estimate_file(
    recording: str | Path,
    model: str | Path | None,
    out: str | Path,
    causal: bool = False,
    estimator: str | None = None,
) -> dict[str, Any]:
    """Estimate a recording's force and write it to `out` (.parquet or .csv); returns what was
    written.

    One leg: `t`, `force_n`, `force_low_n`, `force_high_n`, one row a sample. The whole robot: `t`
    and `force_<leg>_n` with `_low` and `_high`; always causal, without `model` what the recording
    says the robot believes, and by `estimator` (a shipped one by name, or FILE.py:Class) instead of
    the whole-body estimate. `note`: what the recording lacks for a better estimate. Raises
    InputError for a recording, a model or a place that cannot be used; then nothing is written.
    """
    from testbed.formats.table import write_columns
    from testbed.recording.robot import read_robot_header

    folder = Path(recording)
    folder = folder.parent if folder.name == "recording.yaml" else folder
    out = check_answer(out, (".parquet", ".csv"))
    if is_robot(folder):
        columns = _of_robot(folder, model, estimator or SHIPPED)
    elif estimator is not None:
        raise InputError(
            "estimates the feet of a robot",
            field="--estimator",
            value=estimator,
            allowed="a robot's recording; a leg has its model file",
        )
    else:
        columns = _of_leg(folder, model, causal)
    write_columns(out, columns)
    lacks = lacks_of(read_robot_header(folder / "recording.yaml")) if is_robot(folder) else None
    return {
        "rows": len(columns["t"]),
        "columns": list(columns),
        "out": str(out),
        "note": None if lacks is None else f"{folder / 'recording.yaml'}: {lacks}",
    }


def is_robot(folder: Path) -> bool:
    """Whether a recording is one of the whole robot."""
    return header_of(folder).get("rig") == "robot"


def _of_leg(folder: Path, model: str | Path | None, causal: bool) -> Mapping[str, Array]:
    from testbed.estimation.leg.force import estimate
    from testbed.recording.axis import read_recording

    measured = read_recording(folder)
    if model is None:
        raise InputError(
            "is missing", field="--model", allowed="a model file, as `testbed identify` writes one"
        )
    return estimate(measured, _believed(measured, model), causal).columns()


def _believed(measured: Recording, model: str | Path) -> LegModel:
    """The model file, once it is known to serve this recording."""
    from testbed.effects import check_channels, read_believed
    from testbed.estimation.friction.evidence import check_alive, check_chambers

    believed = read_believed(model)
    check_chambers(measured)
    _check_serves(believed, measured, model)
    check_channels(believed, measured)
    check_alive(measured, moving=False)
    return believed


def leg_force(measured: Recording, model: str | Path | None) -> tuple[Array, float | None, str]:
    """External force (n,) of an axis, N, causal, the model's break-away force, N, and in words how
    it was had.

    Without a model friction is none and what is declared of the machine is believed. Raises
    InputError where that or the model does not serve.
    """
    from testbed.estimation.leg.force import estimate
    from testbed.recording.leg_model import LegModel

    if model is None:
        plain = LegModel(rig=measured.header.rig, known=measured.known)
        _check_serves(plain, measured, measured.folder / "recording.yaml")
        words = "what is declared, without friction (--model takes an identified one)"
        return estimate(measured, plain, causal=True).force_n, None, words
    believed = _believed(measured, model)
    force = estimate(measured, believed, causal=True).force_n
    return force, max(believed.friction.breakaway_n), f"the model {model}"


def _check_serves(model: LegModel, recording: Recording, file: str | Path) -> None:
    """Refuse a model of another kind of machine, or one that lacks a number which the recording's
    balance needs.
    """
    is_drive = recording.rig == "drive"
    # A model written by hand may omit its rig: then a piston tells.
    of_drive = (
        model.rig == "drive" if "rig" in model.model_fields_set else model.known.bore_m is None
    )
    if is_drive != of_drive and (is_drive or "rig" in model.model_fields_set):
        raise InputError(
            f"is a model of another kind of machine than {recording.folder}",
            file=file,
            field="rig",
            value=model.rig,
            allowed="drive" if is_drive else "vertical-leg, cylinder",
        )
    needed = {
        "bore_m": not is_drive,
        "rod_m": not is_drive and recording.pressure_b_pa is not None,
        "moving_mass_kg": recording.rig == "vertical-leg",
    }
    for name, needs in needed.items():
        if needs and getattr(model.known, name) is None:
            raise InputError(
                f"is missing: the balance of a {recording.rig} needs it",
                file=file,
                field=f"known.{name}",
            )


def _of_robot(folder: Path, model: str | Path | None, estimator: str) -> Mapping[str, Array]:
    from testbed.estimation.detectors.base import start
    from testbed.estimation.estimator import estimator_of, intervals_over
    from testbed.estimation.live.joined import forces, replay_rows
    from testbed.recording.robot import read_robot

    run = read_robot(folder)
    belief = robot_belief(run, model)
    if estimator == SHIPPED:
        with naming(run.file):
            return forces(run.data, belief)
    chosen = estimator_of(estimator, "--estimator")
    with naming(run.file):
        rows = replay_rows(run.data, belief)
    start(chosen, belief.dt_s)
    intervals = intervals_over(chosen, rows)
    out = {"t": np.asarray(run.data["t"])}
    for place, leg in enumerate(LEGS):
        for kind, ending in enumerate(("", "_low", "_high")):
            out[f"force_{leg}_n{ending}"] = np.ascontiguousarray(intervals[:, kind, place])
    return out


def robot_belief(run: RobotRecording, model: str | Path | None) -> Believed:
    """What the estimators believe of a recorded robot: the model file, else what the recording
    says.

    Where nobody knows what holds the body (`lacks_of`) nothing balances the feet: each leg is
    estimated by itself, from its three cylinders where they are recorded, else from the vertical
    one. Raises InputError for a model or a survey that cannot be understood.
    """
    from testbed.estimation.live.own_tuning import OwnTuning, unfelt
    from testbed.recording.checks import usual_step_s
    from testbed.recording.robot_columns import OF_JOINTS
    from testbed.world.believed_robot import believed_robot

    believed = believed_robot(run.machine, model, tolerances_of(run))
    belief = believed.legs(usual_step_s(run.data["t"]))
    if lacks_of(run.header) is None:
        felt = "specific_force_x" in run.data
        tuning = OwnTuning() if felt else unfelt(OwnTuning())
        return with_body(belief, believed, run.header.surveyed, run.file, tuning)
    if all(name in run.data for name in OF_JOINTS):
        return _with_unsurveyed_body(belief, believed)
    return belief


def lacks_of(header: RobotHeader) -> str | None:
    """Why a recorded robot's feet cannot be balanced against what holds its body; None: they
    can.
    """
    if header.surveyed is None:
        return UNSURVEYED
    may_drill = header.surveyed.drills and header.task in DRILLS
    return UNKNOWN_THRUST if may_drill and "ordered_thrust" not in header.channels else None


def tolerances_of(run: RobotRecording) -> str | None:
    """How far the recorded machine may be from what is believed; the workshop's tolerances where
    nothing is said.
    """
    from testbed.scenario.machines import WORKSHOP

    surveyed = run.header.surveyed
    return WORKSHOP if surveyed is None else surveyed.tolerances


def with_body(
    belief: Believed,
    believed: BelievedRobot,
    surveyed: object,
    file: Path,
    tuning: OwnTuning | None = None,
) -> Believed:
    """`belief` with the whole machine as `surveyed` before the run; `tuning`: None is the shipped
    one.

    Raises InputError where the survey cannot be understood.
    """
    from testbed.robot.model import Payload, RobotModel

    survey = survey_of(surveyed, file)
    store, mass_kg = believed.machine.rod_store_body, survey.payload_kg
    payload = Payload(mass_kg, store.position_m) if mass_kg > 0.0 else None
    if survey.ropes_sd_rad is not None:
        believed = believed.unsure_of_ropes(survey.ropes_sd_rad)
    with believed.bodies() as urdf:
        model = RobotModel(urdf, payload, survey.rope_height_m)
        return believed.with_body(belief, model, survey.ropes, tuning)


def _with_unsurveyed_body(belief: Believed, believed: BelievedRobot) -> Believed:
    """`belief` with the machine's legs as they hang on its body, whose weight and ropes nobody
    knows.
    """
    from testbed.estimation.live.own_tuning import OwnTuning, unsurveyed
    from testbed.robot.model import RobotModel
    from testbed.robot.rope_bearings import NO_ROPES

    with believed.bodies() as urdf:
        model = RobotModel(urdf)
        return believed.with_body(belief, model, NO_ROPES, unsurveyed(OwnTuning()))


@dataclass(frozen=True, eq=False)
class Survey:
    """What people measured of the place and the load before a run."""

    ropes_in_world: Array
    """Unit vectors (2, 3) towards the ropes' anchors."""
    payload_kg: float
    rope_height_m: float | None
    """Where the ropes are attached, body frame, m; None: where the URDF has them."""
    ropes_sd_rad: float | None
    """How far the directions may be off, either way; None: by the tolerances."""
    rope_stiffness_n_m: float | None = None
    """Of each rope as it hangs; None: nobody knows."""
    rope_lengths_m: Array | None = None
    """(2,) from the attachments to the anchors; None: nobody knows."""

    @property
    def ropes(self) -> SurveyedRopes:
        """The ropes, world frame."""
        from testbed.robot.rope_bearings import SurveyedRopes

        return SurveyedRopes.leading(self.ropes_in_world, self.rope_lengths_m)

    def robot(self, machine: Machine) -> Robot:
        """This machine as it was loaded and roped."""
        from testbed.robot.robot import Robot

        loaded = Robot.of(machine, self.payload_kg, self.rope_height_m)
        return replace(
            loaded,
            rope_stiffness_n_m=self.rope_stiffness_n_m,
            rope_lengths_m=self.rope_lengths_m,
        )


def survey_of(surveyed: object, file: Path) -> Survey:
    """What a recording's header says of the survey; one without `rope_attachment_height_m` has the
    URDF's.

    Raises InputError where there is none, or one that cannot be understood.
    """
    found = checked_survey(surveyed, file)
    directions = found.rope_directions_in_world
    ropes = np.array([getattr(directions, side) for side in SIDES])
    ropes /= np.linalg.norm(ropes, axis=1, keepdims=True)
    height_m, sd_rad = found.rope_attachment_height_m, found.rope_directions_sd_rad
    lengths = found.rope_lengths_m
    lengths_m = None if lengths is None else np.array([getattr(lengths, side) for side in SIDES])
    stiffness = found.rope_stiffness_n_m
    return Survey(ropes, found.payload_kg, height_m, sd_rad, stiffness, lengths_m)


def checked_survey(surveyed: object, file: Path) -> Surveyed:
    """The header's `surveyed`, checked. Raises InputError."""
    from testbed.formats.checked import Checked, checked
    from testbed.recording.survey import Surveyed

    class Header(Checked):
        surveyed: Surveyed

    if isinstance(surveyed, Surveyed):
        return surveyed
    if surveyed is None:
        allowed = ", ".join(Surveyed.model_fields)
        raise InputError("is missing", file=file, field="surveyed", allowed=allowed)
    return checked(Header, {"surveyed": surveyed}, file).surveyed
