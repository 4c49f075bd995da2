"""A Dask cluster does the work: a worker that is killed loses nothing, and nothing that was done is
done again.
"""

from __future__ import annotations

import json
import os
import socket
import subprocess
import sys
import time
from collections import Counter
from collections.abc import Iterator
from pathlib import Path

import pytest
from counted_work import work

from testbed.errors import InputError
from testbed.scenario.sweep import load_sweep
from testbed.simulation.sweep import run_sweep
from testbed.simulation.workers import Workers, work_through

HERE = Path(__file__).parent
COUNT = 10


class Cluster:
    """A scheduler and two workers of one thread each on the loopback."""

    def __init__(self) -> None:
        with socket.socket() as free:
            free.bind(("127.0.0.1", 0))
            self.address = f"tcp://127.0.0.1:{free.getsockname()[1]}"
        port = self.address.rpartition(":")[2]
        paths = os.pathsep.join([str(HERE), str(HERE.parents[1]), os.environ.get("PYTHONPATH", "")])
        self._environment = os.environ | {"PYTHONPATH": paths, "OMP_NUM_THREADS": "1"}
        start = ["--host", "127.0.0.1", "--port", port, "--dashboard-address", ":0"]
        self.processes = [self._start("scheduler", *start)]
        self.processes += [
            self._start("worker", self.address, "--nthreads", "1", "--no-nanny", "--no-dashboard")
            for _ in range(2)
        ]
        self._wait()

    def _start(self, kind: str, *arguments: str) -> subprocess.Popen[bytes]:
        command = [sys.executable, "-m", f"distributed.cli.dask_{kind}", *arguments]
        quiet = subprocess.DEVNULL
        return subprocess.Popen(command, env=self._environment, stdout=quiet, stderr=quiet)

    def _wait(self) -> None:
        from distributed import Client

        for _ in range(100):
            try:
                with Client(self.address, timeout=3) as client:
                    client.wait_for_workers(2, timeout=60)
                    return
            except OSError:
                time.sleep(0.3)
        raise AssertionError("no cluster")

    def close(self) -> None:
        for process in reversed(self.processes):
            process.kill()
            process.wait()


@pytest.fixture
def cluster() -> Iterator[Cluster]:
    pytest.importorskip("distributed")
    made = Cluster()
    yield made
    made.close()


@pytest.mark.slow
def test_of_a_killed_worker_only_what_it_was_at_is_begun_again(
    cluster: Cluster, tmp_path: Path
) -> None:
    answers = []
    items = [(str(tmp_path), number) for number in range(COUNT)]
    for answer in work_through(work, items, Workers(cluster=cluster.address)):
        answers.append(answer)
        if len(answers) == 3:
            cluster.processes[1].kill()
    assert sorted(answers) == [number**2 for number in range(COUNT)]
    marks = [path.name.split("-") for path in tmp_path.iterdir()]
    began = Counter(int(mark[1]) for mark in marks if mark[0] == "began")
    ended = Counter(int(mark[1]) for mark in marks if mark[0] == "ended")
    assert set(ended) == set(range(COUNT))
    assert max(ended.values()) <= 2 and sum(began.values()) <= COUNT + 2
    assert len({mark[2] for mark in marks}) == 2  # both worked


@pytest.mark.slow
def test_a_sweep_goes_on_when_a_worker_is_killed_and_makes_every_run_once(
    cluster: Cluster, tmp_path: Path
) -> None:
    (tmp_path / "sweep.yaml").write_text(
        "format: roboclimber-sweep/1\nscenario: stand_flat\nduration_s: 0.2\nkeep: summary\nseeds: [1, 2, 3, 4, 5, 6]\n"
    )
    sweep, runs = load_sweep(tmp_path / "sweep.yaml")
    out, told, written = tmp_path / "out", [], {}

    def progress(done: int) -> None:
        told.append(done)
        for path in (out / "runs").glob("*/summary.json"):
            assert written.setdefault(path, path.stat().st_mtime_ns) == path.stat().st_mtime_ns
        if done == 2:
            cluster.processes[2].kill()

    results = run_sweep(sweep, runs, out, Workers(cluster=cluster.address), progress=progress)
    assert [entry["seed"] for entry in results] == [1, 2, 3, 4, 5, 6] and told[-1] == 6
    assert all(p.stat().st_mtime_ns == when for p, when in written.items())
    assert len(json.loads((out / "results.json").read_text())["runs"]) == 6


def test_a_scheduler_that_does_not_answer_is_one_line(monkeypatch: pytest.MonkeyPatch) -> None:
    pytest.importorskip("distributed")
    monkeypatch.setattr("testbed.simulation.workers.CONNECT_S", 0.2)
    with pytest.raises(InputError, match=r"--dask.*does not answer"):
        list(work_through(abs, [1, 2], Workers(cluster="tcp://127.0.0.1:9")))


def test_processes_here_and_a_cluster_are_one_or_the_other(monkeypatch: pytest.MonkeyPatch) -> None:
    with pytest.raises(InputError, match="--jobs"):
        Workers(2, "tcp://127.0.0.1:9")
    with pytest.raises(InputError, match="at least 1"):
        Workers(0)
    monkeypatch.setenv("TESTBED_DASK", "tcp://127.0.0.1:9")
    assert Workers.from_environment(4) == Workers(1, "tcp://127.0.0.1:9")
