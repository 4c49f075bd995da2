"""A robot's encoders against what its valves let in: a dead one, one that is read in another unit,
and a valve's command that was not recorded for a while.

The believed machine says how far a valve's opening pushes its piston: rated flow times opening and
the root of the drop at the edge that lets oil in, over the piston's area. That errs by a third, for
the oil gives way and the spool answers late, and an encoder that is a thousand times too small
does not.
"""

from __future__ import annotations

import math
from collections.abc import Iterator

import numpy as np

from testbed.formats.arrays import Array
from testbed.machine.model import Axis
from testbed.recording.checker.command import ANSWERS_S, FEWEST
from testbed.recording.checker.finding import Finding
from testbed.recording.checker.raw import Raw, repetitions

SURELY_OPEN = 0.05
"""A valve lets oil in for certain from this command beyond its dead band on (E)."""
MUST_SHOW_M = 0.02
"""Way of a piston by its valve from which its encoder must have seen some of it (E)."""
FAR_LESS = 20.0
"""No valve lets in so many times what its piston makes room for (E)."""


def check_encoder_way(raw: Raw, name: str) -> Iterator[Finding]:
    """Whether the encoder of an axis goes as far as its valve pushes the piston, roughly."""
    needed = (f"valve_{name}", f"pressure_a_{name}", "supply_pressure")
    if raw.machine is None or any(key not in raw.series for key in needed):
        return
    axis, position = raw.machine.axes[name], raw.series[f"position_{name}"]
    pushed = pushed_m(raw, axis)
    if pushed < MUST_SHOW_M:
        return
    evidence = f"its valve pushes the piston by {pushed:.3g} m in all"
    if float(np.ptp(position)) == 0.0:
        yield Finding(
            "error",
            f"position_{name}",
            "never changes while its valve is open",
            f"{position[0]:.6g} in all {len(position)} rows; {evidence}",
            "the encoder is dead or not connected, or the valve is another axis'",
        )
        return
    gone = float(np.abs(np.diff(position)).sum())
    if axis.joint != "rotation" and gone < pushed / FAR_LESS:
        yield Finding(
            "error",
            f"position_{name}",
            "has another scale: it moves far less than its valve lets in",
            f"{gone:.3g} m; {evidence}",
            "declare unit m if the column is in it, or put the valve's channel right",
        )


def check_held_valve(raw: Raw, name: str) -> Iterator[Finding]:
    """The longest stretch of a slide's held command in which its piston goes far though the valve
    is shut, or against it.
    """
    command, position = raw.series.get(f"valve_{name}"), raw.series[f"position_{name}"]
    if command is None or raw.machine is None or raw.machine.axes[name].joint == "rotation":
        return
    first, length = repetitions(command)
    answered = round(ANSWERS_S / float(np.median(np.diff(raw.time_s))))
    deadband = raw.machine.axes[name].valve.deadband
    for index in np.argsort(-length):
        start, stop = int(first[index]) + answered, int(first[index] + length[index])
        if stop - start < FEWEST:
            return
        held, place = float(command[start]), position[start:stop]
        against = abs(held) > deadband + SURELY_OPEN
        gone = -np.sign(held) * (place[-1] - place[0]) if against else np.ptp(place)
        if gone > MUST_SHOW_M and (against or abs(held) < deadband):
            how = "against it" if against else "though that shuts the valve"
            yield Finding(
                "error",
                f"valve_{name}",
                "stays at one value while the piston goes far",
                f"{held:.4g} while the piston goes {gone:.3g} m {how}",
                "the command was not recorded there: cut this stretch out",
                float(raw.time_s[start]),
                float(raw.time_s[stop - 1]),
            )
            return


def pushed_m(raw: Raw, axis: Axis) -> float:
    """Way out and in, m, by which the valve of an axis pushes its piston in all, while it is surely
    open.
    """
    valve, command = axis.valve, raw.series[f"valve_{axis.name}"]
    pressure = raw.series[f"pressure_a_{axis.name}"]
    beyond = np.abs(command) - valve.deadband
    opening = np.where(beyond > SURELY_OPEN, beyond, 0.0) / (1.0 - valve.deadband)
    drop = np.where(command > 0.0, raw.series["supply_pressure"] - pressure, pressure)
    flow: Array = axis.rated_flow_m3_s * opening
    flow = flow * np.sqrt(np.maximum(drop, 0.0) / valve.rated_drop_per_edge_pa)
    area_m2 = math.pi / 4.0 * axis.cylinder.bore_m**2
    return float(np.sum(flow[:-1] * np.diff(raw.time_s))) / area_m2
