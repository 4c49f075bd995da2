"""Files that are there whole or not at all, and the one line that says why one cannot be
written.
"""

from __future__ import annotations

import errno
import json
import math
import os
import shutil
import warnings
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import Any

from testbed.errors import InputError

MOST_JSON_BYTES = 100_000_000


def make_folder(folder: str | Path, field: str | None = "--out") -> Path:
    """Make a folder and see that a file can be made in it: before the work begins, not after it.

    Raises InputError, in `field`, where that cannot be.
    """
    folder = Path(folder)
    probe = folder / ".writable"
    try:
        folder.mkdir(parents=True, exist_ok=True)
        probe.touch()
        probe.unlink(missing_ok=True)  # another process may be at the same
    except OSError as error:
        raise _unwritable(folder, error, field) from error
    return folder


def check_file(
    path: str | Path, endings: Sequence[str] = (), field: str = "--out", within: Path | None = None
) -> Path:
    """See that a file (with one of these endings, if any are given) can be made: before the work
    begins, not after it.

    `within`: a folder that the work makes. Raises InputError, in `field`, where the file cannot be
    made; an older one stays as it is.
    """
    path = Path(path)
    _check_name(path, field)
    if endings and path.suffix not in endings:
        raise InputError("unknown ending", file=path, field=field, allowed=", ".join(endings))
    if path.parent.is_dir():
        make_folder(path.parent, field)
    elif within is None or path.parent.resolve() != within.resolve():
        raise InputError("its folder does not exist", file=path, field=field)
    return path


def _check_name(path: Path, field: str | None = None) -> None:
    """Refuse a name that is none, and what a file must not take the place of: a folder, a device, a
    pipe.
    """
    try:
        other = path.exists() and not path.is_file()
    except OSError as error:
        raise _unwritable(path, error, field) from error
    if not path.name:
        raise InputError("names no file", file=path, field=field, allowed="the name of a file")
    if other:
        raise InputError(
            "is no regular file", file=path, field=field, allowed="a new file, or one to replace"
        )


def check_space(folder: Path, needed_bytes: float, field: str = "--out") -> None:
    """See that so many bytes are free where `folder` is: before the work begins, not after it.
    Raises InputError.
    """
    free_bytes = shutil.disk_usage(folder).free
    if free_bytes < needed_bytes:
        raise InputError(
            f"has {free_bytes / 1e6:.1f} MB free, and about {needed_bytes / 1e6:.1f} MB will be written",
            file=folder,
            field=field,
            allowed="a disk with more room, or a shorter or coarser recording",
        )


def check_links(folder: str | Path) -> Path:
    """The folder, of unknown origin, once it is seen that what is read in it is its own.

    Raises InputError for a link in it that leads out of it.
    """
    folder = Path(folder)
    home = folder.resolve()
    for at, folders, files in os.walk(home):
        for link in (Path(at, name) for name in (*folders, *files)):
            if link.is_symlink() and not _leads_into(link, home):
                raise InputError(
                    "is a link to a place outside its folder",
                    file=folder / link.relative_to(home),
                    allowed="a file of the folder itself, or a link to one",
                )
    return folder


def _leads_into(link: Path, home: Path) -> bool:
    """Whether a link ends in a folder; one that goes round in circles ends nowhere."""
    try:
        return link.resolve().is_relative_to(home)
    except (OSError, RuntimeError):
        return False


def read_text(path: str | Path, most_bytes: int, allowed: str | None = None) -> str:
    """The text of a regular file of at most so many bytes, UTF-8.

    Raises InputError where it is missing, no regular file (a device never ends), larger, unreadable
    or no text; `allowed` says then what it should be.
    """
    path = Path(path)
    try:
        if not path.is_file():
            problem = "is not a file" if path.exists() else "no such file"
            raise InputError(problem, file=path, allowed=allowed)
        with path.open("rb") as file:
            found = file.read(most_bytes + 1)
        if len(found) > most_bytes:
            raise InputError("is too large", file=path, allowed=f"at most {most_bytes} bytes")
        return found.decode("utf-8-sig")
    except UnicodeDecodeError as error:
        raise InputError("is not text in UTF-8", file=path, allowed=allowed) from error
    except (OSError, ValueError) as error:  # ValueError: a null character in the name
        reason = getattr(error, "strerror", None) or error
        raise InputError(f"cannot be read: {reason}", file=path) from error


