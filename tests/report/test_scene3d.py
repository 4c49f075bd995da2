"""A run in three dimensions: the drawn tree stands where the model says, the ground is the world's,
the file reads.
"""

from __future__ import annotations

import sys
from pathlib import Path

import numpy as np
import pytest
from shipped import MACHINE, shipped_model

from testbed.errors import InputError
from testbed.machine.names import AXES, LEGS
from testbed.report.scene3d import ground_mesh, link_paths, write_scene
from testbed.robot.urdf.drawn import drawn
from testbed.scenario.scenario import load_scenario
from testbed.scenario.terrain import Patch
from testbed.simulation.run import run_scenario
from testbed.world.ground.terrain import make_ground


def test_the_feet_of_the_drawn_tree_are_the_models() -> None:
    joints = {joint.child: joint for joint in drawn(MACHINE.urdf)[1]}
    rng = np.random.default_rng(3)
    limits = shipped_model().limits
    positions = rng.uniform(limits[:, 0], limits[:, 1])
    feet = []
    for leg in LEGS:
        place, turn = np.zeros(3), np.eye(3)
        for part in ("rotation", "radial", "vertical", "foot"):
            name = f"{leg}_{part}"
            given = positions[AXES.index(name)] if name in AXES else 0.0
            step, turned = joints[name].pose(np.array([given]))
            place, turn = place + turn @ step[0], turn @ turned[0]
        feet.append(place)
    assert np.array(feet) == pytest.approx(shipped_model().foot_positions_m(positions), abs=1e-9)


def test_every_link_hangs_below_its_parent() -> None:
    paths = link_paths(drawn(MACHINE.urdf)[1])
    assert paths["fl_foot"] == "world/body/fl_rotation/fl_radial/fl_vertical/fl_foot"
    assert len(set(paths.values())) == len(drawn(MACHINE.urdf)[0])


def test_the_drawn_ground_lies_on_the_slope_and_shows_a_patch() -> None:
    ground = make_ground(load_scenario("stand_slope_45").terrain)
    points, normals, triangles, colours = ground_mesh(
        ground, [Patch(x_m=0.0, y_m=0.0, radius_m=0.25, friction=0.2)], (-1, 1, -1, 1)
    )
    assert points @ ground.normal_in_world == pytest.approx(0.0, abs=1e-12)
    assert normals == pytest.approx(np.tile([-np.sqrt(0.5), 0.0, np.sqrt(0.5)], (len(points), 1)))
    assert triangles.max() == len(points) - 1 and len(triangles) == 2 * 20 * 20
    corners = points[triangles]
    area = 0.5 * np.linalg.norm(
        np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]), axis=1
    )
    assert area.sum() == pytest.approx(4.0)
    around = np.linalg.norm(points, axis=1) <= 0.25 + 1e-9
    assert (
        len(np.unique(colours[around], axis=0)) == 1
        and (colours[around][0] != colours[~around][0]).any()
    )


def test_without_the_viewer_the_extra_is_named(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setitem(sys.modules, "rerun", None)
    with pytest.raises(InputError, match=r"needs the extra `view`.*roboclimber-testbed\[view\]"):
        write_scene(tmp_path)


@pytest.mark.view
def test_a_runs_scene_holds_every_link_at_every_frame(tmp_path: Path) -> None:
    pytest.importorskip("rerun", reason="the extra `view` is not installed")
    from rerun.chunk import RrdReader

    run_scenario(load_scenario("stand_slope_45", duration=1.0), tmp_path / "run")
    path = write_scene(tmp_path / "run")
    rows: dict[str, int] = {}
    for chunk in RrdReader(str(path)).stream().collect().stream():
        if not chunk.is_static:
            rows[chunk.entity_path] = rows.get(chunk.entity_path, 0) + chunk.num_rows
    moving = [f"/{link_paths(drawn(MACHINE.urdf)[1])[name]}" for name in ("body", *AXES)]
    assert {rows[name] for name in moving} == {50}  # frames of a second
    assert rows["/world/force/fl"] == rows["/world/rope/left"] == 50
    assert rows["/load/rr/true"] == rows["/load/rr/expected"] == 1000
