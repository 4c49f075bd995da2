"""A run from scenario to folder: same seed same bits, looking changes nothing, an interrupted run
is readable.
"""

from __future__ import annotations

import hashlib
import json
import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import numpy as np
import pyarrow.parquet as pq
import pytest
from command_line import completed, started

from testbed.scenario.scenario import load_scenario
from testbed.simulation.run import run_scenario
from testbed.simulation.runs import read_run
from testbed.workflows.estimate import estimate_file

METHODS = ("one_chamber", "two_chamber", "friction", "kbf", "modified_kbf")
FILES = [
    "data.parquet",
    "pictures",
    "recording.yaml",
    "scenario.yaml",
    "summary.json",
    "truth.parquet",
]


def _digest(folder: Path) -> str:
    return hashlib.sha256(
        b"".join((folder / f"{n}.parquet").read_bytes() for n in ("data", "truth"))
    ).hexdigest()


@pytest.fixture(scope="module")
def finished(tmp_path_factory: pytest.TempPathFactory) -> Path:
    scenario = load_scenario("drill_slope_45", ["task.start_s=0.1"], seed=4, duration=1.5)
    return run_scenario(scenario, tmp_path_factory.mktemp("runs") / "one").folder


def test_a_run_leaves_its_files(finished: Path) -> None:
    assert sorted(p.name for p in finished.iterdir()) == FILES


def test_the_scenario_in_the_folder_is_the_one_that_ran(finished: Path) -> None:
    assert load_scenario(finished / "scenario.yaml") == load_scenario(
        "drill_slope_45", ["task.start_s=0.1"], seed=4, duration=1.5
    )


def test_rows_come_at_the_recordings_rate_to_the_end(finished: Path) -> None:
    run = read_run(finished)
    assert np.allclose(run.data["t"], np.arange(1, 1501) / 1000.0, atol=1e-9)
    assert np.array_equal(run.data["t"], run.truth["t"])
    assert all(np.all(np.isfinite(c)) for c in (*run.data.values(), *run.truth.values()))


def test_the_columns_are_those_of_the_contract(finished: Path) -> None:
    run = read_run(finished)
    legs = ("fl", "fr", "rl", "rr")
    axes = [f"{leg}_{joint}" for leg in legs for joint in ("rotation", "radial", "vertical")]
    data = {
        "t",
        "supply_pressure",
        "oil_temperature",
        "rope_tension_left",
        "rope_tension_right",
        *(f"{q}_{a}" for a in axes for q in ("position", "pressure_a", "pressure_b", "valve")),
        *(f"attitude_{a}" for a in ("roll", "pitch", "yaw")),
        *(f"angular_rate_{i}" for i in "xyz"),
        *(f"specific_force_{i}" for i in "xyz"),
        *(f"estimate_{m}_{leg}" for leg in legs for m in METHODS),
        *(f"{q}_{leg}" for leg in legs for q in ("expected", "contact")),
    }
    truth = {
        "t",
        *(f"body_pose_in_world_{i}" for i in ("x", "y", "z", "qx", "qy", "qz", "qw")),
        *(f"foot_force_in_world_{leg}_{i}" for leg in legs for i in "xyz"),
        *(f"{q}_{leg}" for leg in legs for q in ("foot_load", "contact_normal")),
        *(f"rope_force_in_world_{s}_{i}" for s in ("left", "right") for i in "xyz"),
        *(f"drill_wrench_in_world_{i}" for i in ("fx", "fy", "fz", "tx", "ty", "tz")),
        *(f"friction_{a}" for a in axes),
    }
    assert data - set(run.data) == set()
    assert truth - set(run.truth) == set()
    assert set(run.meta["channels"]) == set(run.data)


def test_the_summary_says_how_it_ended_and_how_well_the_feet_were_read(finished: Path) -> None:
    summary = read_run(finished).summary
    assert summary is not None
    assert (summary["format"], summary["scenario"], summary["seed"]) == (
        "roboclimber-summary/1",
        "drill_slope_45",
        4,
    )
    assert (summary["verdict"], summary["simulated_s"]) == ("stood", pytest.approx(1.5))
    assert set(METHODS) <= set(summary["force_rms_n"])
    assert summary["lowest_stability_margin"] > 0.2
    assert summary["detector"]["missed"] == 0


def test_the_recording_holds_no_truth_and_nothing_undeclared(tmp_path: Path) -> None:
    scenario = load_scenario(
        "stand_undeclared_gain", ["hydraulics.parameters.oil.entrained_air=0.02"], duration=0.1
    )
    folder = run_scenario(scenario, tmp_path / "run").folder
    text = (folder / "recording.yaml").read_text()
    assert "gain_error" not in text and "sensor.gain_a" not in text and "undeclared:" not in text
    assert "gain_error" in (folder / "scenario.yaml").read_text()


def test_the_recording_alone_gives_the_loads_that_the_robot_saw(
    finished: Path, tmp_path: Path
) -> None:
    estimate_file(finished, None, tmp_path / "loads.parquet")
    found = pq.read_table(tmp_path / "loads.parquet")
    run = read_run(finished)
    for leg in ("fl", "fr", "rl", "rr"):
        difference = found[f"force_{leg}_n"].to_numpy() - run.data[f"estimate_own_{leg}"]
        assert np.abs(difference).max() < 1e-2
        assert np.all(
            found[f"force_{leg}_n_low"].to_numpy() <= found[f"force_{leg}_n_high"].to_numpy()
        )