def read_json(path: str | Path) -> dict[str, Any]:
    """The object in a JSON file. Raises InputError where it cannot be read, is not JSON or no
    object.
    """
    try:
        found = json.loads(read_text(path, MOST_JSON_BYTES))
    except (ValueError, RecursionError) as error:
        raise InputError(f"is not valid JSON: {error}", file=path) from error
    if not isinstance(found, dict):
        raise InputError("must be an object of fields", file=path, value=found)
    return found


@contextmanager
def whole(path: Path) -> Iterator[Path]:
    """A hidden file beside `path` to write to; it takes the place of `path` at the end, or is gone
    with an exception.

    Raises InputError in place of an OSError, and for a `path` that is no file's: empty, a folder, a
    device, a pipe.
    """
    _check_name(path)
    hidden = path.with_name(f".{path.name}")
    try:
        yield hidden
        os.replace(hidden, path)
    except BaseException as error:
        with suppress(OSError):
            hidden.unlink()
        if isinstance(error, OSError):
            raise _unwritable(path, error) from error
        raise


def write_text(path: str | Path, text: str) -> None:
    """Write a text file, whole or not at all. Raises InputError where it cannot be written."""
    with whole(Path(path)) as hidden:
        hidden.write_text(text, encoding="utf-8", errors="replace")  # names of files may be no text


def write_json(path: str | Path, tree: Any) -> None:
    """Write `plain(tree)` as JSON, whole or not at all. Raises InputError where it cannot be
    written.
    """
    write_text(path, json.dumps(plain(tree), indent=1, ensure_ascii=False, allow_nan=False) + "\n")


class Lines:
    """A text file that grows by whole lines; what a killed process left of one stays a line of its
    own.
    """

    def __init__(self, path: Path) -> None:
        """Open or make it. Raises InputError where that cannot be."""
        self._path = path
        try:
            self._file = path.open("a+b", buffering=0)
            if self._file.tell():
                self._file.seek(-1, os.SEEK_END)
                if self._file.read(1) != b"\n":
                    self.add("")
        except OSError as error:
            raise _unwritable(path, error) from error

    def add(self, line: str) -> None:
        """Hand one more line to the system, in one piece. Raises InputError where it does not take
        all of it.
        """
        data = line.encode() + b"\n"
        try:
            if self._file.write(data) != len(data):
                raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))
        except OSError as error:
            raise _unwritable(self._path, error) from error

    def close(self) -> None:
        """No more lines."""
        self._file.close()


def plain(value: Any) -> Any:
    """`value` as JSON knows it: numpy's numbers and arrays unwrapped, what is not a finite number
    null.
    """
    if isinstance(value, Mapping):
        return {str(name): plain(number) for name, number in value.items()}
    if isinstance(value, list | tuple):
        return [plain(item) for item in value]
    if hasattr(value, "tolist"):  # of numpy
        return plain(value.tolist())
    if isinstance(value, float) and not math.isfinite(value):
        return None
    return value


def _unwritable(path: Path, error: OSError, field: str | None = None) -> InputError:
    return InputError(f"cannot be written: {error.strerror or error}", file=path, field=field)


# One owner a folder: two processes that write into one folder would mix their files.
#
# The lock is the operating system's, on the folder itself: it leaves no file behind, and it ends
# with its process, however that ends. Reading needs no lock. A copy that the process makes of
# itself shares the lock unless it lets go: it would keep a killed owner's folder until its own end.

_held: set[int] = set()
"""Handles through which this process owns folders."""


def _own_nothing() -> None:
    """In a new copy of this process."""
    while _held:
        os.close(_held.pop())


os.register_at_fork(after_in_child=_own_nothing)


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
    _held.add(handle)
    try:
        _lock(handle, folder, field)
        yield folder
    finally:
        if handle in _held:  # not so in a copy
            _held.remove(handle)
            os.close(handle)  # and with it the lock


@contextmanager
def resumable(folder: Path) -> Iterator[None]:
    """A Ctrl-C in the block goes on as one that says that the same command goes on in `folder`."""
    try:
        yield
    except KeyboardInterrupt as stop:
        raise KeyboardInterrupt(
            f"{folder} holds what is done; the same command goes on from there"
        ) from stop


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
