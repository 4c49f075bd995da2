"""The ground as a collision shape of the engine."""

from __future__ import annotations

from typing import Any

from testbed.world.ground.terrain import Ground


def ground_shape(bullet: Any, ground: Ground) -> int:
    """Make the shape of a ground in an engine client; returns the engine's number of it."""
    if ground.kind == "plane":
        return int(bullet.createCollisionShape(bullet.GEOM_PLANE))
    if ground.kind == "box":
        return int(bullet.createCollisionShape(bullet.GEOM_BOX, halfExtents=[100, 100, 1]))
    if ground.kind == "profile":  # a box under each straight piece, risers included
        sizes, places, turns = ground.boxes()
        return int(
            bullet.createCollisionShapeArray(
                shapeTypes=[bullet.GEOM_BOX] * len(sizes),
                halfExtents=sizes,
                collisionFramePositions=places,
                collisionFrameOrientations=turns,
            )
        )
    assert ground.heights_m is not None
    rows, columns = ground.heights_m.shape
    return int(
        bullet.createCollisionShape(
            bullet.GEOM_HEIGHTFIELD,
            meshScale=[ground.cell_m, ground.cell_m, 1.0],
            heightfieldData=ground.heights_m.T.ravel().tolist(),
            numHeightfieldRows=rows,
            numHeightfieldColumns=columns,
        )
    )
