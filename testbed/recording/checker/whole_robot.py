"""A robot's recording: each axis by itself, each leg against the load that control expects."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace

import numpy as np

from testbed.machine.names import AXES, LEGS
from testbed.recording.checker.balance import check_balance
from testbed.recording.checker.encoder_way import check_encoder_way, check_held_valve
from testbed.recording.checker.finding import Finding
from testbed.recording.checker.flow import check_flow
from testbed.recording.checker.forces import Forces
from testbed.recording.checker.inertial import check_inertial, upright
from testbed.recording.checker.motion import even
from testbed.recording.checker.raw import Raw
from testbed.recording.checker.supply import check_idle_supply, check_pressures
from testbed.recording.checks import MINIMUM_SAMPLES
from testbed.recording.known import Known

FAR_BEYOND = 2.0
"""Strokes beyond which no encoder's zero explains a robot's position."""
SHORTEST_M = -0.02
"""A robot's cylinder whose encoder reads less is turned round; a zero is seldom off by so much."""
EXPECTED = 0.33, 3.0
"""Shares of the load that control expects which a sound foot may bear for long: four stiff legs
load each other across their diagonals.
"""


def check_robot(raw: Raw) -> Iterator[Finding]:
    """Each of the twelve axes against supply and valve, the four vertical ones against the load
    that control expects, and the inertial unit against gravity.
    """
    supply = list(check_idle_supply(raw))
    yield from supply
    if supply:  # nothing can be measured by it
        rest = {name: v for name, v in raw.series.items() if name != "supply_pressure"}
        raw = replace(raw, series=rest)
    for axis in AXES:
        yield from _robot_axis(raw, axis)
    standing = raw.kept(upright(raw), {})
    if len(standing.time_s) >= MINIMUM_SAMPLES:
        for leg in LEGS:
            yield from _robot_leg(standing, leg)
    yield from check_inertial(raw)


def _robot_axis(raw: Raw, axis: str) -> Iterator[Finding]:
    position = f"position_{axis}"
    yield from check_pressures(raw, Known(), f"pressure_a_{axis}", f"pressure_b_{axis}")
    if position not in raw.series:
        return
    lowest = float(raw.series[position].min())
    if not axis.endswith("_rotation") and lowest < SHORTEST_M:
        yield Finding(
            "error",
            position,
            "is below the cylinder's end",
            f"down to {lowest:.4g} m",
            "turn its sign, or put its zero right: extension from the retracted end",
        )
    slides = raw.machine is not None and not axis.endswith("_rotation")
    travel = raw.machine.axes[axis].travel_m if slides and raw.machine else 0.0
    highest = float(np.max(np.abs(raw.series[position])))
    if highest > FAR_BEYOND * travel > 0.0:
        yield Finding(
            "error",
            position,
            "is beyond the cylinder's end",
            f"up to {highest:.4g} m, stroke {travel:g} m",
            "declare unit mm if the column is in it, or put its zero right",
        )
        return
    yield from check_encoder_way(raw, axis)
    yield from check_held_valve(raw, axis)
    if f"valve_{axis}" in raw.series:
        moved = even(raw, {"command": f"valve_{axis}"}, position)
        yield from check_flow(moved, Known(), f"valve_{axis}")


def _robot_leg(raw: Raw, leg: str) -> Iterator[Finding]:
    names = {
        "pressure_a": f"pressure_a_{leg}_vertical",
        "pressure_b": f"pressure_b_{leg}_vertical",
        "reference": f"expected_{leg}",
        "position": f"position_{leg}_vertical",
    }
    if not raw.series.keys() >= set(names.values()) or raw.machine is None:
        return
    cylinder = raw.machine.vertical_cylinder
    known = Known(bore_m=cylinder.bore_m, rod_m=cylinder.rod_m, moving_mass_kg=0.0)
    chosen = {name: key for name, key in names.items() if name != "position"}
    forces = Forces(even(raw, chosen, names["position"]), known)
    missing, _, _ = forces.left_over({})
    held = max(cylinder.coulomb_out_n, cylinder.coulomb_in_n)
    held += max(cylinder.static_out_n, cylinder.static_in_n)
    if np.sqrt(np.mean(missing**2)) < held:
        return  # seals at rest may hold as much
    for finding in check_balance(forces, names, EXPECTED, exact=False):
        if finding.channel == "force balance":
            advice = "a sensor, or a foot that hangs or shares its load otherwise than expected"
            yield replace(finding, channel=f"force balance of {leg}", advice=advice)
        elif finding.channel != names["position"]:
            # the expected load is too rough to tell friction's sign
            yield finding
