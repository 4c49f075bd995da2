"""A machine of every kind of linkage and of legs that are not alike."""

from __future__ import annotations

from pathlib import Path

from testbed.machine.build import build_machine
from testbed.machine.model import Machine
from testbed.workflows.machines import check_machine

NUMBERS = """\
format: roboclimber-machine/1
name: mixed
numbers:
  vertical_linkage:
    along_m: {value: 0.5, unit: m, mark: E, source: inclined}
    across_m: {value: 0.4, unit: m, mark: E, source: inclined}
  rotation_linkage:
    rack_radius_m: {value: 0.18, unit: m, mark: E, source: a rack}
  each_leg:
    rl:
      radial_offset_m: {value: 0.45, unit: m, mark: E, source: a shorter arm}
  axes:
    rl_radial:
      linkage: {ratio: {value: 0.5, unit: "1", mark: E, source: a chain}}
    rr_vertical:
      limits: {upper_m: {value: 0.45, unit: m, mark: E, source: a shorter leg}}
      linkage: {across_m: {value: 0.0, unit: m, mark: E, source: this one straight}}
    fr_rotation:
      limits: {upper_rad: {value: 0.5, unit: rad, mark: E, source: a smaller range}}
"""


def mixed_folder(folder: Path) -> Path:
    """The machine's folder, its URDF drawn."""
    (folder / "machine.yaml").write_text(NUMBERS)
    check_machine(str(folder))
    return folder


def mixed_machine(folder: Path) -> Machine:
    """The machine itself."""
    return build_machine(folder=mixed_folder(folder))
