"""What each number of a cylinder, its valve, seal and oil, and of the power unit may be; what the URDF alone gives."""

from __future__ import annotations

import math
import re
from pathlib import Path

from testbed.errors import InputError
from testbed.machine.names import JOINTS
from testbed.machine.provenance import Parameters

SHIPPED = "roboclimber.yaml"
Limits = tuple[tuple[str, tuple[str, ...], float, float], ...]

LIMITS: Limits = (
    ("oil", ("bulk_modulus_pa",), 1.0e7, 1.0e11),
    ("oil", ("entrained_air",), 0.0, 0.5),
    ("oil", ("internal_leakage_m3_s_pa", "outer_leakage_m3_s_pa"), 0.0, 1.0e-6),
    ("oil", ("hose_capacity_m3_pa", "hose_capacity_b_m3_pa"), 0.0, 1.0e-6),
    ("oil", ("hose_time_s",), 0.0, math.inf),
    ("valve", tuple(f"rated_flow_{joint}_m3_s" for joint in JOINTS), 0.0, 1.0),
    ("valve", ("deadband", "hysteresis"), 0.0, 1.0),
    ("valve", ("edge_pa", "edge_at", "edge_pb", "edge_bt", "damping"), 0.0, math.inf),
    ("valve", ("edge_leakage_m3_s_pa", "edge_leakage_supply_m3_s_pa"), 0.0, 1.0e-6),
    ("valve", ("rated_drop_per_edge_pa", "natural_frequency_hz", "amplifier_lag_s"), 0.0, math.inf),
    ("seal", ("bristle_stiffness_n_m", "dwell_time_s"), 0.0, math.inf),
    (
        "seal",
        (
            "bristle_damping_n_s_m",
            "dwell_gain",
            "pressure_coefficient_m2",
            "load_coefficient",
            "side_load_coefficient",
        ),
        0.0,
        math.inf,
    ),
    ("seal", ("position_slope",), -2.0, 2.0),
    ("end_stop", ("cushion_length_m",), 0.0, math.inf),
    ("end_stop", ("cushion_damping_n_s_m", "stiffness_n_m", "damping_n_s_m"), 0.0, math.inf),
    ("sensor", ("line_b_frequency_hz", "transducer_bandwidth_hz"), 0.0, math.inf),
    ("sensor", ("line_b_damping",), 0.0, math.inf),
)
"""What each number of an axis may be: from the first bound (allowed but for OPEN_BELOW) to below the second."""
UNIT_LIMITS: Limits = (
    (
        "power_unit",
        ("power_w", "compensator_band_pa", "compensator_lag_s", "line_volume_m3"),
        0.0,
        math.inf,
    ),
    (
        "power_unit",
        ("full_flow_m3_s", "case_leakage_m3_s_pa", "relief_slope_m3_s_pa", "accumulator_volume_m3"),
        0.0,
        math.inf,
    ),
    ("power_unit", ("tank_pressure_pa", "accumulator_precharge_pa"), -0.9e5, math.inf),
    ("oil", ("heat_capacity_j_k", "cooling_w_k"), 0.0, math.inf),
)
"""The same of the power unit; pressures are gauge: the least is a tenth of the atmosphere's."""
OPEN_BELOW = {
    *(("valve", f"rated_flow_{joint}_m3_s") for joint in JOINTS),
    ("valve", "rated_drop_per_edge_pa"),
    ("valve", "natural_frequency_hz"),
    ("valve", "amplifier_lag_s"),
    ("oil", "hose_time_s"),
    ("oil", "heat_capacity_j_k"),
    ("seal", "bristle_stiffness_n_m"),
    ("seal", "dwell_time_s"),
    ("end_stop", "cushion_length_m"),
    ("sensor", "line_b_frequency_hz"),
    ("sensor", "transducer_bandwidth_hz"),
    ("power_unit", "power_w"),
    ("power_unit", "compensator_band_pa"),
    ("power_unit", "compensator_lag_s"),
    ("power_unit", "line_volume_m3"),
}
"""Numbers that the laws or the control divide by."""


