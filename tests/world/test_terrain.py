"""The ground: shapes and files against surfaces known by formula, patches and loose ground by
hand.
"""

from __future__ import annotations

import math
import sys
from pathlib import Path

import numpy as np
import pytest

from testbed.errors import InputError
from testbed.laws.settlement import settled
from testbed.scenario.elevation import read_elevation
from testbed.scenario.scenario import load_scenario
from testbed.scenario.terrain import Terrain
from testbed.world.ground.footing import Footing
from testbed.world.ground.terrain import make_ground
from testbed.world.simulation import Simulation
from testbed.world.summary import world_summary

CELL = 0.25


def hill(path: Path, degrees: float, heading_deg: float = 0.0) -> Path:
    """Esri ASCII file of an even slope that rises towards `heading` (from east,
    counter-clockwise).
    """
    x, y = 1000.0 + CELL * np.arange(101), 5000.0 + CELL * np.arange(101)
    way = (
        math.cos(math.radians(heading_deg)) * x[:, None]
        + math.sin(math.radians(heading_deg)) * y[None, :]
    )
    rows = (math.tan(math.radians(degrees)) * way).T[::-1]
    head = f"ncols 101\nnrows 101\nxllcenter 1000\nyllcenter 5000\ncellsize {CELL}\nNODATA_value -9999\n"
    path.write_text(head + "\n".join(" ".join(f"{v:.6f}" for v in row) for row in rows))
    return path


def scenario(tmp_path: Path, terrain: str) -> Path:
    path = tmp_path / "here.yaml"
    path.write_text("format: roboclimber-scenario/1\nterrain: " + terrain + "\n")
    return path


@pytest.mark.parametrize(
    ("degrees", "heading"), [(0.0, 0.0), (30.0, 0.0), (45.0, 120.0), (75.0, -60.0)]
)
def test_an_even_hill_in_a_file_is_an_even_slope_towards_x(
    tmp_path: Path, degrees: float, heading: float
) -> None:
    hill(tmp_path / "hill.asc", degrees, heading)
    terrain = load_scenario(
        scenario(tmp_path, "{kind: elevation, elevation: {file: hill.asc}}")
    ).terrain
    assert terrain.slope_deg == pytest.approx(degrees, abs=1e-4)
    ground = make_ground(terrain)
    assert ground.heights_m is not None and np.abs(ground.heights_m).max() < 1e-4
    assert ground.heights_m.shape[0] == ground.heights_m.shape[1] >= 2 * 3.0 / terrain.cell_m


def test_a_slope_beside_a_file_that_has_its_own_is_refused(tmp_path: Path) -> None:
    hill(tmp_path / "hill.asc", 30.0)
    file = scenario(tmp_path, "{kind: elevation, elevation: {file: hill.asc}}")
    again = [f"terrain.slope_deg={load_scenario(file).terrain.slope_deg!r}"]
    assert load_scenario(file, again) == load_scenario(file), "as a run's folder has it"
    with pytest.raises(InputError, match=r"slope_deg = 60.0: would have no effect: .* own, 30,"):
        load_scenario(file, ["terrain.slope_deg=60"])


def test_a_bump_on_a_slope_stands_where_it_is(tmp_path: Path) -> None:
    """A bump, 0.2 m high and 1 m wide, 2 m up a 40 degree hill that rises towards -y: its top
    stands at x = 2.
    """
    x = CELL * np.arange(101)
    slope = math.radians(40.0)
    grid = -math.tan(slope) * np.tile(x[None, :], (101, 1))
    up = -(x[None, :] - x[50])
    grid += (
        0.2
        / math.cos(slope)
        * np.exp(-(((up - 2.0 * math.cos(slope)) ** 2 + (x[:, None] - x[50]) ** 2) / 0.5))
    )
    np.save(tmp_path / "bump.npy", grid)
    text = f"{{kind: elevation, elevation: {{file: bump.npy, cell_m: {CELL}}}, cell_m: 0.1}}"
    terrain = load_scenario(scenario(tmp_path, text)).terrain
    assert terrain.slope_deg == pytest.approx(40.0, abs=2.0)
    ground = make_ground(terrain)
    heights = ground.surface(np.array([[2.0, 0.0], [-2.0, 0.0], [0.0, 2.0], [0.0, -2.0]]))[0]
    assert heights[0] - heights[1:].mean() == pytest.approx(0.2, abs=0.05)


