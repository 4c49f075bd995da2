"""Signs of a lost foot in the motion of the body and in the last second, for the learned detector.

The inertial unit measures what the seal of a resting piston hides: how fast the corner of the body
above a foot moves,

    c = v_z + w_x y - w_y x,   fast parts, v_z from the specific force along z

A blow moves the corner above a hanging foot more than that above a standing one, which the ground
pushes back. The change of a piston's force over the way that its corner goes down is the stiffness
of the leg, zero in the air. A foot whose load has stopped falling while its piston still moves, or
swings less than the others' loads, is likely to hang as well.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

from testbed.compiled import njit
from testbed.estimation.detectors.sample import Derived
from testbed.formats.intervals import Z90
from testbed.formats.records import Record, Records, quantity
from testbed.machine.names import LEGS
from testbed.recording.rows import DataRow

if TYPE_CHECKING:
    from testbed.estimation.detectors.foot_view import FootMemory, ViewNumbers


HELD = ("own", "carried")
AHEAD, LEFT = (1.0, 1.0, -1.0, -1.0), (1.0, -1.0, 1.0, -1.0)
"""Where the feet are from the body's middle, in half lengths and half widths."""
QUICK_S, BRIEF_S, SLOW_S, LONG_S = 0.01, 0.05, 0.3, 1.0
LEAK_S, STIR_S, SWING_S = 0.1, 0.1, 0.5
"""Time constants: of means; of what speed and place of a corner forget, of how much it is stirred,
and of how much a load swings, s (E).
"""
LITTLE_M2, LITTLE_M_S, USUAL_M_S = 1.0e-10, 3.0e-4, 3.0e-3
LITTLE_M_S2, USUAL_M_S2 = 0.03, 0.1
LITTLE_SHARE, STIFF, PACE_S_M = 0.02, 4250.0, 300.0
"""What counts as no motion, and as a usual one; what as no swing, share of the loss force; a leg's
stiffness, loss forces by half lengths; by which a piston's speed is seen (E).
"""


class MotionView(Record):
    """What the network sees of it; loads, differences and ratios as in HistoryView."""

    stiffness = quantity("1", "of the leg under the corner")
    corner = quantity("1", "speed of the corner beside all corners")
    corners = quantity("1", "speed of all corners")
    jolt = quantity("1", "specific force, how far from its mean")
    fall = quantity("1", "a load over 50 ms less over 300 ms", per=HELD)
    pace = quantity("1", "speed of the piston, mean over 50 ms")
    carried_beside = quantity("1", "`carried`, swung within 300 ms, beside all feet")
    own_beside = quantity("1", "`own`, swung within 300 ms, beside all feet")
    own_swung = quantity("1", "`own`, swung within 300 ms")
    own_long = quantity("1", "`own`, mean over 1 s")
    low = quantity("1", "`own`, lower end of its interval")
    high = quantity("1", "`own`, upper end of its interval")


class Motion(Record):
    """Of one foot and its corner of the body."""

    level = quantity("m/s2", "mean specific force along z")
    jolted = quantity("m/s2", "mean distance from that")
    turning = quantity("m/s", "mean speed of the corner by the body's rates")
    heave = quantity("m/s", "fast speed of the body along z")
    place = quantity("m", "of the corner, fast part")
    shaken = quantity("m/s", "mean size of the corner's fast speed")
    square = quantity("m2", "mean square of its place")
    work = quantity("N m", "mean of the load's fast change by the way down")
    speed = quantity("m/s", "mean speed of the piston")
    slow = quantity("N", "mean of `own` over 1 s")
    swung = quantity("N", "mean distance of a load's short mean from its long one", per=HELD)
    low = quantity("N", "mean lower end of the interval of `own` by its spread")
    high = quantity("N", "the same, upper end")


@njit
def remember_motion(
    row: DataRow,
    derived: Derived,
    foot: int,
    numbers: ViewNumbers,
    memory: FootMemory,
    fresh: bool,
    dt: float,
) -> None:
    """One sample into `memory.motion` of a foot, whose running means already hold it. A missing
    reading of the inertial unit changes nothing.
    """
    motion, means = memory.motion, memory.means
    quick, brief = dt / (QUICK_S + dt), dt / (BRIEF_S + dt)
    slow, long = dt / (SLOW_S + dt), dt / (LONG_S + dt)
    if fresh:
        quick = brief = slow = long = 1.0
    far = Z90 * row.estimate_own.spread[foot]
    low, high = row.estimate.own[foot] - far, row.estimate.own[foot] + far
    if math.isfinite(low + high):
        motion.low += quick * (low - motion.low)
        motion.high += quick * (high - motion.high)
    motion.speed += brief * (derived.velocity[foot] - motion.speed)
    motion.slow += long * (means[0, 2] - motion.slow)
    for load in range(len(HELD)):
        away = abs(means[load, 2] - means[load, 3])
        motion.swung[load] += dt / SWING_S * (away - motion.swung[load])
    felt = row.specific_force[2]
    rate = row.angular_rate[0] * LEFT[foot] * numbers.half_width
    rate -= row.angular_rate[1] * AHEAD[foot] * numbers.half_length
    if not math.isfinite(felt + rate):
        return
    motion.level += slow * (felt - motion.level)
    motion.turning += slow * (rate - motion.turning)
    motion.heave += dt * (felt - motion.level) - dt / LEAK_S * motion.heave
    motion.jolted += dt / STIR_S * (abs(felt - motion.level) - motion.jolted)
    speed = motion.heave + rate - motion.turning
    motion.place += dt * speed - dt / LEAK_S * motion.place
    motion.shaken += dt / STIR_S * (abs(speed) - motion.shaken)
    place, change = motion.place, means[2, 1] - means[2, 3]
    motion.square += dt / SLOW_S * (place * place - motion.square)
    motion.work -= dt / SLOW_S * (place * change + motion.work)


@njit
def view_of_motion(
    memories: Records[FootMemory], foot: int, numbers: ViewNumbers, view: MotionView
) -> None:
    """Into `view`: what the motion of the body and of this foot says."""
    memory, unit = memories[foot], numbers.loss_force
    motion, means = memory.motion, memory.means
    shaken = swung_own = swung_carried = 0.0
    for other in range(len(LEGS)):
        shaken += memories[other].motion.shaken / len(LEGS)
        swung_own += memories[other].motion.swung[0] / len(LEGS)
        swung_carried += memories[other].motion.swung[1] / len(LEGS)
    little, stiff = LITTLE_SHARE * unit, STIFF * unit / numbers.half_length
    view.stiffness = math.asinh(motion.work / (motion.square + LITTLE_M2) / stiff)
    view.corner = math.log((motion.shaken + LITTLE_M_S) / (shaken + LITTLE_M_S))
    view.corners = math.log((shaken + LITTLE_M_S) / USUAL_M_S)
    view.jolt = math.log((motion.jolted + LITTLE_M_S2) / USUAL_M_S2)
    for load in range(len(HELD)):
        view.fall[load] = math.tanh((means[load, 2] - means[load, 3]) / unit)
    view.pace = math.atan(PACE_S_M * motion.speed)
    view.carried_beside = math.log((motion.swung[1] + little) / (swung_carried + little))
    view.own_beside = math.log((motion.swung[0] + little) / (swung_own + little))
    view.own_swung = math.asinh(motion.swung[0] / unit)
    view.own_long = math.asinh(motion.slow / unit)
    view.low, view.high = math.asinh(motion.low / unit), math.asinh(motion.high / unit)
