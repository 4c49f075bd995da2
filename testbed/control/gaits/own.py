"""A gait of the user's own: made from the start, and its commands looked at before they are
followed.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from testbed.control.command import Command
from testbed.control.gait import BelievedStart, Gait
from testbed.control.measured import Measured
from testbed.errors import InputError
from testbed.formats.sockets import load_object
from testbed.machine.names import AXES, LEGS, SIDES

SHAPES = {"joints": AXES, "joint_rates": AXES, "rope_rates_m_s": SIDES, "stance": LEGS}
"""What each array of a command has one number for."""


def checked_gait(
    gait: str | type[Any] | Gait, start: BelievedStart, field: str = "task.file"
) -> Gait:
    """A gait of the user's own: `FILE.py:Class` or a class, made from the start, or one that is
    made already.

    Raises InputError where it does not fit.
    """
    if isinstance(gait, str):
        return OwnGait(load_object(gait, Gait, start, field=field), gait)
    made: Gait = gait(start) if isinstance(gait, type) else gait
    return OwnGait(made, type(made).__name__)


class OwnGait:
    """A user's gait whose commands are looked at before they are followed. A Gait."""

    def __init__(self, gait: Gait, name: str) -> None:
        self._gait, self._name = gait, name
        self._last: object = None

    def command(self, t: float, dt: float, measured: Measured) -> Command:
        """See Gait. Raises InputError for what is no command of finite numbers."""
        command = self._gait.command(t, dt, measured)
        if command is not self._last:
            self._check(command)
            self._last = command
        return command

    def progress(self, t: float) -> Any:
        """What the user's gait says of its own progress; nothing where it says nothing."""
        told = getattr(self._gait, "progress", None)
        return {} if told is None else dict(told(t))

    def _check(self, command: object) -> None:
        if not isinstance(command, Command):
            raise self._refused("command", type(command).__name__, "a Command")
        for name, members in SHAPES.items():
            values = getattr(command, name)
            if values is None:
                continue
            if values.shape != (len(members),):
                raise self._refused(name, values.shape, f"({len(members)},)")
            if not np.isfinite(values).all():
                raise self._refused(name, values.tolist(), "finite numbers")

    def _refused(self, field: str, value: object, allowed: str) -> InputError:
        said = "returned a command that cannot be followed"
        return InputError(said, file=self._name, field=field, value=value, allowed=allowed)