def test_npy_in_the_slopes_frame_is_taken_as_it_is(tmp_path: Path) -> None:
    grid = np.random.default_rng(0).normal(0.0, 0.03, (81, 81))
    np.save(tmp_path / "rough.npy", grid)
    text = "{kind: elevation, slope_deg: 50, elevation: {file: rough.npy, frame: slope}}"
    terrain = load_scenario(scenario(tmp_path, text)).terrain
    assert terrain.slope_deg == 50.0
    assert make_ground(terrain).heights_m == pytest.approx(grid, abs=1e-9)


@pytest.mark.geo
def test_geotiff_gives_the_same_as_esri_ascii(tmp_path: Path) -> None:
    rasterio = pytest.importorskip("rasterio")
    ascii_grid = read_elevation(hill(tmp_path / "hill.asc", 35.0, 20.0))
    rows = ascii_grid.heights_m.T[::-1]
    north = rasterio.transform.from_origin(1000.0 - CELL / 2, 5000.0 + 100.5 * CELL, CELL, CELL)
    with rasterio.open(
        tmp_path / "hill.tif",
        "w",
        driver="GTiff",
        width=101,
        height=101,
        count=1,
        dtype="float64",
        transform=north,
    ) as out:
        out.write(rows, 1)
    grid = read_elevation(tmp_path / "hill.tif")
    assert grid.heights_m == pytest.approx(ascii_grid.heights_m) and grid.cell_m == CELL
    assert grid.corner_m == pytest.approx(ascii_grid.corner_m)


