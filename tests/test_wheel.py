"""A wheel, installed outside the checkout, runs a shipped scenario by its name."""

from __future__ import annotations

import os
import subprocess
import sys
import sysconfig
import venv
import zipfile
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[1]


@pytest.fixture(scope="module")
def wheel(tmp_path_factory: pytest.TempPathFactory) -> Path:
    if not (ROOT / "pyproject.toml").is_file():
        pytest.skip("no checkout to build a wheel from")
    folder = tmp_path_factory.mktemp("dist")
    command = [sys.executable, "-m", "hatchling", "build", "-t", "wheel", "-d", str(folder)]
    subprocess.run(command, cwd=ROOT, check=True, capture_output=True)
    (found,) = folder.glob("*.whl")
    return found


@pytest.mark.slow
def test_the_wheel_carries_machine_scenarios_and_report(wheel: Path) -> None:
    names = zipfile.ZipFile(wheel).namelist()
    assert "testbed/data/urdf/roboclimber.urdf" in names
    assert "testbed/data/scenarios/drill_slope_45.yaml" in names
    assert "testbed/machine/roboclimber.yaml" in names
    assert "testbed/machine/workshop.yaml" in names
    assert "testbed/machine/shipped/climber_8t/robot.urdf" in names
    assert "testbed/report/run_report.html.j2" in names
    assert not [n for n in names if n.startswith(("tests/", ".ci/"))]


@pytest.mark.slow
def test_an_installed_wheel_runs_a_scenario_by_name(wheel: Path, tmp_path: Path) -> None:
    """The environment holds the wheel alone; what it depends on is borrowed from this one, nothing
    is downloaded.
    """
    home = tmp_path / "venv"
    venv.create(home, with_pip=False)
    python = home / "bin/python"
    subprocess.run(
        [
            sys.executable,
            "-m",
            "pip",
            "--python",
            str(python),
            "install",
            "--quiet",
            "--no-deps",
            "--no-index",
            str(wheel),
        ],
        check=True,
        capture_output=True,
    )
    site = next((home / "lib").glob("python3*/site-packages"))
    (site / "borrowed.pth").write_text(
        f"import site; site.addsitedir({sysconfig.get_path('purelib')!r})\n"
    )
    desk = tmp_path / "desk"
    desk.mkdir()
    environment = {k: v for k, v in os.environ.items() if k not in ("PYTHONPATH", "PYTHONHOME")}
    environment["NUMBA_DISABLE_JIT"] = (
        "1"  # compiling everything anew would take half a minute and tell nothing new
    )
    where = subprocess.run(
        [python, "-c", "import testbed; print(testbed.__file__)"],
        cwd=desk,
        env=environment,
        capture_output=True,
        text=True,
    )
    assert where.stdout.startswith(str(home))
    done = subprocess.run(
        [home / "bin/testbed", "run", "drill_slope_45", "--duration", "0.03"],
        cwd=desk,
        env=environment,
        capture_output=True,
        text=True,
    )
    assert done.returncode == 0, done.stderr
    assert "stood" in done.stdout
    assert (desk / "runs/drill_slope_45-1/report.html").is_file()
