"""The noise of the forces' group: what friction, shaking and sensors leave of the body's balances
beside a sound machine's tolerances.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
import numpy.typing as npt

from testbed.diagnosis.robot.balance import BODY_ROWS, BodyBalance
from testbed.diagnosis.robot.letting_go import answers_n, let_go
from testbed.diagnosis.robot.motion_noise import (
    left_by_motions,
    oil_force_n,
    shaken_n,
    slides_surely,
    swings,
    switched_n,
    taken_by_stops,
    turning_from,
    turns,
)
from testbed.effects.signature import RobotSeen
from testbed.machine.names import AXES
from testbed.machine.scale import Scale

Array = npt.NDArray[np.float64]
VERTICAL = tuple(range(2, len(AXES), 3))
SHAKEN_SHARE = 0.3
"""A line of more than this share of dry friction turns the piston to and fro."""
SIDE = 0.2
"""Friction by side load that a sound machine may have, share of it."""
LEFT_ALIKE = 0.3
"""Share of dry friction that the seals of all vertical cylinders hold alike while they rest (B:
from 0.1 to 0.5 of sound machines while they drill).
"""
HAMMER_SHARE = 0.04
PHASE_HOLDS_S = 3.5
"""For so long a line's phase may count as one (E)."""


@dataclass(frozen=True)
class ForceNoise:
    """What the forces of a sound machine miss beside its tolerances; shares are of dry friction."""

    white_n: float
    """A bin's noise of its own: sensors, accelerations, the bins' edges; and as much that lasts as
    long as `memory_s`.
    """
    white_n_m: float
    white_foot_n: float
    sliding_share: float
    """Friction while sliding beyond its tolerances, for `memory_s`."""
    memory_s: float
    rest_share: float
    """Friction at rest, for `rest_memory_s` or until the load has changed by `news_share`."""
    rest_memory_s: float
    news_share: float
    news_n: float
    """At rest a change of the load below this is noise."""
    alike_share: float
    """Friction at rest as the body's last motions along and about each axis left it, alike at all
    feet, for `alike_s`.
    """
    alike_s: float
    quick_share: float
    """Friction anew in each bin."""
    turning_share: float
    """A piston that turns round: the seal is somewhere on its way from one sense to the other."""
    turning_alike: float
    """Share of that variance which pistons that turn at once have alike, for `turning_s`: one
    motion of the body turns them.
    """
    turning_s: float
    switched_share: float
    """Share of the change where a load changes from one bin to the next."""
    shaken_share: float = 0.0
    """Share of what a piston's force swings to and fro by from bin to bin: its seal turns round
    within the bin, too. Above 0 stuck seals take up what the machine's shaking asks for.
    """

    def of_size(self, scale: Scale) -> ForceNoise:
        """The same for a machine of another size; these numbers are ROBOCLIMBER's."""
        newton, newton_metre = scale.times("N"), scale.times("N m")
        return replace(
            self,
            white_n=newton * self.white_n,
            white_n_m=newton_metre * self.white_n_m,
            white_foot_n=newton * self.white_foot_n,
            news_n=newton * self.news_n,
        )


OF_A_SOUND_MACHINE = ForceNoise(
    white_n=50.0,
    white_n_m=50.0,
    white_foot_n=60.0,
    sliding_share=0.08,
    memory_s=1.0,
    rest_share=0.5,
    rest_memory_s=120.0,
    news_share=3.0,
    news_n=20.0,
    alike_share=0.1,
    alike_s=100.0,
    quick_share=0.02,
    turning_share=0.5,
    turning_alike=0.6,
    turning_s=0.2,
    switched_share=0.03,
    shaken_share=0.25,
)
"""At rest the numbers under which the balances of 21 drawn sound machines are about likeliest;
while sliding wider than that: some machines slide far less evenly than most.
"""


def dry_n(seen: RobotSeen) -> Array:
    """(n, 12) N, dry friction of the pistons with what a sound machine's side loads may add."""
    return np.asarray(seen.coulomb_n + SIDE * seen.side_load_n)


