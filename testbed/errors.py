"""The few named errors of the testbed; the command line turns them into one clear line and an exit
status.
"""

from __future__ import annotations

import difflib
import errno
from collections.abc import Collection, Iterator
from contextlib import contextmanager
from importlib import import_module
from pathlib import Path
from typing import Any


class InputError(Exception):
    """Something the user handed in cannot be used (exit status 2).

    The message is one line that names the file, the field, the value found and what is allowed.
    """

    def __init__(
        self,
        problem: str,
        *,
        file: str | Path | None = None,
        field: str | None = None,
        value: object = None,
        allowed: str | None = None,
    ) -> None:
        self.problem, self.file, self.field, self.value, self.allowed = (
            problem,
            file,
            field,
            value,
            allowed,
        )
        parts = [str(file)] if file is not None else []
        if field is not None:
            parts.append(field if value is None else f"{field} = {_short(value)}")
        elif value is not None:
            parts.append(_short(value))
        text = ": ".join([*parts, problem])
        if allowed is not None:
            text += f" (allowed: {allowed})"
        super().__init__(" ".join(text.split()))


def did_you_mean(value: object, names: Collection[object]) -> str:
    """The nearest of the allowed names as the end of a problem; empty where none is near."""
    near = difflib.get_close_matches(str(value), list(map(str, names)), n=1)
    return f", did you mean {near[0]!r}?" if near else ""


def check_one_of(
    value: object,
    names: Collection[object],
    field: str,
    problem: str,
    file: str | Path | None = None,
) -> None:
    """Raise InputError with what is allowed unless `value` is one of `names`."""
    if value not in names:
        allowed = ", ".join(map(str, names))
        problem += did_you_mean(value, names)
        raise InputError(problem, file=file, field=field, value=value, allowed=allowed)


@contextmanager
def naming(file: str | Path) -> Iterator[None]:
    """Name `file` in every InputError raised inside that names none."""
    try:
        yield
    except InputError as error:
        if error.file is not None:
            raise
        raise InputError(
            error.problem, file=file, field=error.field, value=error.value, allowed=error.allowed
        ) from error


class UserCodeError(InputError):
    """A file of the user's own raised an error, while it was imported or when it ran (exit status
    2).

    The message is one line that names the file, the line and what was raised.
    """

    def __init__(self, file: str | Path, line: int, raised: BaseException) -> None:
        self.line = line
        text = getattr(raised, "msg", None) or str(raised) or "no message"
        super().__init__(
            f"line {line} of your own file raised {type(raised).__name__}: {text}", file=file
        )

    def __reduce__(self) -> tuple[object, ...]:
        """Cross to another process by what it says: what was raised may not be picklable."""
        return _said_again, (type(self), self.args, self.__dict__)


def extra(package: str, name: str, instead: str = "", **place: Any) -> Any:
    """A package of the extra `name`, which may not be installed.

    Raises InputError, at that place (file, field), with the command that installs it, and with what
    would do `instead`.
    """
    try:
        return import_module(package)
    except ImportError as error:
        allowed = f"pip install 'roboclimber-testbed[{name}]'{instead}"
        raise InputError(f"needs the extra `{name}`", allowed=allowed, **place) from error


OF_THE_DISK = (errno.ENOSPC, errno.EDQUOT, errno.EFBIG, errno.EROFS)
"""No space, no quota, a file that may not grow, a disk that is only read."""


NO_PLACE = {errno.ENAMETOOLONG, errno.ELOOP}
CIRCLE = "Symlink loop from"
"""How pathlib says that links lead in a circle."""


def printable(text: str) -> str:
    r"""A text of unknown origin as a terminal may have it: whatever would command the terminal, or
    turn the direction of reading, is spelt out (`\x1b`); lines and tabs stay.
    """
    if text.isprintable():
        return text
    return "".join(one if one.isprintable() or one in "\n\t" else repr(one)[1:-1] for one in text)


def disk_refusal(error: BaseException) -> InputError | None:
    """What an error says of a disk that does not take what is written, wherever that was; None: it
    is another error.
    """
    if not (isinstance(error, OSError) and error.errno in OF_THE_DISK):
        return None
    place = (
        error.filename
        or "standard output, or a file of the testbed's own (its cache, or a temporary one)"
    )
    return InputError(f"cannot be written: {error.strerror}", file=place)


def place_refusal(error: BaseException) -> InputError | None:
    """What an error says of a place that cannot be: a name longer than the disk's, links that lead
    in a circle; None: it is another error.
    """
    if isinstance(error, OSError) and error.errno in NO_PLACE:
        return InputError(f"is no place: {error.strerror}", file=_short(error.filename))
    if isinstance(error, RuntimeError) and str(error).startswith(CIRCLE):
        place = str(error).removeprefix(CIRCLE).strip("' ")
        return InputError("is no place: its links lead in a circle", file=place)
    return None


class SimulationFault(Exception):
    """The simulation produced a state that cannot be (a non-finite number, an engine failure): exit
    status 1.
    """


def _said_again(
    kind: type[InputError], arguments: tuple[object, ...], state: dict[str, object]
) -> InputError:
    error = kind.__new__(kind, *arguments)
    error.__dict__.update(state)
    return error


def _short(value: object, limit: int = 60) -> str:
    text = repr(str(value) if isinstance(value, Path) else value)
    return text if len(text) <= limit else text[: limit - 3] + "..."
