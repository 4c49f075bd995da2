"""A valve command that stays at one value while the machine does what no constant command makes."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from testbed.formats.arrays import Array
from testbed.recording.checker.finding import Finding
from testbed.recording.checker.raw import REFERENCE, Raw, repetitions

FEWEST = 20
"""Samples in a row from which a command counts as held."""
REVERSED_M, REVERSED_SHARE = 2e-3, 0.05
"""Travel there and back, and share of a load cell's span there and back, that no constant valve
command can have made."""
RINGS_S, ANSWERS_S = 0.05, 0.3
"""Slower than this oil does not ring; spool and oil have answered long before the other."""
OPEN = 0.05
"""A command of this size opens any valve."""


def frozen_command(raw: Raw) -> Iterator[Finding]:
    """Stretches of a held command in which the piston goes there and back or against it, or a load
    cell is pressed and let go.
    """
    position = raw.series.get("position")
    if position is None:
        return
    command = raw.series["valve_command"]
    first, length = repetitions(command)
    for index in np.flatnonzero(length > FEWEST):
        stretch = slice(int(first[index]), int(first[index] + length[index]))
        obeyed = slice(_obeyed(raw, stretch), stretch.stop)
        way, pressed = _there_and_back(position[obeyed]), _pressed_and_let_go(raw, stretch)
        against = _against(raw, stretch)
        if way > REVERSED_M:
            yield _held(raw, stretch, "goes both ways", f"goes {1e3 * way:.3g} mm and back")
        elif against > REVERSED_M:
            yield _held(raw, stretch, "goes against it", f"goes {1e3 * against:.3g} mm against it")
        elif pressed > REVERSED_SHARE:
            share = f"{100 * pressed:.2g} % of the load cell's span"
            yield _held(raw, stretch, "presses and lets go", f"presses by {share} and lets go")


def _obeyed(raw: Raw, stretch: slice) -> int:
    """The row from which the piston goes as commanded, before spool and oil must have answered: a
    mass runs on against a valve that is thrown over, and turns round once.
    """
    first = int(stretch.start)
    command = float(raw.series["valve_command"][first])
    if abs(command) < OPEN:
        return first
    answered = min(first + round(ANSWERS_S / _step_s(raw)) + 1, stretch.stop)
    return first + int(np.argmin(np.sign(command) * raw.series["position"][first:answered]))


def _held(raw: Raw, stretch: slice, what: str, how: str) -> Finding:
    return Finding(
        "error",
        "valve_command",
        f"stays at one value while the piston {what}",
        f"{raw.series['valve_command'][stretch.start]:.4g} while the piston {how}",
        "the command was not recorded there: cut this stretch out, or leave the channel out",
        float(raw.time_s[stretch.start]),
        float(raw.time_s[stretch.stop - 1]),
    )


def _there_and_back(values: Array) -> float:
    """How far a channel goes one way and comes back."""
    first, last, high, low = values[0], values[-1], np.max(values), np.min(values)
    return float(max(min(high - first, high - last), min(first - low, last - low)))


def _pressed_and_let_go(raw: Raw, stretch: slice) -> float:
    """How far the force on a load cell goes there and back, smoothed, as a share of its span."""
    force = raw.series.get(REFERENCE)
    window = max(round(RINGS_S / _step_s(raw)), 1)
    if force is None or stretch.stop - stretch.start < 4 * window or not np.ptp(force):
        return 0.0
    held = np.convolve(force[stretch], np.ones(window) / window, "valid")
    return _there_and_back(held) / float(np.ptp(force))


def _against(raw: Raw, stretch: slice) -> float:
    """How far the piston goes against an open valve once that has answered, m."""
    answered = stretch.start + round(ANSWERS_S / _step_s(raw))
    command = raw.series["valve_command"][stretch.start]
    if answered >= stretch.stop or abs(command) < OPEN:
        return 0.0
    position = raw.series["position"]
    return float(-np.sign(command) * (position[stretch.stop - 1] - position[answered]))


def _step_s(raw: Raw) -> float:
    return float(np.median(np.diff(raw.time_s)))
