"""Work under bad conditions: disks that are full or read-only, a clock that jumps, two owners."""

from __future__ import annotations

import os
import random
import resource
import shutil
import signal
import stat
import subprocess
import tempfile
import time
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager, suppress
from functools import cache, partial
from pathlib import Path
from typing import Any

import numpy as np

from testbed.benchmarks.harness import run
from testbed.benchmarks.soak.interrupted import SWEEP, Stands, recorded_rows
from testbed.benchmarks.soak.sandbox import Ended, Judged, Work, begun, by_command, ended, forked
from testbed.benchmarks.soak.spoilt_files import not_whole
from testbed.errors import InputError

DAY_S = 86_400.0
Writer = Callable[[Path, Path], Work]
"""What writes: of a run that is there already, and of a folder to write in."""


def _writes_run(_: Path, out: Path) -> Work:
    return by_command("run", "stand_flat", "--duration", "0.5", "--out", str(out / "run"))


def _writes_sweep(_: Path, out: Path) -> Work:
    sweep = out.parent / "sweep.yaml"
    sweep.write_text(SWEEP)
    return by_command("sweep", str(sweep), "--out", str(out / "sweep"))


def _writes_benchmark(_: Path, out: Path) -> Work:
    return partial(run, Stands(), out / "stands")


def _writes_forces(run: Path, out: Path) -> Work:
    return by_command("estimate", str(run), "--out", str(out / "forces.parquet"))


def _writes_contact(run: Path, out: Path) -> Work:
    return by_command("detect", str(run), "--out", str(out / "contact.csv"))


def _writes_export(run: Path, out: Path) -> Work:
    return by_command("export", str(run), "--out", str(out / "run.csv"))


def _writes_state(_: Path, out: Path) -> Work:
    return by_command("save", "stand_flat", "--at", "0.1", "--out", str(out / "state.npz"))


WRITERS: Sequence[Writer] = (
    *(_writes_run, _writes_sweep, _writes_benchmark),
    *(_writes_forces, _writes_contact, _writes_export, _writes_state),
)


def full_disk(folder: Path, rng: np.random.Generator) -> Judged:
    """No file may grow beyond some thousand bytes, or a small disk is full: one line names the
    place, nothing is half there.
    """
    out, recorded = folder / "out", _run_to_read()
    work = WRITERS[int(rng.integers(len(WRITERS)))](recorded, out)
    size = int(10 ** rng.uniform(2.5, 6.0))
    if rng.random() < 0.5:
        with _small_disk(out, size) as made:
            if made:
                return _kept(forked(work), out)
    out.mkdir(exist_ok=True)
    return _kept(forked(partial(_within, size, work)), out)


def read_only_disk(folder: Path, rng: np.random.Generator) -> Judged:
    """Nothing can be written: one line reports it before the work begins."""
    out = folder / "out"
    out.mkdir()
    work = WRITERS[int(rng.integers(len(WRITERS)))](_run_to_read(), out)
    with _read_only(out) as made:
        if not made:
            return "left out", ""
        started = time.monotonic()
        outcome, wrong = forked(work).judged
        late = time.monotonic() - started > 60.0
    if outcome == "served":
        return outcome, "it says that it has written"
    return outcome, wrong or ("it was said late" if late else "")


def jumping_clock(folder: Path, rng: np.random.Generator) -> Judged:
    """The clock on the wall jumps by days to and fro while a run records: the same bits."""
    out = folder / "run"
    work = by_command("run", "stand_slope_45", "--duration", "0.5", "--out", str(out))
    done = forked(partial(_with_clock, int(rng.integers(2**31)), work))
    outcome, wrong = done.judged
    if wrong or outcome != "served":
        return outcome, wrong or "the run was not made"
    return outcome, "" if recorded_rows(out) == recorded_rows(_run_to_read()) else "other bits"


