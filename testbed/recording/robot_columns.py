"""The columns of a recording of the whole robot: unit and meaning, and which of them an estimate starts from."""

from __future__ import annotations

import difflib

from testbed.machine.names import AXES, LEGS, SIDES

_UNITS: tuple[tuple[str, str, str], ...] = (
    ("t", "s", "time"),
    ("position_", "", "encoder: extension of the joint (rotation: angle)"),
    ("pressure_a_", "Pa", "piston side, gauge, through calibration"),
    ("pressure_b_", "Pa", "rod side, gauge, through calibration"),
    ("valve_", "1", "valve command, -1 to 1, + extends"),
    ("supply_pressure", "Pa", "supply pressure, gauge"),
    ("oil_temperature", "degC", "oil temperature"),
    ("rope_tension_", "N", "tension at the traction device"),
    ("attitude_", "rad", "inertial unit: roll, pitch, yaw of the body"),
    ("angular_rate_", "rad/s", "inertial unit: rate in the body frame"),
    (
        "specific_force_",
        "m/s2",
        "inertial unit at the body's origin: acceleration less gravity, body frame",
    ),
    ("estimate_", "N", "foot load along the vertical joint's axis, by this method"),
    (
        "own_",
        "N",
        "force of the ground on the foot, body frame, by the own estimate; _sd: its standard deviation",
    ),
    (
        "ordered_",
        "",
        "drill as control ordered it: thrust away from the ground, N; torque about body z, N m",
    ),
    (
        "rods_mast_height",
        "m",
        "middle of the rods in the mast above the drill point, as the drill's controls have it",
    ),
    (
        "rods_",
        "kg",
        "rods in the hole, in the mast, gained by the store since the start: the drill's own count",
    ),
    ("expected_", "N", "foot load along the vertical joint's axis that the model expects"),
    ("contact_", "1", "the detector's word: 1 the foot carries, 0 it has lost contact"),
    ("carrying_", "1", "the control's wish: 1 the foot is meant to carry, 0 it swings"),
    ("drill_", "", "read at the drill's own controls"),
)
_SAID = ("estimate_", "own_", "contact_", "drill_")
"""What estimators and detectors said during the run: nothing is computed from it again."""
_PER_AXIS = ("position_", "pressure_a_", "pressure_b_", "valve_")
_VERTICAL = tuple(f"{stem}{leg}_vertical" for stem in _PER_AXIS[:3] for leg in LEGS)
OF_LEGS: tuple[str, ...] = ("t", *_VERTICAL, "attitude_roll", "attitude_pitch")
"""Without these there is no load of a foot."""
OF_BODY: tuple[str, ...] = (
    "t",
    *(f"{stem}{axis}" for stem in _PER_AXIS for axis in AXES),
    "supply_pressure",
    "oil_temperature",
    *(f"rope_tension_{side}" for side in SIDES),
    *(f"attitude_{angle}" for angle in ("roll", "pitch", "yaw")),
    *(f"angular_rate_{k}" for k in "xyz"),
)
"""Without these the body of a surveyed machine cannot be balanced."""


def described(quantity: str) -> tuple[str, str] | None:
    """(unit, meaning) of a quantity of the whole robot; None for one that has no declared meaning."""
    for prefix, unit, meaning in _UNITS:
        if quantity == prefix or (prefix.endswith("_") and quantity.startswith(prefix)):
            if prefix == "position_":
                unit = "rad" if quantity.endswith("_rotation") else "m"
            return unit or "1", meaning
    return None


def quantities() -> dict[str, tuple[str, str, bool]]:
    """Pattern of a column's name -> (SI unit, meaning, whether a robot's recording must have it)."""
    places = {**dict.fromkeys(_PER_AXIS, "<leg>_<joint>"), "rope_tension_": "<left|right>"}
    places |= {"attitude_": "<roll|pitch|yaw>", "angular_rate_": "<x|y|z>"}
    out = {}
    for prefix, unit, meaning in _UNITS:
        stem = prefix.endswith("_")
        pattern = prefix + places.get(prefix, "<...>") if stem else prefix
        needed = any(name.startswith(prefix) if stem else name == prefix for name in OF_BODY)
        named = "m, rotation: rad" if prefix == "position_" else unit or "1"
        out[pattern] = (named, meaning, needed)
    return out


def is_evidence(quantity: str) -> bool:
    """Whether estimates are computed from it: what sensors read, what control ordered and expected."""
    return described(quantity) is not None and not quantity.startswith(_SAID)


def misspelt(quantity: str) -> str | None:
    """The axis that a quantity such as `valve_fl_vertcal` means, where it names none of the twelve; else None."""
    for stem in _PER_AXIS:
        place = quantity.removeprefix(stem)
        if place != quantity and place not in AXES:
            return stem + (difflib.get_close_matches(place, AXES, n=1, cutoff=0.0) or AXES)[0]
    return None