def test_same_seed_same_bits_and_another_seed_others(finished: Path, tmp_path: Path) -> None:
    changes = ["task.start_s=0.1"]
    again = run_scenario(
        load_scenario("drill_slope_45", changes, seed=4, duration=1.5), tmp_path / "again"
    ).folder
    other = run_scenario(
        load_scenario("drill_slope_45", changes, seed=5, duration=1.5), tmp_path / "other"
    ).folder
    assert _digest(again) == _digest(finished)
    assert _digest(other) != _digest(finished)


def test_looking_does_not_change_what_is_looked_at() -> None:
    from testbed.world.simulation import Simulation

    rows = []
    for look in (False, True):
        simulation = Simulation(load_scenario("stand_slope_45", duration=0.2))
        try:
            for _ in range(4):
                rows.append(simulation.run_block(50)[1])
                if look:
                    assert simulation.picture(64, 48).shape == (48, 64, 3)
        finally:
            simulation.close()
    assert np.array_equal(np.vstack(rows[:4]), np.vstack(rows[4:]))


def test_a_number_that_is_none_ends_the_run_and_its_last_records_are_kept(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    from testbed.cli import main
    from testbed.world.simulation import Simulation

    whole = Simulation.run_steps

    def broken(self: Simulation, steps: int) -> object:
        if self._step >= 100:
            self.machine.board.axes[2].a.pressure = np.nan  # a pressure is lost
        return whole(self, steps)

    monkeypatch.setattr(Simulation, "run_steps", broken)
    changes = ["--set", "rates.record_hz=100", "--duration", "5", "--out", str(tmp_path / "run")]
    monkeypatch.setattr(sys, "argv", ["testbed", "run", "stand_flat", *changes])
    with pytest.raises(SystemExit) as end:
        main()
    assert end.value.code == 1
    line = capsys.readouterr().err
    assert line.count("\n") == 1 and "not finite" in line and str(tmp_path / "run") in line
    run = read_run(tmp_path / "run")
    assert run.summary is not None and run.summary["verdict"].startswith("fault: ")
    assert len(run.time_s) > 100  # the good second, and the rows that led to the fault


def test_a_load_of_a_thousand_weights_is_a_fault_of_the_simulation_and_no_physics(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    from testbed.errors import SimulationFault
    from testbed.world import compiled_step

    monkeypatch.setattr(compiled_step, "MOST_WEIGHTS", 0.01)
    with pytest.raises(
        SimulationFault, match=r"foot_force_in_world_.* N at t = .* machine's weight"
    ):
        run_scenario(load_scenario("stand_flat", duration=1.5), tmp_path / "run")
    summary = read_run(tmp_path / "run").summary
    assert summary is not None and summary["verdict"].startswith("fault: ")


@pytest.mark.slow
@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM])
def test_an_interrupted_run_is_finished_readable_and_says_so(
    tmp_path: Path, number: signal.Signals
) -> None:
    child = started("run", "stand_slope_45", "--duration", "600", "--out", tmp_path / "run")
    _wait_for_parts(child, tmp_path / "run/data.parquet")
    os.kill(child.pid, number)
    out, err = child.communicate(timeout=60)
    assert (child.returncode, err) == (130, "")
    assert "Interrupted" in out
    run = read_run(tmp_path / "run")
    assert run.summary is not None and run.summary["interrupted"] is True
    assert run.summary["simulated_s"] == pytest.approx(run.time_s[-1])
    assert (tmp_path / "run/report.html").is_file()


def test_a_run_that_an_interrupt_broke_off_says_so(tmp_path: Path) -> None:
    def second(_simulated_s: float, _word: str) -> None:
        raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        run_scenario(load_scenario("stand_flat", duration=2.0), tmp_path / "run", progress=second)
    summary = read_run(tmp_path / "run").summary
    assert summary is not None and summary["interrupted"] is True and summary["simulated_s"] < 1.5


@pytest.mark.slow
def test_a_killed_run_can_be_viewed(tmp_path: Path) -> None:
    child = started("run", "stand_slope_45", "--duration", "600", "--out", tmp_path / "run")
    _wait_for_parts(child, tmp_path / "run/truth.parquet")
    child.kill()
    child.communicate()
    assert read_run(tmp_path / "run").time_s[-1] >= 2.0
    done = completed("view", tmp_path / "run", check=True)
    assert "the run was killed" in Path(done.stdout.strip()).read_text()


@pytest.mark.slow
def test_json_on_standard_output_is_the_summary(tmp_path: Path) -> None:
    done = completed(
        "run", "stand_flat", "--duration", "0.3", "--out", tmp_path / "run", "--json", check=True
    )
    assert done.stderr == ""
    assert json.loads(done.stdout) == json.loads((tmp_path / "run/summary.json").read_text())


def _wait_for_parts(
    child: subprocess.Popen[str], folder: Path, count: int = 2, timeout_s: float = 90.0
) -> None:
    end = time.monotonic() + timeout_s
    while len(list(folder.glob("part-*"))) < count:
        assert child.poll() is None, f"ended too early: {child.communicate()}"
        assert time.monotonic() < end, "timed out"
        time.sleep(0.05)
