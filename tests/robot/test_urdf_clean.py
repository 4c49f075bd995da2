"""Every URDF that travels with the testbed is one that other tools take without a word:
check_urdf's rules, and ROS's.
"""

from __future__ import annotations

import math
import re
import subprocess
import xml.etree.ElementTree as ET
from pathlib import Path

import pytest

from testbed import resources
from testbed.machine.folder import BODIES, machine_folder

URDFS = {
    "roboclimber": resources.urdf(),
    "climber_8t": machine_folder("climber_8t") / BODIES,
    "quarter_model": machine_folder("quarter_model") / BODIES,
}
INERTIA = ("ixx", "ixy", "ixz", "iyy", "iyz", "izz")


@pytest.fixture(params=URDFS)
def robot(request: pytest.FixtureRequest) -> ET.Element:
    return ET.parse(Path(URDFS[request.param])).getroot()


@pytest.mark.parametrize("name", URDFS)
def test_check_urdf_has_nothing_to_say_of_it(name: str) -> None:
    """ROS's own parser, which the rigid-body library brings along."""
    import cmeel  # type: ignore[import-untyped]

    (prefix,) = (Path(folder) for folder in cmeel.__path__)
    home = prefix.with_name("cmeel.prefix")
    done = subprocess.run(
        [home / "bin/check_urdf", URDFS[name]],
        env={"LD_LIBRARY_PATH": str(home / "lib")},
        capture_output=True,
        text=True,
    )
    assert done.returncode == 0 and not done.stderr
    assert "Successfully Parsed XML" in done.stdout
    assert not re.search("warn|error", done.stdout, re.IGNORECASE)


def test_it_is_one_tree_from_one_root_with_plain_names(robot: ET.Element) -> None:
    links = [link.get("name") for link in robot.findall("link")]
    joints = [joint.get("name") for joint in robot.findall("joint")]
    assert len(set(links)) == len(links) and len(set(joints)) == len(joints)
    assert all(re.fullmatch(r"[A-Za-z][A-Za-z0-9_]*", str(name)) for name in (*links, *joints))
    children = [joint.find("child").get("link") for joint in robot.findall("joint")]  # type: ignore[union-attr]
    assert len(set(children)) == len(children)
    assert set(links) - set(children) == {"body"}


def test_joints_have_unit_axes_and_whole_limits(robot: ET.Element) -> None:
    for joint in robot.findall("joint"):
        if joint.get("type") == "fixed":
            continue
        axis, limit = joint.find("axis"), joint.find("limit")
        assert axis is not None and limit is not None, joint.get("name")
        size = math.hypot(*(float(v) for v in str(axis.get("xyz")).split()))
        assert size == pytest.approx(1.0)
        lower, upper, effort, velocity = (
            float(str(limit.get(word))) for word in ("lower", "upper", "effort", "velocity")
        )
        assert lower < upper and effort > 0.0 and velocity > 0.0


def test_inertias_are_those_of_bodies(robot: ET.Element) -> None:
    for link in robot.findall("link"):
        inertia = link.find("inertial/inertia")
        assert inertia is not None, link.get("name")
        ixx, ixy, ixz, iyy, iyz, izz = (float(str(inertia.get(word))) for word in INERTIA)
        assert (ixy, ixz, iyz) == (0.0, 0.0, 0.0)
        assert min(ixx + iyy - izz, iyy + izz - ixx, izz + ixx - iyy) > 0.0, link.get("name")


def test_every_shape_has_a_size_and_every_colour_is_declared(robot: ET.Element) -> None:
    declared = {material.get("name") for material in robot.findall("material")}
    for shape in robot.iter("geometry"):
        (solid,) = shape
        words = ("size", "radius", "length")
        sizes = [float(v) for word in words for v in solid.get(word, "").split()]
        assert sizes and min(sizes) > 0.0
    used = {material.get("name") for material in robot.findall("link/visual/material")}
    assert used <= declared