def check_cylinders(p: Parameters, file: str | Path = SHIPPED, section: str = "") -> None:
    """Raise InputError for the first number of a cylinder, its valve, seal, stops or oil that cannot be.

    `file` and `section` say where the numbers were changed.
    """
    for joint in JOINTS:
        group = f"{joint}_cylinder"
        cyl = p[group]

        def holds(
            condition: bool, name: str, allowed: str, group: str = group, cyl: Parameters = cyl
        ) -> None:
            require(condition, f"{group}.{name}", cyl[name], allowed, file, section)

        holds(0.0 < cyl["bore_m"] <= 1.0, "bore_m", "0 < bore <= 1 m")
        holds(0.0 < cyl["rod_m"] < cyl["bore_m"], "rod_m", f"0 < rod < bore = {cyl['bore_m']} m")
        if "stroke_m" in cyl:
            holds(0.0 < cyl["stroke_m"] <= 10.0, "stroke_m", "0 < stroke <= 10 m")
        for way in ("out", "in"):
            for name in (f"coulomb_{way}_n", f"static_{way}_n", f"viscous_{way}_n_s_m"):
                holds(cyl[name] >= 0.0, name, ">= 0")
            holds(cyl[f"stribeck_{way}_m_s"] > 0.0, f"stribeck_{way}_m_s", "> 0")
        for name in ("dead_volume_a_m3", "dead_volume_b_m3"):
            holds(cyl[name] > 0.0, name, "> 0")
    _check_limits(LIMITS, p, file, section)


def check_power_unit(p: Parameters, file: str | Path = SHIPPED, section: str = "") -> None:
    """Raise InputError for the first number of the power unit or its oil that cannot be."""
    _check_limits(UNIT_LIMITS, p, file, section)
    unit = p["power_unit"]
    supply_pa, tank_pa = unit["supply_pressure_pa"], unit["tank_pressure_pa"]
    allowed = f"above the tank's pressure, {tank_pa:g} Pa"
    require(supply_pa > tank_pa, "power_unit.supply_pressure_pa", supply_pa, allowed, file, section)


def _check_limits(limits: Limits, p: Parameters, file: str | Path, section: str) -> None:
    for part, names, low, high in limits:
        for name in names:
            value, beyond = p[part][name], (part, name) in OPEN_BELOW
            allowed = f"{'>' if beyond else '>='} {low:g}" + (
                f" and < {high:g}" if high < math.inf else ""
            )
            inside = low < value < high or (value == low and not beyond)
            require(inside, f"{part}.{name}", value, allowed, file, section)


def require(
    condition: bool,
    path: str,
    value: object,
    allowed: str,
    file: str | Path = SHIPPED,
    section: str = "",
) -> None:
    """Raise InputError for the number at the dotted `path`, of `section` if one is given, unless `condition` holds."""
    if not condition:
        field = f"{section}.{path}" if section else path
        raise InputError("is impossible", file=file, field=field, value=value, allowed=allowed)


_INERTIA = r"(mass_kg|inertia_\w+)"
_URDF = re.compile(
    rf"total_mass_kg|(body|power_unit_body|traction_body)\..*|rod_store_body\.{_INERTIA}"
    r"|drill_body\.(?!hole_diameter_m).*|joints\.(radial|vertical)\..*|joints\.rotation\.(effort|velocity)_.*"
    r"|legs\.((rotation|radial)_mass_kg|\w+_inertia_\w+|foot(_plate)?_radius_m)"
)
_URDF_OR_BELIEF = re.compile(r"legs\..*")


def only_in_urdf(path: str, believed: bool) -> bool:
    """Whether the simulator takes the number at a dotted path from the URDF alone, so that changing it does nothing.

    `believed`: the number is one that estimators and control believe, which reckon with legs of their own.
    """
    return bool(_URDF.fullmatch(path) or (not believed and _URDF_OR_BELIEF.fullmatch(path)))
