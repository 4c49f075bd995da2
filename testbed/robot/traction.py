"""The machine's traction devices as the record that their law steps."""

from __future__ import annotations

from typing import Any

from testbed.errors import InputError
from testbed.laws.traction import RESERVE_M, TractionParameters
from testbed.machine.model import Machine

TRACTION_NAMES = {
    "area": "piston_area_m2",
    "annulus": "annulus_area_m2",
    "rating": "rating_n",
    "hold": "clamp_hold_n",
    "stroke": "stroke_m",
    "speed": "speed_max_m_s",
    "return_speed": "return_speed_m_s",
    "clamp_time": "clamp_s",
}
"""Quantity of TractionParameters -> parameter of the machine."""


def traction_parameters(machine: Machine, *, strokes: bool, roped: bool = True) -> Any:
    """TractionParameters of a rope's device; without `strokes` a winch that hauls without end;
    `roped`: it is used.

    Raises InputError for numbers that cannot be.
    """
    given, device = machine.traction, TractionParameters.zeros()[0]
    for quantity, name in TRACTION_NAMES.items():
        device[quantity] = getattr(given, name)
    least = 3.0 * RESERVE_M
    if roped and given.stroke_m <= least:
        raise InputError(
            "is impossible", field="traction.stroke_m", value=given.stroke_m, allowed=f"> {least:g}"
        )
    device["seat"] = given.seat_m
    if not strokes:
        device["stroke"] = 0.0
    return device
