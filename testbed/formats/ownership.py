"""One owner a folder: two processes that write into one folder would mix their files.

The lock is the operating system's, on the folder itself: it leaves no file behind, and it ends with
its process, however that ends. Reading needs no lock.
"""

from __future__ import annotations

import os
import warnings
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from testbed.errors import InputError
from testbed.formats.files import make_folder


class OccupiedError(InputError):
    """Another process (or another block of this one) owns the folder."""


@contextmanager
def owned(folder: str | Path, field: str | None = "--out") -> Iterator[Path]:
    """Make `folder` and own it while the block runs; yields its path.

    Raises OccupiedError, in `field`, where another process (or another block of this one) owns it,
    InputError where nothing can be written in it. A folder inside an owned one has its own owner.
    """
    folder = make_folder(folder, field)
    handle = os.open(folder, os.O_RDONLY)
    try:
        _lock(handle, folder, field)
        yield folder
    finally:
        os.close(handle)  # and with it the lock


def _lock(handle: int, folder: Path, field: str | None) -> None:
    import fcntl

    try:
        fcntl.flock(handle, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except BlockingIOError as error:
        raise OccupiedError(
            "another testbed process is writing there",
            file=folder,
            field=field,
            allowed="another folder, or wait until that process has ended",
        ) from error
    except OSError as error:  # some network file systems know no locks
        warnings.warn(
            f"{folder}: cannot be locked ({error.strerror}); let nothing else write there",
            stacklevel=4,
        )
