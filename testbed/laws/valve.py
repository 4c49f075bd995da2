"""Proportional valve: amplifier lag, hysteresis, second-order spool, dead band.

The command is held over a step, so the amplifier approaches it exponentially, the play operator
follows that monotone signal, and the spool answers a constant or an exponential: all three in
closed form, no step error.
"""

from __future__ import annotations

import math

from testbed.compiled import njit_law
from testbed.formats.arrays import Array
from testbed.formats.records import Record, quantity
from testbed.laws.second_order import second_order


class ValveParameters(Record):
    """A proportional valve."""

    dead_band = quantity("1", "dead band on either side of the middle, share of the spool's way")
    hysteresis = quantity("1", "half width of the hysteresis, share of the command's range")
    frequency = quantity("rad/s", "natural frequency of the spool")
    damping = quantity("1", "damping ratio of the spool")
    amplifier_lag = quantity("s", "time constant of the amplifier")
    locked = quantity("1", "1: the valve is shut off, whatever the command")


class ValveState(Record):
    """Where amplifier, hysteresis and spool stand."""

    amplifier = quantity("1", "command as the amplifier has it by now")
    play = quantity("1", "command behind the hysteresis: what the spool follows")
    spool = quantity("1", "place of the spool, -1 to 1, + extends")
    spool_rate = quantity("1/s", "rate of the spool")


@njit_law(forceinline=True)
def play(state: float, command: float, half_width: float) -> float:
    """Hysteresis as a play operator: the output follows the command, `half_width` behind it in
    either direction.
    """
    if command > state + half_width:
        return command - half_width
    if command < state - half_width:
        return command + half_width
    return state


@njit_law(forceinline=True)
def opening(s: float, deadband: float) -> float:
    """O = sign(s) max(|s| - d, 0) / (1 - d), -1..1."""
    if s > deadband:
        return (s - deadband) / (1.0 - deadband)
    if s < -deadband:
        return (s + deadband) / (1.0 - deadband)
    return 0.0


@njit_law(forceinline=True)
def engaging_time(
    amplifier: float, command: float, state: float, half_width: float, tau: float
) -> float:
    """Time after which the amplifier, on its way to `command`, drags the play along; inf if it
    never does, s.
    """
    if command > state + half_width:
        edge = state + half_width
    elif command < state - half_width:
        edge = state - half_width
    else:
        return math.inf
    ratio = (amplifier - command) / (edge - command)
    return tau * math.log(ratio) if ratio > 1.0 else 0.0


@njit_law
def spool_after(
    s: float, rate: float, base: float, swing: float, wn: float, zeta: float, tau: float, t: float
) -> tuple[float, float]:
    """Spool (1) and rate (1/s) after t of s'' = wn^2 (target - s) - 2 zeta wn s'; target base +
    swing e^(-t/tau).
    """
    yy, yr, ry, rr = second_order(wn, zeta, t)
    forced, forced_rate, end = forced_share(wn, zeta, tau, t)
    y, y_rate = s - base - swing * forced, rate - swing * forced_rate
    return (
        base + swing * forced * end + yy * y + yr * y_rate,
        swing * forced_rate * end + ry * y + rr * y_rate,
    )


@njit_law
def forced_share(wn: float, zeta: float, tau: float, t: float) -> tuple[float, float, float]:
    """Answer of the spool to an input e^(-t/tau): its share, its rate (1/s), and e^(-t/tau) after
    t.
    """
    inverse = 1.0 / tau
    resonance = inverse * inverse - 2.0 * zeta * wn * inverse + wn * wn
    # The input decays like the spool itself: step aside by a millionth.
    if abs(resonance) < 1e-6 * wn * wn:
        resonance = 1e-6 * wn * wn
    forced = wn * wn / resonance
    return forced, -forced * inverse, math.exp(-t * inverse)


@njit_law(forceinline=True)
def bounded(s: float, rate: float) -> tuple[float, float]:
    """The spool's stops at +-1."""
    if s > 1.0:
        return 1.0, 0.0
    if s < -1.0:
        return -1.0, 0.0
    return s, rate


@njit_law
def spool_weights(
    wn: float, zeta: float, tau: float, h: float
) -> tuple[float, float, float, float, float, float, float]:
    """What `valve_path` needs of a valve for substeps of h: the spool's exact step and its answer
    to the lag.
    """
    yy, yr, ry, rr = second_order(wn, zeta, h)
    forced, forced_rate, decay = forced_share(wn, zeta, tau, h)
    return yy, yr, ry, rr, forced, forced_rate, decay


@njit_law(forceinline=True)
def valve_path(
    s: ValveState,
    p: ValveParameters,
    command: float,
    h: float,
    weights: tuple[float, float, float, float, float, float, float],
    out: Array,
) -> None:
    """Openings at the ends of len(out) - 1 equal substeps of h into `out` (out[0]: now); the
    valve's state advances.

    `command` is held; `weights` of `spool_weights`.
    """
    width, band, tau = p.hysteresis, p.dead_band, p.amplifier_lag
    spool, rate, amplifier, state = s.spool, s.spool_rate, s.amplifier, s.play
    n = out.shape[0] - 1
    out[0] = opening(spool, band)
    start = engaging_time(amplifier, command, state, width, tau)
    yy, yr, ry, rr, forced, forced_rate, decay = weights
    base = command - width if command > state else command + width
    swing = 0.0
    moving = start <= 1e-6 * h
    if moving:
        swing = play(state, amplifier, width) - base
    else:
        base = state
    for index in range(n):
        if not moving and start < (index + 1) * h:
            wn, zeta, before = p.frequency, p.damping, start - index * h
            spool, rate = spool_after(spool, rate, base, 0.0, wn, zeta, tau, before)
            base = command - width if command > state else command + width
            swing = state - base
            moving = True
            spool, rate = spool_after(spool, rate, base, swing, wn, zeta, tau, h - before)
            swing *= math.exp(-(h - before) / tau)
        else:
            y, y_rate = spool - base - swing * forced, rate - swing * forced_rate
            swing *= decay
            spool = base + swing * forced + yy * y + yr * y_rate
            rate = swing * forced_rate + ry * y + rr * y_rate
        spool, rate = bounded(spool, rate)
        out[index + 1] = opening(spool, band)
    s.spool, s.spool_rate = spool, rate
    s.amplifier = command + (amplifier - command) * decay**n
    s.play = base + swing
