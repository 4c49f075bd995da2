"""Numbers of the machine that something else rules, so that changing them by their path would
change nothing.
"""

from __future__ import annotations

import re

from testbed.errors import InputError
from testbed.machine.frame_groups import RotationLinkage, SlideLinkage
from testbed.machine.model import Machine, shared_path
from testbed.machine.names import AXES

URDF, UNREAD = "the URDF", ""
Rules = tuple[tuple[str, str], ...]
_BODIES = (
    r"total_mass_kg|(body|power_unit_body|traction_body)\..*|rod_store_body\.(mass_kg|inertia_\w+)"
    r"|drill_body\.(?!hole_diameter_m).*|joints\.(radial|vertical)\..*"
    r"|joints\.rotation\.(effort|velocity)_.*|legs\.((rotation|radial)_mass_kg|\w+_inertia_\w+)"
    r"|legs\.foot(_plate)?_radius_m"
)
_ARM = r"axes\.\w+_(radial|rotation)"
_NO_LOAD: Rules = (
    (rf"{_ARM}\.seal\.load_coefficient", UNREAD),
    (r"axes\.\w+_rotation\.seal\.side_load_\w+", UNREAD),
)
"""The load along a cylinder is a foot's, the load across it too: an arm feels the one, a turntable
neither.
"""
COMMON: Rules = (
    (_BODIES, URDF),
    (r"drill\.feed_n", "task.feed_n"),
    (r"drill\.torque_nm", "task.torque_nm"),
    (r"drill\.blow_hz", "task.blow_hz"),
    (r"drill\.blow_n", "task.blow_n"),
    (r"drill\.rod_length_m", "task.rod_length_m"),
    (r"drill\.rod_mass_kg", "task.rod_kg"),
    (r"drill\.pull_out_n", "task.pull_n"),
    (r"oil\.start_temperature_degc", "hydraulics.oil_temperature_degc"),
    (r"rope\.stiffness_ea_n", "ropes.stiffness_ea_n"),
    (r"rope\.breaking_load_n", "ropes.breaking_load_n"),
    (r"rope\.damping_n_s", "ropes.damping_n_s_m"),
    (r"ground\.damping_n_s_m", "terrain.damping_n_s_m"),
    (r"drill\.hammer_mass_kg", UNREAD),
    (r"sensor\.(volts_factor_pa_per_v|line_b_length_m)", UNREAD),
)
"""Pattern of the path -> the field of a scenario that rules the number, for world and model
alike.
"""
WORLD: Rules = (
    (r"legs\..*", URDF),
    (r"rod_store_body\.position_m", URDF),
    (r"ground\.friction", "terrain.friction"),
    (r"ground\.stiffness_n_m", "terrain.stiffness_n_m"),
    (r"(control\..*)", r"model.parameters.\1"),
    (r"power_unit\.tank_oil_m3", UNREAD),
    *_NO_LOAD,
)
"""Patterns that hold for the world alone: position loops are the electronics', which work with the
model.

The tank's content is only counted: what leaves it comes back, and no run can empty it.
"""
MODEL: Rules = (
    (r"rope\..*|drill\..*|rock\..*|drill_body\..*|legs\.hip_z_m", UNREAD),
    (r"seal\.(bristle_damping_n_s_m|elastic_share)|end_stop\.(stiffness|damping)_\w+", UNREAD),
    (r"oil\.(outer_leakage|hose_(capacity|time)|ambient|heat_capacity|cooling)\w+", UNREAD),
    (r"oil\.(bulk_modulus_rate_1_k|declared_at_degc)", UNREAD),
    (r"power_unit\.(?!full_flow_m3_s|supply_|standby_pressure_pa|tank_pressure_pa).*", UNREAD),
    (
        r"sensor\.(pressure_(noise|resolution|ripple)_\w+|line_b_\w+|\w+_(noise|bias)_\w+|thermal_span_share)",
        UNREAD,
    ),
    (r"sensor\.(transducer_bandwidth_hz|temperature_resolution_k)", UNREAD),
    (r"traction\.(stroke_m|annulus_area_m2|return_speed_m_s|clamp_s|seat_m|clamp_hold_n)", UNREAD),
    (rf"{_ARM}\.(oil\..*|valve\.(?!rated_flow).*|seal\.bristle_stiffness_n_m)", UNREAD),
    *_NO_LOAD,
)
"""Patterns that hold for the model alone: what no estimator, controller or diagnosis reads."""
SHARED_ONLY = re.compile(
    r"oil\.(start_temperature_degc|ambient_degc|heat_capacity_j_k|cooling_w_k)"
    r"|seal\.viscosity_(rate_1_k|reference_degc)"
    r"|sensor\.(?!pressure_|thermal_(zero_share|span_share|range_k)|transducer_bandwidth_hz|line_b_).*"
)
"""Numbers of an axis' groups that the machine has once: one axis cannot have its own."""


