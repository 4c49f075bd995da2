"""Primitive shapes lie where they are said to, and weigh as homogeneous bodies do."""

from __future__ import annotations

import math

import numpy as np
import pytest
from shipped import MACHINE

from testbed.machine.build import build_machine
from testbed.machine.folder import machine_folder
from testbed.robot.urdf.drawing import Vector, bar, box, box_inertia, post, visuals


def along(rpy: Vector) -> np.ndarray:
    """Where a shape's own z points, by roll, pitch and yaw."""
    roll, pitch, yaw = rpy
    assert roll == 0.0
    across = math.sin(pitch)
    return np.array([across * math.cos(yaw), across * math.sin(yaw), math.cos(pitch)])


@pytest.mark.parametrize(
    ("start", "end"),
    [
        ((0.0, 0.0, 0.0), (0.0, 0.0, 2.0)),
        ((1.0, 2.0, 3.0), (1.5, 0.5, 2.0)),
        ((0.3, -0.2, 1.0), (-0.4, -0.2, 1.0)),
        ((0.0, 0.0, 1.0), (0.0, 0.0, -1.0)),
    ],
)
def test_a_bar_reaches_from_point_to_point(start: Vector, end: Vector) -> None:
    shape = bar(start, end, 0.05, "steel")
    radius, length = shape.size
    half = 0.5 * length * along(shape.rpy)
    assert radius == 0.05 and length == pytest.approx(math.dist(start, end))
    assert np.array(shape.centre) - half == pytest.approx(np.array(start), abs=1e-12)
    assert np.array(shape.centre) + half == pytest.approx(np.array(end), abs=1e-12)


def test_a_post_stands_between_its_heights_and_a_box_turns_about_its_upright_axis() -> None:
    upright = post(0.1, -0.5, 1.5, 0.2, 0.3, "grey")
    assert upright.size == (0.1, 2.0) and upright.centre == (0.2, 0.3, 0.5)
    assert upright == bar((0.2, 0.3, -0.5), (0.2, 0.3, 1.5), 0.1, "grey")
    assert box((1.0, 2.0, 3.0), (0.0, 0.0, 0.0), "red", 0.7).rpy == (0.0, 0.0, 0.7)


def test_a_boxs_inertia_is_the_sum_over_its_points() -> None:
    size, mass, n = (0.4, 1.0, 2.5), 120.0, 24
    axes = [side * ((np.arange(n) + 0.5) / n - 0.5) for side in size]
    x, y, z = np.meshgrid(*axes)
    about = [(mass * (a**2 + b**2)).mean() for a, b in ((y, z), (x, z), (x, y))]
    assert box_inertia(mass, size) == pytest.approx(about, rel=2.0 / n**2)
    assert box_inertia(12.0, (0.0, 0.0, 1.0)) == (1.0, 1.0, 0.0)  # a rod: m l^2 / 12


@pytest.mark.parametrize("name", ["quarter_model", "climber_8t"])
def test_a_machine_is_drawn_as_large_as_it_is(name: str) -> None:
    """No part of its drawing is larger, beside the machine's own length, than ROBOCLIMBER's."""
    spans = []
    for machine in (MACHINE, build_machine(folder=machine_folder(name))):
        shapes_of = visuals(machine)
        links = ["body", "power_unit", *(f"fl_{part}" for part in ("radial", "vertical", "foot"))]
        spans.append(
            [
                max(max(shape.size) for shape in shapes_of(link)) / machine.legs.hip_x_m
                for link in links
            ]
        )
    np.testing.assert_allclose(spans[1], spans[0], rtol=0.1)