def lasting_of(balance: BodyBalance, known: ForceNoise) -> Array:
    """The part of the noise that stuck seals hold: see noise_of. They hold it until they let go,
    each for itself and all in answer to what presses them.
    """
    seen, (bins, rows) = balance.seen, np.nonzero(balance.counted)
    share = slides_surely(seen.direction)
    dry = dry_n(seen)
    stuck_n, of_one_bin = (1.0 - share) * dry, _of_one_bin(balance, known)
    renewed = friction_age(seen, share, dry, known)
    anew = let_go(balance, stuck_n, of_one_bin) / (2.0 * known.rest_share**2)
    age = (renewed + np.cumsum((1.0 - share) * anew[:, None], axis=0))[bins]
    stuck = balance.by_force[bins, rows] * stuck_n[bins]
    out = _held_alike(seen, bins, known.alike_share * stuck, known.alike_s)
    each = list(zip(age.T, known.rest_share * stuck.T, strict=True))
    alike = (age[:, VERTICAL].mean(axis=1), LEFT_ALIKE * stuck[:, VERTICAL].sum(axis=1))
    for since, held in [*each, alike]:
        out += np.exp(-np.abs(since[:, None] - since[None, :])) * np.outer(held, held)
    at_rest = balance.by_force[bins, rows] * (1.0 - share)[bins]
    answered = at_rest @ answers_n(balance, stuck_n, of_one_bin).T
    kept = answered * _kept_since(renewed.mean(axis=1))[bins]
    return np.asarray(out + kept @ kept.T)


def _kept_since(age: Array) -> Array:
    """(n, n) share that is left in a bin (row) of what seals of an age (n,) took up in a bin
    (column): none before it.
    """
    since = age[:, None] - age[None, :]
    return np.asarray(np.tril(np.exp(-np.maximum(since, 0.0))))