def test_geotiff_without_its_library_asks_for_the_extra(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setitem(sys.modules, "rasterio", None)
    (tmp_path / "hill.tif").write_bytes(b"II*")
    with pytest.raises(InputError, match=r"needs the extra `geo`.*roboclimber-testbed\[geo\]"):
        read_elevation(tmp_path / "hill.tif")


@pytest.mark.parametrize(
    ("name", "content", "message"),
    [
        ("a.txt", b"1 2", "is no elevation file that can be read"),
        ("a.npy", b"no array", "is no array of numbers"),
        ("a.asc", b"ncols 3\nnrows 2\n1 2 3\n4 5 6\n", "cellsize: is missing in the header"),
        (
            "a.asc",
            b"ncols 3\nnrows 3\ncellsize 1\n1 2 3\n4 5 6\n",
            "does not hold what its header says",
        ),
        ("a.asc", b"ncols 2\nnrows 1\ncellsize 1\n1 x\n", "is no Esri ASCII grid"),
        ("a.asc", b"ncols 3\nnrows 2\ncellsize 1\n1 2 3\n4 5 6\n", "has too few points"),
    ],
)
def test_bad_elevation_files_are_refused_by_name(
    tmp_path: Path, name: str, content: bytes, message: str
) -> None:
    (tmp_path / name).write_bytes(content)
    with pytest.raises(InputError, match=message) as error:
        load_scenario(scenario(tmp_path, f"{{kind: elevation, elevation: {{file: {name}}}}}"))
    assert name in str(error.value)


@pytest.mark.parametrize(
    ("terrain", "message"),
    [
        ("{kind: elevation}", "kind elevation and the section elevation go together"),
        (
            "{kind: elevation, elevation: {file: gone.asc}}",
            "terrain.elevation.file = 'gone.asc': no such file",
        ),
        (
            "{kind: elevation, elevation: {file: hill.asc, centre_m: [0, 0]}}",
            "lies beside the file's grid",
        ),
        (
            "{kind: elevation, elevation: {file: hill.asc, centre_m: [1001, 5001]}}",
            "leaves too little ground",
        ),
        (
            "{kind: elevation, elevation: {file: hill.asc, cell_m: 1}}",
            "is given by the file itself",
        ),
        ("{kind: elevation, elevation: {file: hole.asc}}", "has holes"),
        ("{kind: profile}", "kind profile and profile_m go together"),
        ("{kind: profile, profile_m: [[1, 0], [0, 0]]}", "goes from x = 1 to 0"),
        ("{profile_m: [[0, 0], [1, 0]]}", "kind profile and profile_m go together"),
        ("{patches: [{foot: xx}]}", "terrain.patches.0.foot = 'xx'"),
        ("{patches: [{friction: -1}]}", "terrain.patches.0.friction = -1"),
    ],
)
def test_impossible_grounds_are_refused_in_one_line(
    tmp_path: Path, terrain: str, message: str
) -> None:
    text = hill(tmp_path / "hill.asc", 30.0).read_text()
    lines = text.splitlines()
    row = lines[56].split()
    lines[56] = " ".join([*row[:50], "-9999", *row[51:]])
    (tmp_path / "hole.asc").write_text("\n".join(lines))
    with pytest.raises(InputError, match=message):
        make_ground(load_scenario(scenario(tmp_path, terrain)).terrain)


def test_profile_heights_and_normals_by_hand() -> None:
    """A step of 0.2 m at x = 0, then a ramp of 45 degrees from x = 1 to 2, on a slope of 30
    degrees.
    """
    terrain = Terrain(
        kind="profile", slope_deg=30.0, profile_m=((0.0, 0.0), (0.0, 0.2), (1.0, 0.2), (2.0, 1.2))
    )
    ground = make_ground(terrain)
    heights, normals = ground.surface(np.array([[-1.0, 0.3], [0.5, 0.0], [1.5, 0.0], [5.0, 0.0]]))
    assert heights == pytest.approx([0.0, 0.2, 0.7, 1.2])
    assert normals[[0, 1, 3]] == pytest.approx(np.tile([-0.5, 0.0, math.sqrt(3) / 2], (3, 1)))
    angle = math.radians(75.0)
    assert normals[2] == pytest.approx([-math.sin(angle), 0.0, math.cos(angle)])
    sizes, places, _ = ground.boxes()
    assert len(sizes) == 5 and sizes[1][0] == pytest.approx(0.1)
    assert places[1] == pytest.approx([0.3, 0.0, 0.1])


def test_grid_normals_are_the_gradients() -> None:
    terrain = Terrain(kind="heightfield", roughness_m=0.05, roughness_seed=2)
    ground = make_ground(terrain)
    points = np.random.default_rng(1).uniform(-5.0, 5.0, (30, 2))
    points = (np.floor(points / 0.1) + 0.5) * 0.1  # cell middles: the difference stays in the cell
    step = 1e-4
    heights, normals = ground.surface(points)
    for k in range(2):
        move = np.zeros(2)
        move[k] = step
        rise = (ground.surface(points + move)[0] - ground.surface(points - move)[0]) / (2 * step)
        assert -normals[:, k] / normals[:, 2] == pytest.approx(rise, abs=1e-6)
    assert np.abs(heights).max() < 0.3


def test_settlement_keeps_what_it_had_and_forgets_its_delay() -> None:
    """10 kN on 1e6 N/m settle 10 mm, 63 % of it in the time constant; 5 kN then give nothing
    back.
    """
    assert settled(0.0, 1e4, 1e6, 0.5, 0.5) == pytest.approx(0.01 * (1 - math.exp(-1.0)))
    assert settled(0.0, 1e4, 1e6, 0.5, 100.0) == pytest.approx(0.01)
    assert settled(0.01, 5e3, 1e6, 0.5, 100.0) == 0.01
    halves = settled(settled(0.0, 1e4, 1e6, 0.5, 0.1), 1e4, 1e6, 0.5, 0.1)
    assert halves == pytest.approx(settled(0.0, 1e4, 1e6, 0.5, 0.2))


class Told:
    """Keeps what the ground is told."""

    def __init__(self) -> None:
        self.footings: list[tuple] = []
        self.sunk: list[tuple] = []

    def set_footing(self, *what: object) -> None:
        self.footings.append(what)

    def sink_ground(self, *what: object) -> None:
        self.sunk.append(what)


def test_friction_follows_a_sliding_foot_and_stiffness_waits_until_it_is_lifted() -> None:
    patch = {"foot": "fl", "radius_m": 0.3, "friction": 0.2, "stiffness_n_m": 1e6}
    terrain = Terrain.model_validate({"patches": [patch]})
    ground, engine = make_ground(terrain), Told()
    feet = np.array([[1.0, 0.8, 0.0], [1.0, -0.8, 0.0], [-1.0, 0.8, 0.0], [-1.0, -0.8, 0.0]])
    footing = Footing(terrain, ground, engine, feet)  # type: ignore[arg-type]
    assert footing.stiffness_n_m.tolist() == [1e6, 1e8, 1e8, 1e8]
    engine.footings.clear()
    feet[0, 0] = 2.0
    footing.update(lambda: feet, np.full(4, 1e4), np.zeros((4, 3)), 0.01)
    assert engine.footings == [(0, 0.7, 1e6, 2e5)]
    footing.update(lambda: feet, np.array([0.0, 1e4, 1e4, 1e4]), np.zeros((4, 3)), 0.01)
    assert engine.footings[1:] == [(0, 0.7, 1e8, 2e5)]


def test_a_footprint_stays_and_fresh_ground_is_where_it_was() -> None:
    terrain = Terrain(plastic_n_m=1e6, settle_s=0.1)
    footing = Footing(terrain, make_ground(terrain), Told(), np.zeros((4, 3)))  # type: ignore[arg-type]
    feet, normals, loaded, free = np.zeros((4, 3)), np.zeros((4, 3)), np.full(4, 1e4), np.zeros(4)
    for _ in range(300):
        footing.update(lambda: feet, loaded, normals, 0.01)
    assert footing.settlement_m == pytest.approx(np.full(4, 0.01))
    feet[:, 2] = 0.05
    footing.update(lambda: feet, free, normals, 0.01)
    assert footing.settlement_m == pytest.approx(np.full(4, 0.01))
    feet[0, 0] = 0.2
    footing.update(lambda: feet, free, normals, 0.01)
    assert footing.settlement_m == pytest.approx([0.0, 0.01, 0.01, 0.01])


@pytest.mark.parametrize(
    "overrides",
    [
        ["terrain.kind=heightfield", "terrain.roughness_m=0.05"],
        ["terrain.kind=profile", "terrain.profile_m=[[0.1, 0], [0.1, 0.12]]"],
        ["terrain.patches=[{foot: fl, stiffness_n_m: 1.0e6}]"],
    ],
)
def test_a_stand_on_uneven_or_soft_ground_begins_at_rest(overrides: list[str]) -> None:
    """No foot drops or presses: the body stays within 0.2 mm in the first half second, and every
    foot carries.
    """
    world = Simulation(load_scenario("stand_slope_45", overrides, duration=1.0))
    try:
        _, truth = world.run_block(500)
    finally:
        world.close()
    columns = {name: truth[:, k] for k, name in enumerate(world.truth_columns)}
    for axis in "xyz":
        assert np.ptp(columns[f"body_pose_in_world_{axis}"]) < 2e-4
    assert all(
        columns[f"contact_normal_{leg}"][10:].min() > 2000.0 for leg in ("fl", "fr", "rl", "rr")
    )


def test_a_foot_on_loose_ground_hands_its_load_to_the_other_diagonal() -> None:
    """Twelve stiff legs: 2 mm of settlement under one foot unload it and its opposite, and load the
    two others.
    """
    patch = "terrain.patches=[{foot: fl, plastic_n_m: 3.0e5, stiffness_n_m: 5.0e6}]"
    world = Simulation(load_scenario("stand_slope_45", [patch], duration=3.0))
    try:
        _, truth = world.run_block(2500)
        settlement = world_summary(world)["settlement_m"]
    finally:
        world.close()
    fl, fr, rl, rr = truth[-500:, 24:28].mean(axis=0)
    assert fl < 1000.0 and rr < 1500.0 and min(fr, rl) > 11000.0
    assert 1e-3 < settlement["fl"] < 1e-2 and settlement["fr"] == 0.0


RAIN = "events=[{kind: set_friction, at_s: 0.1, friction: 0.2}]"


@pytest.mark.parametrize(
    ("own", "expected"),
    [("friction: 0.7, damping_n_s_m: 1.0e5", 0.7), ("stiffness_n_m: 5.0e7", 0.2)],
)
def test_rain_wets_the_ground_but_for_patches_that_have_a_friction(
    own: str, expected: float
) -> None:
    """Also where a patch has the very friction that the ground had before."""
    patch = f"terrain.patches=[{{foot: fl, radius_m: 0.3, {own}}}]"
    world = Simulation(load_scenario("stand_flat", [RAIN, patch, "terrain.friction=0.7"], 1, 0.3))
    try:
        world.run_block(300)
        assert world.machine.engine.state()["footing"][:, 0] == pytest.approx(
            [expected] + 3 * [0.2]
        )
    finally:
        world.close()


@pytest.mark.slow
def test_a_robot_that_lies_on_its_belly_slides_when_rain_wets_the_slope() -> None:
    """On 20 degrees it comes down by (sin - mu cos) g t^2 / 2, 0.4 m in 0.5 s at friction 0.02."""
    lying = ["robot.vertical_m=0", "terrain.slope_deg=20", "ropes.enabled=false"]
    wet = "events=[{kind: set_friction, at_s: 0.3, friction: 0.02}]"
    ways = []
    for changes in ([], [wet]):
        world = Simulation(load_scenario("stand_slope_45", [*lying, *changes], 1, 0.8))
        try:
            truth = world.run_block(800)[1]
            x, z = (world.truth_columns.index(f"body_pose_in_world_{axis}") for axis in "xz")
            ways.append(float(np.hypot(*(truth[-1] - truth[0])[[x, z]])))
        finally:
            world.close()
    slope = math.radians(20.0)
    free = 0.5 * 9.81 * 0.5**2 * (math.sin(slope) - 0.02 * math.cos(slope))
    assert ways[0] < 0.02 and ways[1] == pytest.approx(free, rel=0.1)
