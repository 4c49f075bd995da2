"""`testbed commission`: the robot moves as a crew would let it, and from that recording alone calibrates and weighs itself."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import numpy as np

from testbed.effects.robot_attitude import Attitude
from testbed.effects.robot_centre_of_mass import CentreOfMass
from testbed.effects.robot_payload import HiddenPayload
from testbed.effects.sensor_zero import ZeroA
from testbed.errors import InputError
from testbed.estimation.commissioning import Weighed, areas_m2, weigh_itself, zero_name
from testbed.formats.files import check_file
from testbed.machine.model import Machine
from testbed.machine.names import LEGS
from testbed.recording.leg_model import Parameter
from testbed.recording.robot_model import PlacedEffect, RobotModelFile, write_robot_model
from testbed.report.tables import Table
from testbed.robot.model import Payload, RobotModel

LONGEST_S = 600.0
BEYOND_FEET = (
    "sensor zeros of either chamber by itself",
    "gains of pressure sensors",
    "friction of radial and rotation cylinders",
    "rope directions, load pins, heights of the ropes' attachments",
)
"""What feet in the air and a body without ropes cannot show."""


def commission(recording: Path, out: str | Path) -> dict[str, Any]:
    """Weigh and calibrate from a recording of the programme; writes the model file and returns what was found.

    Raises InputError for a recording that cannot serve; then nothing is written.
    """
    from testbed.recording.robot import read_robot

    out = check_file(out, (".yaml", ".yml"))
    run = read_robot(recording)
    seconds = float(run.data["t"][-1] - run.data["t"][0])
    if seconds > LONGEST_S:
        raise InputError("is too long", file=recording, value=seconds, allowed=f"{LONGEST_S:g} s")
    survey = run.header.surveyed or {}
    carried_kg = float(survey.get("payload_kg", 0.0))
    store = run.machine.rod_store_body.position_m
    model = RobotModel(run.machine.urdf, Payload(carried_kg, store) if carried_kg > 0.0 else None)
    found = weigh_itself(_with_sideways(run, model), run.machine, model)
    write_robot_model(out, believed(found, run.machine, model, seconds))
    shown = {name: n.tree() for name, n in found.numbers.items() if n.shown}
    hidden = [name for name, n in found.numbers.items() if not n.shown]
    return {"numbers": shown, "not_shown": [*hidden, *BEYOND_FEET], "simulated_s": seconds}


def _with_sideways(run: Any, model: RobotModel) -> dict[str, Any]:
    """The recording's columns, and what the drawing-board belief makes of the feet's forces along x and y."""
    from testbed.estimation.live.chain import replay
    from testbed.world.believed import OwnBelief

    own = OwnBelief(run.machine)
    step_s = float(np.median(np.diff(run.data["t"])))
    estimated = replay(run.data, own.with_body(own.legs(step_s), model, np.zeros((2, 3))))
    sideways = [f"own_{k}_{leg}" for k in "xy" for leg in LEGS]
    return {**run.data, **{name: estimated[name] for name in sideways}}


def commission_any(
    given: str, out: str | Path, overrides: Sequence[str] = (), seed: int | None = None
) -> dict[str, Any]:
    """As `commission`, from a recording, or from a scenario that is run first on its (perhaps drawn) machine."""
    from testbed.scenario.scenario import load_scenario
    from testbed.simulation.run import run_scenario

    check_file(out, (".yaml", ".yml"))
    folder = Path(given).parent if Path(given).name == "recording.yaml" else Path(given)
    if (folder / "recording.yaml").is_file():
        if overrides or seed is not None:
            raise InputError("would have no effect on a recording", field="--set, --seed")
        return commission(folder, out)
    scenario = load_scenario(given, list(overrides), seed)
    if scenario.duration_s > LONGEST_S:
        raise InputError(
            "is too long",
            file=given,
            field="duration_s",
            value=scenario.duration_s,
            allowed=f"at most {LONGEST_S:g} s",
        )
    with TemporaryDirectory() as place:
        run_scenario(scenario, Path(place) / "run")
        return commission(Path(place) / "run", out)


def table(result: Mapping[str, Any]) -> Table:
    """What was found, for the console."""
    rows = [
        [name, f"{n['value']:.4g}", "{:.4g} to {:.4g}".format(*n["interval90"]), n["unit"]]
        for name, n in result["numbers"].items()
    ]
    title = f"Found in {result['simulated_s']:.0f} s of moving"
    return Table(title, ["number", "value", "90 % interval", "unit"], rows)


def believed(found: Weighed, machine: Machine, model: RobotModel, seconds: float) -> RobotModelFile:
    """What the robot is to believe: friction by path, zeros, weight and the inertial unit as effects."""
    numbers = found.numbers
    effects = [_effect(Attitude.kind, "body", _turned(found))]
    effects.append(
        _effect(HiddenPayload.kind, "body", {"mass": found.mass_kg, "x": 0.0, "y": 0.0, "z": 0.0})
    )
    shift = found.moment_kg_m / machine.body.mass_kg
    effects.append(
        _effect(CentreOfMass.kind, "body", dict(zip("xyz", shift.tolist(), strict=True)))
    )
    for leg in LEGS:
        axis = f"{leg}_vertical"
        area_a, _ = areas_m2(machine.axes[axis])
        zero_pa = numbers[zero_name(axis)].value / area_a
        effects.append(_effect(ZeroA.kind, axis, {"zero": zero_pa}))
    paths = {p: n for p, n in numbers.items() if p.startswith("axes.") and "zero_force" not in p}
    return RobotModelFile(
        description=f"found by the robot itself in {seconds:.0f} s of its commissioning programme",
        machine={
            path: Parameter(value=max(n.value, 0.0), unit=n.unit, interval90=n.tree()["interval90"])
            for path, n in paths.items()
        },
        effects=tuple(effects),
    )


def _turned(found: Weighed) -> dict[str, float]:
    return {
        name.rpartition(".")[2]: number.value
        for name, number in found.numbers.items()
        if name.startswith(Attitude.kind)
    }


def _effect(name: str, place: str, values: dict[str, float]) -> PlacedEffect:
    return PlacedEffect(
        name=name, place=place, parameters={k: Parameter(value=v) for k, v in values.items()}
    )
