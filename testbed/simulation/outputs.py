"""Where a run's files go: checked before anything is written, so that bad input leaves nothing
behind.
"""

from __future__ import annotations

import os
from collections.abc import Iterator
from contextlib import contextmanager
from itertools import count
from pathlib import Path

from testbed.errors import InputError
from testbed.formats.files import make_folder, owned

OWN_FILES = (
    "recording.yaml",
    "scenario.yaml",
    "data.parquet",
    "truth.parquet",
    "truth_machine.yaml",
    "summary.json",
    "pictures",
    "report.html",
)
"""What a run writes; a folder that holds nothing else may be written again."""
OF_A_RUN = ("scenario.yaml", "truth.parquet", "summary.json")
"""Files of a run, one of which is there from its start; a measured recording has none of them."""


def check_out(out: str | Path | None) -> None:
    """Refuse an output folder that cannot be used; writes nothing.

    Raises InputError where `out` is a file, cannot be written, or holds files that are not a run's
    or a recording that was measured.
    """
    folder = Path(out) if out is not None else Path("runs")
    if folder.exists() and not folder.is_dir():
        raise InputError(
            "is not a folder",
            file=folder,
            field="--out",
            allowed="a new or empty folder, or an earlier run",
        )
    if out is not None and folder.is_dir():
        foreign = sorted(path.name for path in folder.iterdir() if _own_name(path) not in OWN_FILES)
        if foreign:
            raise InputError(
                f"holds files of something else ({foreign[0]})",
                file=folder,
                field="--out",
                allowed="a new or empty folder, or an earlier run",
            )
        names = {_own_name(path) for path in folder.iterdir()}
        if names and names.isdisjoint(OF_A_RUN):
            raise InputError(
                "holds a recording that no run has made",
                file=folder,
                field="--out",
                allowed="a new or empty folder, or an earlier run",
            )
    parent = folder
    while not parent.exists():
        parent = parent.parent
    if not parent.is_dir() or not os.access(parent, os.W_OK | os.X_OK):
        raise InputError(
            "cannot be written", file=folder, field="--out", allowed="a folder you may write to"
        )


def _own_name(path: Path) -> str:
    """The name without what marks a file that was being written when its process was killed."""
    return path.name.removesuffix(".parts").removeprefix(".")


@contextmanager
def claimed(out: str | Path | None, name: str, seed: int) -> Iterator[Path]:
    """Make and own the output folder: `out`, or `runs/<name>-<seed>[-n]` that did not exist.

    An earlier run in `out` is removed. Raises InputError where the folder cannot be made or
    written, or where another process is writing there.
    """
    check_out(out)
    with owned(_next_free(f"{name}-{seed}") if out is None else out) as folder:
        try:
            remove_run(folder)
        except OSError as error:
            raise InputError(
                f"cannot be written: {error.strerror}", file=folder, field="--out"
            ) from error
        yield folder


def remove_run(folder: Path) -> None:
    """Remove the files of an earlier run, and nothing else."""
    import shutil

    for name in OWN_FILES:
        for path in (folder / name, folder / f"{name}.parts", folder / f".{name}"):
            if path.is_dir():
                shutil.rmtree(path)
            else:
                path.unlink(missing_ok=True)


def _next_free(stem: str) -> Path:
    parent = make_folder("runs")
    for number in count(1):
        folder = parent / (stem if number == 1 else f"{stem}-{number}")
        try:
            folder.mkdir()
            return folder
        except FileExistsError:
            continue
    raise AssertionError("unreachable")
