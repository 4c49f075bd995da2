"""What a drawn machine truly weighs, and where: masses in its links move the whole."""

from __future__ import annotations

import numpy as np
import pytest
from shipped import MACHINE

from testbed.machine.names import AXES
from testbed.robot.model import RobotModel
from testbed.simulation.run_folder import weigh

MODEL = RobotModel(MACHINE.urdf)
MIDDLE = MODEL.limits.mean(axis=1)


def test_without_further_masses_it_is_the_drawing() -> None:
    total, *centre = weigh(MODEL, np.zeros(len(AXES)))
    assert total == pytest.approx(MODEL.total_mass_kg)
    assert centre == pytest.approx(MODEL.centre_of_mass_m(MIDDLE))


def test_alike_masses_in_all_links_move_the_centre_along_the_middle_plane() -> None:
    total, _, y, z = weigh(MODEL, np.full(len(AXES), 10.0))
    before = MODEL.centre_of_mass_m(MIDDLE)
    assert total == pytest.approx(MODEL.total_mass_kg + 120.0)
    assert y == pytest.approx(before[1] * MODEL.total_mass_kg / total, abs=1e-3)
    assert z < before[2]  # the legs hang below the body


@pytest.mark.parametrize("axis", ["fl_vertical", "rr_radial"])
def test_a_mass_in_one_link_pulls_the_centre_towards_it(axis: str) -> None:
    masses = np.zeros(len(AXES))
    masses[AXES.index(axis)] = 100.0
    total, *centre = weigh(MODEL, masses)
    before = MODEL.centre_of_mass_m(MIDDLE)
    way = np.asarray(MODEL.link_centres_m(MIDDLE))[AXES.index(axis)] - before
    assert np.array(centre) - before == pytest.approx(100.0 / total * way)


def test_the_more_the_mass_the_nearer_the_centre_comes() -> None:
    masses = np.zeros(len(AXES))
    ways = []
    for kg in (10.0, 100.0, 1e6):
        masses[0] = kg
        ways.append(np.array(weigh(MODEL, masses)[1:]))
    link = np.asarray(MODEL.link_centres_m(MIDDLE))[0]
    apart = [float(np.linalg.norm(way - link)) for way in ways]
    assert apart[0] > apart[1] > apart[2] and apart[2] < 0.01
