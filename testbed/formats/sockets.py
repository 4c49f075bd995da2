"""The one way in for user code: `mine.py:Mine` becomes a class that is known to fit its socket.

A socket is a Protocol: its methods, and how many arguments each is called with, are what a class
must have. Whatever goes wrong inside the user's file is reported as the user's (UserCodeError:
file, line and what was raised), not as a fault of the testbed.
"""

from __future__ import annotations

import hashlib
import inspect
import sys
import traceback
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from types import ModuleType
from typing import Any

from testbed.errors import InputError, SimulationFault, UserCodeError

FORM = "FILE.py:Class"
_LOADED: set[str] = set()
"""Files of users that this process has loaded, as their code objects spell them."""


def is_user_class(name: str) -> bool:
    """Whether a name means a class in a user's file (`mine.py:Mine`) rather than one that is
    shipped.
    """
    file, colon, _ = name.rpartition(":")
    return bool(colon) and file.endswith(".py")


def split_user_class(
    name: str, *, field: str, folders: tuple[Path, ...] = (Path(),)
) -> tuple[Path, str]:
    """File (absolute) and class of `FILE.py:Class`; a relative file is looked for in `folders`, in
    their order.

    Raises InputError where the name has another form or there is no such file.
    """
    if not is_user_class(name):
        raise InputError("is no class of your own", field=field, value=name, allowed=FORM)
    file, _, class_name = name.rpartition(":")
    for folder in folders:
        if (folder / file).is_file():
            return (folder / file).resolve(), class_name
    raise InputError("no such file", file=file, field=field, value=name, allowed=FORM)


def load_class(
    name: str, socket: type, *, field: str, folders: tuple[Path, ...] = (Path(),)
) -> type[Any]:
    """The class that `FILE.py:Class` names. `socket` is the Protocol that it must fit, `field`
    where the name stood.

    Raises InputError where there is no such file or class, or where it lacks something of the
    socket; UserCodeError where the file itself cannot be imported.
    """
    file, class_name = split_user_class(name, field=field, folders=folders)
    module = _import(file)
    found = getattr(module, class_name, None)
    if not inspect.isclass(found):
        own = [
            key
            for key, value in vars(module).items()
            if inspect.isclass(value) and not key.startswith("_")
        ]
        raise InputError(
            "has no such class",
            file=file,
            field=field,
            value=class_name,
            allowed=", ".join(own) or "a class of this file, which has none",
        )
    check_fits(found, socket, field, file)
    return found


def load_object(
    name: str, socket: type, *arguments: Any, field: str, folders: tuple[Path, ...] = (Path(),)
) -> Any:
    """A fresh object of the class that `FILE.py:Class` names, made from `arguments`. Raises as
    load_class.
    """
    made = load_class(name, socket, field=field, folders=folders)
    try:
        inspect.signature(made).bind(*arguments)
    except TypeError as error:
        given = ", ".join(type(argument).__name__ for argument in arguments) or "nothing"
        raise InputError(
            f"cannot be made: {error}",
            file=split_user_class(name, field=field, folders=folders)[0],
            field=field,
            value=made.__name__,
            allowed=f"__init__ that takes {given}",
        ) from error
    with user_code():
        return made(*arguments)


def numbers_of(answer: Any, shape: tuple[int, ...], giver: object, meant: str) -> Any:
    """What an object answered, perhaps one of the user's own, as an array of floats.

    `meant`: what the answer is. Raises InputError, naming the object's class, where it is none of
    this shape.
    """
    import numpy as np

    try:
        found = np.asarray(answer, dtype=np.float64)
    except (TypeError, ValueError):
        found = None
    if found is None or found.shape != shape:
        raise InputError(
            f"answered what are no {meant}",
            file=own_file(giver),
            field=type(giver).__name__,
            value=type(answer).__name__ if found is None else found.shape,
            allowed=f"an array {shape} of numbers",
        )
    return found


def own_file(made: object) -> str | None:
    """The user's file that an object's class was read from; None for one of the testbed's own."""
    file = getattr(sys.modules.get(type(made).__module__), "__file__", None)
    return file if file in _LOADED else None


@contextmanager
def user_code() -> Iterator[None]:
    """Report what a user's file raises inside as UserCodeError: the file, its line, and what was
    raised.
    """
    try:
        yield
    except (InputError, SimulationFault):
        raise
    except (Exception, SystemExit) as error:
        place = _place_in_user_file(error)
        if place is None:
            raise
        raise UserCodeError(*place, error) from error


def _import(file: Path) -> ModuleType:
    """The file as a module, read anew (no cache is written); files beside it can be imported by
    it.
    """
    name = f"testbed_user_{file.stem}_{hashlib.sha256(str(file).encode()).hexdigest()[:12]}"
    module = ModuleType(name)
    module.__file__ = str(file)
    _LOADED.add(str(file))
    sys.modules[name] = module  # dataclasses and pickle look their module up there
    sys.path.append(str(file.parent))
    try:
        with user_code():
            exec(compile(file.read_bytes(), file, "exec"), vars(module))
    except BaseException:
        del sys.modules[name]
        raise
    finally:
        sys.path.remove(str(file.parent))
    return module


def check_fits(found: type, socket: type, field: str, file: Path | None = None) -> None:
    """Refuse a class that lacks a method of the socket, or whose method takes other arguments."""
    for name, wanted in vars(socket).items():
        if name.startswith("_") or not inspect.isfunction(wanted):
            continue
        method = getattr(found, name, None)
        if not callable(method):
            raise InputError(
                f"has no method {name}",
                file=file,
                field=field,
                value=found.__name__,
                allowed=f"a class with {_plain(wanted)}",
            )
        arguments = [None] * len(inspect.signature(wanted).parameters)
        try:
            inspect.signature(method).bind(*arguments)
        except TypeError as error:
            raise InputError(
                f"its method {name} takes other arguments: {error}",
                file=file,
                field=field,
                value=found.__name__,
                allowed=_plain(wanted),
            ) from error


def _plain(method: Any) -> str:
    """A method as a user would write its head, without annotations."""
    return f"{method.__name__}({', '.join(inspect.signature(method).parameters)})"


def _place_in_user_file(error: BaseException) -> tuple[str, int] | None:
    """File and line of the innermost frame in a user's file; None where no such file has a part in
    it.
    """
    if isinstance(error, SyntaxError) and error.filename in _LOADED:
        return error.filename, error.lineno or 0
    frames = [
        frame for frame in traceback.extract_tb(error.__traceback__) if frame.filename in _LOADED
    ]
    return (frames[-1].filename, frames[-1].lineno or 0) if frames else None
