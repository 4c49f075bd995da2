"""The ground in the engine: a ray from above meets it where its surface is."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import numpy as np
import pytest

from testbed.scenario.scenario import load_scenario
from testbed.world.engine import BulletClient, p
from testbed.world.ground.terrain import ground_shape, make_ground

KINDS = {
    "plane": [],
    "box": ["terrain.kind=box"],
    "heightfield": ["terrain.kind=heightfield", "terrain.roughness_m=0.05"],
    "profile": [
        "terrain.kind=profile",
        "terrain.profile_m=[[-5, 0], [0.5, 0], [0.5, 0.2], [5, 0.2]]",
    ],
}


@pytest.fixture
def bullet() -> Iterator[Any]:
    made = BulletClient(p.DIRECT)
    yield made
    made.disconnect()


@pytest.mark.parametrize("kind", list(KINDS))
@pytest.mark.parametrize("slope_deg", [0, 45])
def test_a_ray_from_above_meets_the_surface(bullet: Any, kind: str, slope_deg: int) -> None:
    changes = [f"terrain.slope_deg={slope_deg}", *KINDS[kind]]
    ground = make_ground(load_scenario("stand_flat", changes).terrain)
    body = bullet.createMultiBody(0, ground_shape(bullet, ground))
    bullet.resetBasePositionAndOrientation(body, *ground.engine_pose())
    turn = ground.rotation_slope_to_world
    for along, across in ((-0.33, 0.21), (0.2, -0.4), (1.13, 0.37)):
        above, below = (turn @ np.array([along, across, z]) for z in (1.0, -1.0))
        (hit,) = bullet.rayTest(above.tolist(), below.tolist())
        found = turn.T @ np.array(hit[3])
        height, _ = ground.surface(np.array([[along, across]]))
        assert hit[0] == body
        assert found[2] == pytest.approx(float(np.ravel(height)[0]), abs=5e-3)
