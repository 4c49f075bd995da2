"""Contacts as the engine tells them, summed foot by foot: signs and sums known by hand."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest

from testbed.world.foot_contacts import FootContacts

ROBOT, GROUND = 7, 3
LINKS = {12: 0, 15: 1, 18: 2, 21: 3}
UP, AHEAD, LEFT = (0.0, 0.0, 1.0), (1.0, 0.0, 0.0), (0.0, 1.0, 0.0)


def row(link: int, normal: float, ahead: float = 0.0, left: float = 0.0, **more: Any) -> list[Any]:
    """A contact as getContactPoints tells it: the robot first, or `second`."""
    out: list[Any] = [0] * 14
    second = more.get("second", False)
    out[1], out[2] = (GROUND, ROBOT) if second else (ROBOT, GROUND)
    out[3], out[4] = (-1, link) if second else (link, -1)
    out[7], out[11], out[13] = more.get("direction", UP), AHEAD, LEFT
    out[9], out[10], out[12] = normal, ahead, left
    return out


class Engine:
    """An engine client with these contacts, and feet so far from the ground."""

    def __init__(self, *rows: list[Any], nearest: Any = ()) -> None:
        self._rows, self._nearest = rows, nearest
        self.asked: tuple[Any, ...] = ()

    def getContactPoints(self) -> Any:
        return self._rows

    def getClosestPoints(self, *what: Any, **more: Any) -> Any:
        self.asked = (*what, more)
        return self._nearest


def contacts(engine: Engine) -> FootContacts:
    return FootContacts(engine, ROBOT, LINKS, [30, 31, 32, 33])


def forces(*rows: list[Any]) -> tuple[Any, Any, float]:
    force, normal = np.full((4, 3), 9.0), np.full(4, 9.0)
    elsewhere = contacts(Engine(*rows)).forces(force, normal)
    return force, normal, elsewhere


def test_normal_and_friction_of_all_points_of_a_foot_add_up() -> None:
    force, normal, elsewhere = forces(row(15, 100.0, 20.0, -5.0), row(15, 50.0, -10.0, 1.0))
    assert force[1].tolist() == [10.0, -4.0, 150.0] and normal.tolist() == [0.0, 150.0, 0.0, 0.0]
    assert not force[[0, 2, 3]].any() and elsewhere == 0.0


def test_where_the_ground_comes_first_its_force_is_turned_round() -> None:
    """The engine tells the force on the first body; of two alike, one told either way, one sums."""
    direction = (0.0, 0.0, -1.0)
    force, normal, _ = forces(row(12, 80.0, -6.0, second=True, direction=direction))
    assert force[0].tolist() == [6.0, 0.0, 80.0] and normal[0] == 80.0


def test_what_touches_beside_the_feet_is_the_belly() -> None:
    force, normal, elsewhere = forces(row(-1, 300.0), row(4, 30.0), row(12, 0.0, 5.0))
    assert elsewhere == 330.0 and not force.any() and not normal.any()


def test_the_grounds_direction_is_the_mean_over_the_force() -> None:
    normals = np.tile([1.0, 0.0, 0.0], (4, 1))
    steep = (0.0, math.sqrt(0.5), math.sqrt(0.5))
    contacts(Engine(row(18, 10.0), row(18, 30.0, direction=steep))).normals(normals)
    mean = np.array([0.0, 30.0 * math.sqrt(0.5), 10.0 + 30.0 * math.sqrt(0.5)])
    assert normals[2] == pytest.approx(mean / np.linalg.norm(mean))
    assert normals[[0, 1, 3]].tolist() == [[1.0, 0.0, 0.0]] * 3  # feet in the air keep theirs


def test_the_gap_is_that_of_the_nearest_point_on_the_foots_own_ground() -> None:
    near, far = [0] * 9, [0] * 9
    near[7], near[8], far[7], far[8] = UP, -2e-3, AHEAD, 0.1
    engine = Engine(nearest=[far, near])
    gap, direction = contacts(engine).gap(3)
    assert gap == -2e-3 and direction.tolist() == list(UP)
    assert engine.asked == (ROBOT, 33, 1.0, {"linkIndexA": 21})
    assert contacts(Engine()).gap(0)[0] == math.inf