def two_owners(folder: Path, rng: np.random.Generator) -> Judged:
    """The same command twice at once on one folder: one has it and the other is refused, or both
    share the work; the files are those of one alone.
    """
    out = folder / "out"
    works = (
        by_command("run", "stand_slope_45", "--duration", "0.5", "--out", str(out)),
        _writes_sweep(out, out),
        partial(run, Stands(), out),
    )
    work = works[int(rng.integers(len(works)))]
    first = begun(work)
    time.sleep(float(rng.uniform(0.0, 1.0)))
    both = [ended(child) for child in (begun(work), first)]
    outcomes = sorted(done.judged[0] for done in both)
    if wrong := "".join(done.judged[1] for done in both):
        return "fell over", wrong
    if "served" not in outcomes:
        return " and ".join(outcomes), "nobody had it"
    if work is works[0]:
        same = recorded_rows(out) == recorded_rows(_run_to_read())
        return " and ".join(outcomes), "" if same else "other bits than of one owner"
    again = ended(begun(work)).judged
    return " and ".join(outcomes), again[1] or ("" if again[0] == "served" else "it does not go on")


# ---- conditions ----------------------------------------------------------------------------------


def _within(size: int, work: Work) -> None:
    """Do it where no file may be larger than so many bytes."""
    signal.signal(signal.SIGXFSZ, signal.SIG_IGN)
    resource.setrlimit(resource.RLIMIT_FSIZE, (size, size))
    work()


@contextmanager
def _small_disk(place: Path, size: int) -> Iterator[bool]:
    """A file system of so many bytes; yields False where nobody lets one make it."""
    place.mkdir()
    pages = max(size // 4096, 4) * 4096
    with _mounted(place, f"size={pages}") as made:
        yield made


@contextmanager
def _read_only(place: Path) -> Iterator[bool]:
    """Nothing can be written in a folder, not by root either; yields False where that cannot be."""
    if os.geteuid() == 0:
        with _mounted(place, "ro") as made:
            yield made
        return
    place.chmod(stat.S_IREAD | stat.S_IEXEC)
    try:
        yield True
    finally:
        place.chmod(stat.S_IRWXU)


@contextmanager
def _mounted(place: Path, option: str) -> Iterator[bool]:
    command = ["mount", "-t", "tmpfs", "-o", option, "tmpfs", str(place)]
    made = False
    with suppress(OSError):
        made = subprocess.run(command, capture_output=True, check=False).returncode == 0
    try:
        yield made
    finally:
        if made:
            subprocess.run(["umount", str(place)], check=True)


def _with_clock(seed: int, work: Work) -> None:
    """Do it by a clock that jumps by up to a day, either way, each time that it is looked at."""
    jumps, true_s, true_ns = random.Random(seed), time.time, time.time_ns

    def wall_s() -> float:
        return true_s() + jumps.uniform(-DAY_S, DAY_S)

    time.time, time.time_ns = wall_s, lambda: true_ns() + int(1e9 * jumps.uniform(-DAY_S, DAY_S))
    work()


# ---- what is looked at afterwards ----------------------------------------------------------------


def _kept(done: Ended, out: Path) -> Judged:
    """How it ended, and whether what lies there can be read."""
    outcome, wrong = done.judged
    if wrong:
        return outcome, wrong
    for found in sorted(out.rglob("*")):
        if found.name.startswith("."):
            continue
        if problem := _broken(found):
            return outcome, f"{found.relative_to(out)} {problem}"
    return outcome, ""


def _broken(file: Path) -> str:
    """What is wrong with a file that is there under its own name."""
    from testbed.formats.files import read_json
    from testbed.formats.table import read_parquet
    from testbed.formats.yaml_files import read_yaml

    readers: dict[str, Callable[[Path], Any]] = {
        ".json": read_json,
        ".yaml": read_yaml,
        ".parquet": read_parquet,
        ".npz": np.load,
    }
    if file.suffix not in readers or not file.is_file():
        return ""
    try:
        readers[file.suffix](file)
    except (InputError, OSError, ValueError) as error:
        return f"is half there: {error}"
    return ""


@cache
def _run_to_read() -> Path:
    """A run of half a second, made once in this process and gone with it."""
    import atexit

    place = Path(tempfile.mkdtemp(prefix="soak-"))
    atexit.register(shutil.rmtree, place, ignore_errors=True)
    out = place / "run"
    done = forked(by_command("run", "stand_slope_45", "--duration", "0.5", "--out", str(out)))
    if done.status != 0 or not_whole(out):
        raise RuntimeError(f"no run to read could be made: {done.said[-200:]}")
    return out