def _of_one_bin(balance: BodyBalance, known: ForceNoise) -> Array:
    """(n, 6, 6) covariance of what the body's balances miss in one bin and not in the next."""
    seen, by_force = balance.seen, balance.by_force[:, :BODY_ROWS]
    share = slides_surely(seen.direction)
    dry = dry_n(seen)
    spread = np.hypot(renewed_n(seen, known), known.sliding_share * share * dry)
    moved = by_force * spread[:, None, :]
    white = np.repeat([known.white_n, known.white_n_m], BODY_ROWS // 2)
    out = moved @ np.swapaxes(moved, 1, 2) + np.diag(white**2)
    out[:, 2, 2] += (HAMMER_SHARE * seen.thrust_n) ** 2
    return np.asarray(out)


def renewed_n(seen: RobotSeen, known: ForceNoise) -> Array:
    """(n, 12) N, friction that a bin has for itself, standard deviation: of seals that turn round,
    switch their load or are shaken, and what an end stop may take.
    """
    dry = dry_n(seen)
    alone = known.turning_share * np.sqrt(1.0 - known.turning_alike)
    anew = np.hypot(alone * turns(seen.direction), known.quick_share) * dry
    anew = np.hypot(anew, known.switched_share * switched_n(seen))
    if known.shaken_share > 0.0:
        to_and_fro = known.shaken_share * swings(oil_force_n(seen))
        held = (1.0 - slides_surely(seen.direction)) * shaken_n(seen)  # a stuck seal takes it up
        anew = np.hypot(anew, np.minimum(np.hypot(to_and_fro, held), dry))
    return np.asarray(np.hypot(anew, taken_by_stops(seen)))


def _held_alike(seen: RobotSeen, bins: npt.NDArray[np.intp], stuck: Array, for_s: float) -> Array:
    """Covariance (rows, rows) of friction at rest that the body's last motions left at all feet;
    `stuck`: (rows, 12) what a row misses by it.
    """
    left = np.einsum("ri,rim->rm", stuck, left_by_motions(seen)[bins])
    time = seen.time_s[bins]
    return np.asarray(np.exp(-np.abs(time[:, None] - time[None, :]) / for_s) * (left @ left.T))


def noise_of(balance: BodyBalance, known: ForceNoise) -> Array:
    """Covariance of the group's rows (rows, rows) beside what tolerances make."""
    seen, counted = balance.seen, balance.counted
    bins, rows = np.nonzero(counted)
    apart = np.abs(seen.time_s[bins][:, None] - seen.time_s[bins][None, :])
    white = np.where(
        rows < 3, known.white_n, np.where(rows < 6, known.white_n_m, known.white_foot_n)
    )
    same_row = rows[:, None] == rows[None, :]
    out = np.diag(white**2)
    out += np.where(same_row, np.exp(-apart / known.memory_s), 0.0) * np.outer(white, white)
    blows = HAMMER_SHARE * np.abs(seen.thrust_n)[bins] * (rows == 2)
    out += np.diag(blows**2)
    share = slides_surely(seen.direction)
    dry = dry_n(seen)
    spread = (known.sliding_share * share + known.rest_share * (1.0 - share)) * dry
    shaken = seen.line_n > SHAKEN_SHARE * dry  # a piston that is shaken has friction of both senses
    spread = np.hypot(spread, seen.line_n + dry * shaken)
    anew = renewed_n(seen, known)
    age = friction_age(seen, share, dry, known)
    by_axis = balance.by_force[bins, rows]
    for axis in range(len(AXES)):
        by = by_axis[:, axis]
        lasting, fresh = by * spread[bins, axis], by * anew[bins, axis]
        since = age[bins, axis]
        out += np.exp(-np.abs(since[:, None] - since[None, :])) * np.outer(lasting, lasting)
        out += (apart == 0.0) * np.outer(fresh, fresh)
        if seen.line_n[axis] > 0.0:
            out += swung(seen, axis, by, apart)
    behind = known.turning_share * turning_from(seen.direction) * dry
    alike = np.sqrt(known.turning_alike) * np.einsum("ra,ra->r", by_axis, behind[bins])
    out += np.exp(-apart / known.turning_s) * np.outer(alike, alike)
    if known.alike_share > 0.0:
        held = by_axis * (known.alike_share * (1.0 - share) * dry)[bins]
        out += _held_alike(seen, bins, held, known.alike_s)
    return np.asarray(out)


def swung(seen: RobotSeen, axis: int, by: Array, apart: Array) -> Array:
    """Covariance (rows, rows) of what a line of a piston's force leaves in bins that are not long
    beside its period; `by` (rows,) by that force, `apart` (rows, rows) s.
    """
    frequency = seen.line_hz[axis]
    left = by * seen.line_n[axis] * np.sinc(frequency * (seen.time_s[1] - seen.time_s[0]))
    turned = np.cos(2.0 * np.pi * frequency * apart) * np.exp(-apart / PHASE_HOLDS_S)
    return np.asarray(0.5 * turned * np.outer(left, left))


def friction_age(seen: RobotSeen, share: Array, dry: Array, known: ForceNoise) -> Array:
    """(n, 12) how much friction's deviation has been renewed, in memories: by time, and at rest by
    changing loads, of which a stuck seal takes up its part.
    """
    piston = oil_force_n(seen)
    step = float(seen.time_s[1] - seen.time_s[0])
    changed = np.abs(np.diff(piston, axis=0, prepend=piston[:1]))
    outside = np.column_stack([seen.thrust_n, seen.tension_n])
    changed = changed + 0.25 * np.abs(np.diff(outside, axis=0, prepend=outside[:1])).sum(
        axis=1, keepdims=True
    )
    news = np.maximum(changed - known.news_n, 0.0) / (known.news_share * dry)
    resting = (1.0 - share) * (step / known.rest_memory_s + news)
    return np.asarray(np.cumsum(share * step / known.memory_s + resting, axis=0))
