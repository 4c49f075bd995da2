"""`testbed estimate`: the external force of a recorded leg, or the foot loads of a recorded robot, as a table."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
import numpy.typing as npt

from testbed.errors import InputError
from testbed.evaluation.runs import read_run
from testbed.parameters.names import SIDES
from testbed.parameters.provenance import Parameters, roboclimber
from testbed.parameters.yaml_files import read_yaml

if TYPE_CHECKING:
    from testbed.estimation.believed import Believed

Array = npt.NDArray[np.float64]


def estimate_file(
    recording: str | Path, model: str | Path | None, out: str | Path, causal: bool = False
) -> dict[str, Any]:
    """Estimate a recording's force and write it to `out` (.parquet or .csv); returns what was written.

    One leg: `t`, `force_n`, `force_low_n`, `force_high_n`, one row a sample. The whole robot: `t` and `force_<leg>_n`
    with `_low` and `_high`; always causal, and without `model` what the recording says the robot believes. Raises
    InputError for a recording, a model or a place that cannot be used; then nothing is written.
    """
    from testbed.parameters.table import write_columns

    folder = Path(recording)
    folder = folder.parent if folder.name == "recording.yaml" else folder
    out = Path(out)
    if out.suffix not in (".parquet", ".csv"):
        raise InputError("unknown ending", file=out, field="--out", allowed=".parquet, .csv")
    if not out.parent.is_dir():
        raise InputError("its folder does not exist", file=out, field="--out")
    columns = _of_robot(folder, model) if is_robot(folder) else _of_leg(folder, model, causal)
    write_columns(out, columns)
    return {"rows": len(columns["t"]), "columns": list(columns), "out": str(out)}


def is_robot(folder: Path) -> bool:
    """Whether a recording is one of the whole robot."""
    path = folder / "recording.yaml"
    meta = read_yaml(path) if path.is_file() else None
    return isinstance(meta, Mapping) and meta.get("rig") == "robot"


def _of_leg(folder: Path, model: str | Path | None, causal: bool) -> Mapping[str, Array]:
    from testbed.estimation.friction_evidence import check_alive
    from testbed.estimation.leg_force import estimate
    from testbed.parameters.leg_model import read_model
    from testbed.parameters.recording import read_recording

    if model is None:
        raise InputError("is missing", field="--model", allowed="a model file, as `testbed identify` writes one")
    believed, measured = read_model(model), read_recording(folder)
    check_alive(measured, moving=False)
    return estimate(measured, believed, causal).columns()


def _of_robot(folder: Path, model: str | Path | None) -> Mapping[str, Array]:
    from testbed.estimation.believed import Believed
    from testbed.estimation.chain import forces
    from testbed.parameters.leg_model import read_model

    file = folder / "recording.yaml"
    meta = read_yaml(file)
    machine = believed_machine(meta, file)
    run = read_run(folder, truth=False)
    dt_s = float(np.median(np.diff(run.time_s)))
    if model is None:
        belief = Believed.from_machine(machine, dt_s)
    else:
        belief = Believed.from_model(read_model(model), dt_s, machine["sensor"]["encoder_linear_m"])
    return forces(run.data, with_body(belief, machine, meta.get("surveyed"), file))


def with_body(belief: Believed, machine: Parameters, surveyed: object, file: Path) -> Believed:
    """`belief` with the whole machine as `surveyed` before the run; without a survey each leg stays by itself.

    Raises InputError where the survey cannot be understood.
    """
    from testbed import resources
    from testbed.estimation.body_belief import packed
    from testbed.robot.model import Payload, RobotModel

    if surveyed is None:
        return belief
    try:
        survey: Any = surveyed
        ropes = np.array([survey["rope_directions_in_world"][side] for side in SIDES], dtype=float).reshape(2, 3)
        mass_kg, urdf = float(survey["payload_kg"]), survey["urdf"] or resources.urdf()
    except (KeyError, TypeError, ValueError) as error:
        raise InputError(
            "cannot be understood", file=file, field="surveyed",
            allowed="rope_directions_in_world {left, right}, payload_kg, urdf",
        ) from error  # fmt: skip
    payload = Payload(mass_kg, machine["rod_store_body"]["position_m"]) if mass_kg > 0.0 else None
    return replace(belief, body=packed(machine, RobotModel(urdf, payload), belief.legs, belief.dt_s, ropes))


def believed_machine(meta: Mapping[str, Any], file: Path) -> Parameters:
    """The machine as the recording's `known` describes it. Raises InputError for a number that no machine has."""
    known = meta.get("known")
    machine = roboclimber()
    if not isinstance(known, Mapping):
        raise InputError("must map parameters to value and unit", file=file, field="known")
    values = dict(machine.leaves())
    changes: dict[str, Any] = {}
    for path, item in known.items():
        if path not in values or not isinstance(item, Mapping) or "value" not in item:
            raise InputError("is no parameter of the machine with its value", file=file, field=f"known.{path}")
        value = tuple(item["value"]) if isinstance(item["value"], list) else item["value"]
        if value != values[path].value:
            changes[path] = value
    return machine.replaced(changes)
