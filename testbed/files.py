"""Files that are there whole or not at all, and the one line that says why one cannot be written."""

from __future__ import annotations

import json
import math
import os
from collections.abc import Iterator, Mapping
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import Any

from testbed.errors import InputError


def make_folder(folder: str | Path, field: str = "--out") -> Path:
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


@contextmanager
def whole(path: Path) -> Iterator[Path]:
    """A hidden file beside `path` to write to; it takes the place of `path` at the end, or is gone with an exception.

    Raises InputError in place of an OSError.
    """
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
        hidden.write_text(text, encoding="utf-8")


def write_json(path: str | Path, tree: Any) -> None:
    """Write `plain(tree)` as JSON, whole or not at all. Raises InputError where it cannot be written."""
    write_text(path, json.dumps(plain(tree), indent=1, ensure_ascii=False, allow_nan=False) + "\n")


def plain(value: Any) -> Any:
    """`value` as JSON knows it: numpy's numbers and arrays unwrapped, what is not a finite number null."""
    if isinstance(value, Mapping):
        return {str(k): plain(v) for k, v in value.items()}
    if isinstance(value, list | tuple):
        return [plain(v) for v in value]
    if hasattr(value, "tolist"):  # of numpy
        return plain(value.tolist())
    if isinstance(value, float) and not math.isfinite(value):
        return None
    return value


def _unwritable(path: Path, error: OSError, field: str | None = None) -> InputError:
    return InputError(f"cannot be written: {error.strerror or error}", file=path, field=field)
