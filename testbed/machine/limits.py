"""What each number of a cylinder, its valve, seal and oil, and of the power unit may be; what the URDF alone gives."""

from __future__ import annotations

import re
from pathlib import Path

from testbed.errors import InputError


def require(
    condition: bool,
    path: str,
    value: object,
    allowed: str,
    file: str | Path = "roboclimber.yaml",
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
