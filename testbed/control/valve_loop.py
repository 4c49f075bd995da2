"""Twelve position loops: encoder -> valve command, compiled.

u = dead-band compensation of [ k_p e + k_f x_ref' / v_max + k_i integral(e) ], |u| <= 1, with e in
metres of cylinder. Within `tolerance` of the set point and with a set point at rest the valve is
closed: it would only hunt over one encoder count. Gains assumed; the machine had digital PIDs whose
numbers are not published.
"""

from __future__ import annotations

from typing import Any

from numpy.typing import NDArray

from testbed.compiled import njit
from testbed.formats.arrays import Array
from testbed.formats.records import Record, quantity
from testbed.machine.model import Machine
from testbed.machine.names import AXES


class LoopGains(Record):
    """Numbers of a position loop, for joint coordinates (rotation: rad in the place of m)."""

    proportional = quantity("1/m", "command by the position's error")
    integral_gain = quantity("1/(m s)", "command by the error's integral")
    feedforward = quantity("s/m", "command by the set point's rate")
    deadband = quantity("1", "command that takes the spool across its dead band")
    tolerance = quantity("m", "error at which a valve at rest closes")
    limit = quantity("1", "greatest command")
    integral_limit = quantity("1", "greatest part of the command by the integral")


class PositionLoop(LoopGains):
    """A position loop at work."""

    reference = quantity("m", "set point (rotation: rad)")
    reference_rate = quantity("m/s", "its rate (rotation: rad/s)")
    integral = quantity("1", "command by the error's integral so far")


def position_loops(machine: Machine, arms: Array) -> NDArray[Any]:
    """PositionLoop (12,) at rest; joints' rad or m are turned into cylinder metres by `arms` (12,),
    m/rad or 1.
    """
    control = machine.control
    loops = PositionLoop.zeros(len(AXES))
    for loop, axis, scale in zip(loops, machine.axes.values(), arms, strict=True):
        speed = axis.rated_flow_m3_s / axis.cylinder.areas_m2[0]
        loop["proportional"] = control.loop_gain_1_s / speed * scale
        loop["integral_gain"] = control.integral_gain_1_s2 / speed * scale
        loop["feedforward"] = scale / speed
        loop["deadband"] = control.deadband_compensation
        loop["tolerance"] = control.tolerance_m / scale
        loop["limit"] = 1.0
        loop["integral_limit"] = control.integral_limit
    return loops


@njit
def valve_command(loop: PositionLoop, position: float, dt: float) -> float:
    """Command of one PositionLoop for a control period of dt, s; position in m (rotation: rad)."""
    error = loop.reference - position
    if loop.reference_rate == 0.0 and abs(error) <= loop.tolerance:
        return 0.0
    integral = loop.integral + dt * loop.integral_gain * error
    loop.integral = min(max(integral, -loop.integral_limit), loop.integral_limit)
    opening = loop.proportional * error + loop.feedforward * loop.reference_rate + loop.integral
    if opening > 0.0:
        opening += loop.deadband
    elif opening < 0.0:
        opening -= loop.deadband
    return min(max(opening, -loop.limit), loop.limit)
