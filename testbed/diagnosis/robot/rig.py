"""A run of the whole robot as four recordings of like axes: each vertical cylinder with the load that it should feel.

The reference is the load that weight, posture, ropes and drill call for (the recording's `expected_<leg>`); it leaves
the internal load between the diagonals open, which `RobotProblem` takes out.
"""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path

import numpy as np
import numpy.typing as npt

from testbed.compiled import njit
from testbed.effects import by_name
from testbed.effects.base import Active
from testbed.errors import InputError
from testbed.estimation.live.believed import friction_of
from testbed.laws.valve import play
from testbed.machine.groups import Valve
from testbed.machine.model import Machine
from testbed.machine.names import LEGS
from testbed.recording.axis import Recording
from testbed.recording.axis_header import Header
from testbed.recording.known import HOLDINGS, Circuit, Known
from testbed.recording.leg_model import LegModel

Array = npt.NDArray[np.float64]
NEEDED = (
    "supply_pressure",
    *(name for leg in LEGS for name in (f"valve_{leg}_vertical", f"expected_{leg}")),
)
"""What a diagnosis needs beyond an estimate."""
CLIPPED = 0.998
"""Share of the transducers' range above which a reading may be clipped."""


def recordings_of(
    data: Mapping[str, Array], machine: Machine, folder: Path
) -> tuple[Recording, ...]:
    """One recording a leg (LEGS order), named by its axis. Raises InputError naming a column that is missing."""
    known = known_of(data, machine)
    return tuple(_recording(leg, data, known, machine, folder) for leg in LEGS)


def known_of(data: Mapping[str, Array], machine: Machine) -> Known:
    """What the machine declares about its vertical cylinders; supply and inclination as this run measured them."""
    c, valve, oil = machine.vertical_cylinder, machine.valve, machine.oil
    upright = np.cos(_column(data, "attitude_pitch", None)) * np.cos(
        _column(data, "attitude_roll", None)
    )
    return Known(
        bore_m=c.bore_m,
        rod_m=c.rod_m,
        stroke_m=c.stroke_m,
        moving_mass_kg=machine.legs.vertical_mass_kg + machine.legs.foot_mass_kg,
        inclination_deg=float(np.degrees(np.arccos(np.clip(np.median(upright), -1.0, 1.0)))),
        supply_pressure_nominal_pa=float(np.median(_column(data, "supply_pressure", None))),
        tank_pressure_pa=machine.power_unit.tank_pressure_pa,
        dead_volume_a_m3=c.dead_volume_a_m3,
        dead_volume_b_m3=c.dead_volume_b_m3,
        bulk_modulus_pa=oil.bulk_modulus_pa,
        internal_leakage_m3_s_pa=oil.internal_leakage_m3_s_pa,
        valve_rated_flow_m3_s=valve.rated_flow_vertical_m3_s,
        valve_rated_drop_per_edge_pa=valve.rated_drop_per_edge_pa,
        valve_natural_frequency_hz=valve.natural_frequency_hz,
        valve_damping=valve.damping,
        valve_deadband=valve.deadband,
        circuit=circuit_of(machine),
    )


def circuit_of(machine: Machine) -> Circuit:
    """Edges, holding valves and supply of the vertical cylinders as the machine declares them."""
    valve = machine.valve
    return Circuit(
        edge_pa=valve.edge_pa,
        edge_at=valve.edge_at,
        edge_pb=valve.edge_pb,
        edge_bt=valve.edge_bt,
        leakage_pa_m3_s_pa=valve.edge_pa_leakage_m3_s_pa,
        leakage_at_m3_s_pa=valve.edge_at_leakage_m3_s_pa,
        leakage_pb_m3_s_pa=valve.edge_pb_leakage_m3_s_pa,
        leakage_bt_m3_s_pa=valve.edge_bt_leakage_m3_s_pa,
        holding_a=HOLDINGS[int(valve.holding_a)],
        holding_b=HOLDINGS[int(valve.holding_b)],
        counterbalance_setting_pa=valve.counterbalance_setting_pa,
        counterbalance_pilot_ratio=valve.counterbalance_pilot_ratio,
        supply="constant" if machine.power_unit.supply_kind == 0.0 else "varying",
    )


def believed_model(known: Known, machine: Machine, start: LegModel | None = None) -> LegModel:
    """The model before: declared numbers and declared friction (5), or the friction of a model to start from."""
    if start is not None:
        return LegModel(rig="vertical-leg", known=known, friction=start.friction)
    friction = friction_of(machine.vertical_cylinder)
    return LegModel(rig="vertical-leg", known=known, friction=friction)


def granted_effects(model: LegModel) -> tuple[Active, ...]:
    """A model's effects, those of one leg at its vertical axis. Raises InputError for what no effect is."""
    out = []
    for entry in model.effects:
        place = f"{entry.place}_vertical" if entry.place in LEGS else entry.place
        effect = by_name(entry.name)
        effect = effect.at(place) if place else effect
        out.append(Active(effect, effect.complete(entry.values)))
    return tuple(out)


def through_amplifier(command: Array, time_s: Array, valve: Valve) -> Array:
    """What reaches the spool's loop of a command, shape (n,): the declared amplifier lag, then the declared play."""
    period = float(np.median(np.diff(time_s)))
    keep = float(np.exp(-period / valve.amplifier_lag_s))
    return np.asarray(_lag_and_play(command, keep, valve.hysteresis), dtype=np.float64)


@njit
def _lag_and_play(command: Array, keep: float, half_width: float) -> Array:
    out = np.empty_like(command)
    lagged, state = command[0], command[0]
    for i in range(len(command)):
        lagged = command[i] + (lagged - command[i]) * keep
        state = play(state, lagged, half_width)
        out[i] = state
    return out


def _recording(
    leg: str, data: Mapping[str, Array], known: Known, machine: Machine, folder: Path
) -> Recording:
    axis = f"{leg}_vertical"
    time = _column(data, "t", folder)
    varies = known.circuit is not None and known.circuit.supply == "varying"
    top = CLIPPED * machine.sensor.pressure_range_pa
    header = Header.model_validate(
        {
            "format": "roboclimber-recording/1",
            "rig": "vertical-leg",
            "data": "data.parquet",
            "sample_rate_hz": 1.0 / float(np.median(np.diff(time))),
            "channels": {
                "time": {"column": "t", "unit": "s"},
                "position": {
                    "column": f"position_{axis}",
                    "unit": "m",
                    "resolution": machine.sensor.encoder_linear_m,
                },
            },
            "known": known.model_dump(),
            "reference_force": {"kind": "load-cell", "column": f"expected_{leg}", "unit": "N"},
        }
    )
    a, b = _column(data, f"pressure_a_{axis}", folder), _column(data, f"pressure_b_{axis}", folder)
    return Recording(
        name=axis,
        folder=folder,
        header=header,
        time_s=time,
        position_m=_column(data, f"position_{axis}", folder),
        valve_command=through_amplifier(
            _column(data, f"valve_{axis}", folder), time, machine.axes[axis].valve
        ),
        pressure_a_pa=a,
        pressure_b_pa=b,
        supply_pressure_pa=_column(data, "supply_pressure", folder) if varies else None,
        oil_temperature_degc=data.get("oil_temperature"),
        actuator_force_n=None,
        reference_force_n=_column(data, f"expected_{leg}", folder),
        saturated_a=a > top,
        saturated_b=b > top,
    )


def _column(data: Mapping[str, Array], name: str, folder: Path | None) -> Array:
    if name not in data:
        raise InputError("the recording has no such column", file=folder, field=name)
    return data[name]
