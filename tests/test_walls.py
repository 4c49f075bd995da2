"""The house's walls, kept by reading the imports (and, for the belief wall, the names) of every
source file.
"""

from __future__ import annotations

import ast
from functools import cache
from pathlib import Path

import pytest

import testbed

PACKAGE = Path(testbed.__file__).parent
ROOMS = (
    "formats",
    "machine",
    "scenario",
    "recording",
    "laws",
    "effects",
    "robot",
    "estimation",
    "control",
    "world",
    "simulation",
    "envs",
    "diagnosis",
    "report",
    "workflows",
    "benchmarks",
    "cli",
)
"""Imports go up this list only. What the machine's electronics do (estimation, control) stands
below the world that runs them, so that it cannot see it."""
BELOW_THE_WORLD = ROOMS[: ROOMS.index("world")]
GROUND = ("errors", "resources", "compiled", "__init__", "__main__")
FILES = sorted(p for p in PACKAGE.rglob("*.py") if "data" not in p.relative_to(PACKAGE).parts)


def _room(path: Path) -> str:
    first = path.relative_to(PACKAGE).parts[0]
    return first.removesuffix(".py")


@cache
def _tree(path: Path) -> ast.Module:
    return ast.parse(path.read_text())


@cache
def _imports(path: Path) -> set[str]:
    """Every module that a file imports, inside functions too; `from a import b` counts as `a.b`."""
    found: set[str] = set()
    for node in ast.walk(_tree(path)):
        if isinstance(node, ast.Import):
            found |= {alias.name for alias in node.names}
        elif isinstance(node, ast.ImportFrom):
            assert node.level == 0, f"{path}: relative import"
            found |= {f"{node.module}.{alias.name}" for alias in node.names}
    return found


def _importers(*packages: str) -> set[str]:
    """Files (relative to the package) that import one of `packages`."""
    return {
        p.relative_to(PACKAGE).as_posix()
        for p in FILES
        if any(name.split(".")[0] in packages for name in _imports(p))
    }


def test_every_room_is_in_the_list() -> None:
    rooms = {_room(p) for p in FILES} - set(GROUND)
    assert rooms <= set(ROOMS)
    assert {
        "machine",
        "laws",
        "robot",
        "estimation",
        "world",
        "simulation",
        "benchmarks",
        "cli",
    } <= rooms


@pytest.mark.parametrize("room", ROOMS)
def test_imports_only_go_up(room: str) -> None:
    higher = ROOMS[ROOMS.index(room) + 1 :]
    wrong = {
        f"{p.relative_to(PACKAGE)} imports {name}"
        for p in FILES
        if _room(p) == room
        for name in _imports(p)
        if name.startswith("testbed.") and name.split(".")[1] in higher
    }
    assert wrong == set()


def test_truth_wall_estimation_control_and_diagnosis_never_import_the_world() -> None:
    wrong = {
        str(p.relative_to(PACKAGE))
        for p in FILES
        if _room(p)
        in ("estimation", "control", "diagnosis", "robot", "effects", "laws", "parameters")
        and any(name.startswith("testbed.world") for name in _imports(p))
    }
    assert wrong == set()


def test_truth_wall_below_the_world_and_in_the_diagnosis_nobody_names_the_truth_file() -> None:
    readers = {
        _room(p) for p in FILES if "truth.parquet" in p.read_text() or "read_run" in p.read_text()
    }
    assert readers <= {
        "world",
        "simulation",
        "benchmarks",
        "report",
        "workflows",
        "cli",
        "__init__",
    }


def test_engine_wall_one_file_imports_pybullet() -> None:
    assert _importers("pybullet", "pybullet_data", "pybullet_utils") == {"world/engine.py"}


def test_engine_wall_pinocchio_stays_in_robot() -> None:
    importers = _importers("pinocchio")
    assert importers and {name.split("/")[0] for name in importers} == {"robot"}


def test_engine_wall_gymnasium_stays_in_envs() -> None:
    assert {name.split("/")[0] for name in _importers("gymnasium")} <= {"envs"}