def ruler_of(path: str, believed: bool) -> str | None:
    """Who rules a number of the world's or of the believed machine: URDF, UNREAD, the dotted field
    of a scenario, or nobody.
    """
    for pattern, ruler in (*COMMON, *(MODEL if believed else WORLD)):
        found = re.fullmatch(pattern, shared_path(path) or path) or re.fullmatch(pattern, path)
        if found is not None:
            return found.expand(ruler)
    return None


def check_effective(path: str, value: object, believed: bool, file: object, section: str) -> None:
    """Raise InputError, naming who rules it, for a number whose change would do nothing."""
    _check_shared(path, value, file, section)
    ruler = ruler_of(path, believed)
    if ruler == URDF:
        allowed = "another URDF in robot.urdf, or a load in robot.payload_kg"
        _refuse("the URDF alone gives it", allowed, path, value, file, section)
    if ruler == UNREAD:
        _refuse("nothing reads it", "a number that is read", path, value, file, section)
    if ruler is not None:
        _refuse(f"{ruler} rules it", ruler, path, value, file, section)


def check_read(path: str, value: object, file: object, section: str) -> None:
    """Raise InputError for a number of a machine's folder that neither world nor model reads."""
    _check_shared(path, value, file, section)
    if ruler_of(path, False) == ruler_of(path, True) == UNREAD:
        _refuse("nothing reads it", "a number that is read", path, value, file, section)


def _check_shared(path: str, value: object, file: object, section: str) -> None:
    shared = shared_path(path)
    if shared is not None and path.startswith("axes.") and SHARED_ONLY.fullmatch(shared):
        _refuse("all axes share it", shared, path, value, file, section)


OF_A_KIND: tuple[tuple[str, tuple[str, ...], int], ...] = (
    (r"power_unit\.(load_sensing_\w+|standby_pressure_pa)", ("power_unit.supply_kind",), 1),
    (r"power_unit\.unloading_band_pa", ("power_unit.supply_kind",), 2),
    (r"(.*valve)\.counterbalance_\w+", (r"\1.holding_a", r"\1.holding_b"), 2),
)
"""Pattern of a number, the paths that say what kind of part it belongs to, and the kind that reads
it.
"""


def check_kind(path: str, value: object, machine: Machine, file: object, section: str) -> None:
    """Raise InputError for a number of a kind of part that the machine does not have."""
    volume = "power_unit.accumulator_volume_m3"
    if path == "power_unit.accumulator_precharge_pa" and machine.quantity(volume).value == 0.0:
        _refuse("there is no accumulator", f"{volume} > 0", path, value, file, section)
    _check_linkage(path, value, machine, file, section)
    for pattern, paths, kind in OF_A_KIND:
        found = re.fullmatch(pattern, path)
        if found is None:
            continue
        sayings = [found.expand(text) for text in paths]
        if found.groups() and found[1] == "valve":  # an axis may have a kind of its own
            sayings += [f"axes.{axis}.{text}" for axis in AXES for text in sayings]
        if all(machine.quantity(text).value != kind for text in sayings):
            ruling = f"{sayings[0]} = {kind}"
            _refuse(f"only {ruling} reads it", ruling, path, value, file, section)


def _check_linkage(path: str, value: object, machine: Machine, file: object, section: str) -> None:
    """Refuse a number of a lever where there is a rack, of an offset's where there is none."""
    found = re.fullmatch(r"(?:axes\.(\w+)\.linkage|(\w+)_linkage)\.(\w+)", path)
    if found is None:
        return
    mine = [axis for axis in machine.axes.values() if found[1] in (None, axis.name)]
    linkages = [axis.linkage for axis in mine if found[2] in (None, axis.joint)]
    prefix = path.removesuffix(found[3])
    if found[3] == "along_m" and all(
        isinstance(linkage, SlideLinkage) and linkage.across_m == 0.0 for linkage in linkages
    ):
        ruling = f"{prefix}across_m > 0"
        _refuse("only an offset across the slide reads it", ruling, path, value, file, section)
    if found[3] != "rack_radius_m" and all(
        isinstance(linkage, RotationLinkage) and linkage.rack_radius_m > 0.0 for linkage in linkages
    ):
        ruling = f"{prefix}rack_radius_m = 0"
        _refuse("a rack takes the lever's place", ruling, path, value, file, section)


def _refuse(why: str, allowed: str, path: str, value: object, file: object, section: str) -> None:
    raise InputError(
        f"would have no effect: {why}",
        file=str(file),
        field=f"{section}.{path}",
        value=value,
        allowed=allowed,
    )