def test_belief_wall_undeclared_effects_reach_the_world_only() -> None:
    """Below the world nobody may even ask a scenario for its undeclared effects; the recording must
    not hold them.
    """
    readers = set()
    for path in FILES:
        names = {node.attr for node in ast.walk(_tree(path)) if isinstance(node, ast.Attribute)}
        if "undeclared" in names:
            readers.add(path.relative_to(PACKAGE).as_posix())
    assert {name.split("/")[0] for name in readers} <= {"world", "simulation", "benchmarks", "envs"}
    assert "simulation/run_folder.py" not in readers


def _callers(*functions: str) -> set[str]:
    """Files that call one of `functions` by its bare name or as an attribute."""
    found = set()
    for path in FILES:
        for node in ast.walk(_tree(path)):
            if isinstance(node, ast.Call):
                called = node.func
                name = called.attr if isinstance(called, ast.Attribute) else None
                name = called.id if isinstance(called, ast.Name) else name
                if name in functions:
                    found.add(path.relative_to(PACKAGE).as_posix())
    return found


def test_machine_wall_nobody_asks_for_the_machine() -> None:
    """A scenario's two machines are built in scenario/machines.py; who works with one gets it
    handed in.

    What stands above a run builds its own through the same function: the reader of recordings from
    what they declare, the command line, what looks at the folder of a machine, benchmarks, the
    environments for their ranges, the writer of the shipped URDF, what compiles the contacts on
    some machine before the first run, and what makes ready to draw a run that has no folder yet.
    """
    builders = {name for name in _callers("build_machine") if not name.startswith("benchmarks/")}
    assert builders == {
        "scenario/machines.py",
        "recording/robot.py",
        "robot/urdf/generate.py",
        "simulation/runs.py",
        "workflows/machines.py",
        "world/first_start.py",
        "cli/models.py",
    }
    both = {name for name in _callers("machines_of") if not name.startswith("benchmarks/")}
    assert both == {
        "scenario/feasibility.py",
        "scenario/scenario.py",
        "world/simulation.py",
        "simulation/replay.py",
        "workflows/report.py",
        "simulation/runs.py",
        "report/scene3d.py",
        "envs/base.py",
    }
    readers = {
        p.relative_to(PACKAGE).as_posix() for p in FILES if "read_quantities(" in p.read_text()
    }
    assert readers == {
        "machine/provenance.py",
        "machine/build.py",
        "machine/folder.py",
    }


def test_report_only_renders() -> None:
    """It reads no folder and writes no page: use cases do. The viewer's own file is what scene3d is
    for.
    """
    doing = {
        "read_run",
        "read_rig",
        "read_robot",
        "write_text",
        "write_json",
        "owned",
        "run_scenario",
    }
    wrong = {
        p.name
        for p in FILES
        if _room(p) == "report" and {name.split(".")[-1] for name in _imports(p)} & doing
    }
    assert wrong <= {"scene3d.py"}


WRENCHES = {"estimation/live/wrench.py": "wrench", "robot/contact/geometry.py": "out gradient maps"}
"""Forces and moments in one array of six: fx, fy, fz, tx, ty, tz."""


def test_compiled_functions_address_quantities_by_name_and_not_by_number() -> None:
    """Beyond x, y, z (and w) no literal stands where an array is addressed; the independent
    references among the benchmarks keep the state vectors of their solvers.
    """
    found = set()
    for path in FILES:
        where = path.relative_to(PACKAGE).as_posix()
        for function in ast.walk(_tree(path)):
            if not isinstance(function, ast.FunctionDef) or where.startswith("benchmarks/"):
                continue
            if not any("njit" in ast.unparse(decorator) for decorator in function.decorator_list):
                continue
            for node in ast.walk(function):
                if not isinstance(node, ast.Subscript) or _greatest_literal(node.slice) <= 3:
                    continue
                if ast.unparse(node.value) not in WRENCHES.get(where, "").split():
                    found.add(f"{where}:{node.lineno} {ast.unparse(node)}")
    assert found == set()


def _greatest_literal(place: ast.expr) -> int:
    numbers = [n.value for n in ast.walk(place) if isinstance(n, ast.Constant)]
    return max((number for number in numbers if isinstance(number, int)), default=0)
