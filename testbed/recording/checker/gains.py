"""Gains of sensors against the balance of forces: one that is off by some per cent, and one that
jumps in mid-recording.

With friction of any kind about a zero, y = c + C sign(v) + sigma v + m a explains what is left of
the balance. A channel whose force enters it once more with a factor that is not 0 has another gain
than 1; one whose force does so from a moment on, has jumped. What grows smoothly (a drift, friction
that warms up) is an effect, for the diagnosis to find.

At a pressure that is held, a gain of nought beside a large enough zero explains any channel: gains
stay within SAME_SCALE, beyond which a scale is wrong, and a zero alone tells how far a gain is off.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass

import numpy as np

from testbed.formats.arrays import Array
from testbed.recording.checker.balance import (
    ALIKE,
    MENDED,
    SAME_SCALE,
    WORST,
)
from testbed.recording.checker.finding import Finding
from testbed.recording.checker.forces import ENOUGH, FEW, ZERO, Forces

OFF = 0.075
"""Share by which a load cell's gain has to be off: a spring or a mass that a model lacks looks like
less."""
JUMPED, BESIDE = 0.02, 2.0
"""Share by which a gain has to jump; and times what the best channel leaves up to which another is
named beside it."""
MOMENTS, ENDS = 25, (0.05, 0.95)
"""Moments at which a jump is tried, then as many between the neighbours of the best, and the shares
of the motion between which they lie."""
HELD = 0.25
"""Spread of a load cell's force, as a share of it, up to which its gain is found from the zero
alone (E: a seal's friction at a held pressure makes less).
"""
SHARPER = 0.6
"""A jump has to leave less than this share of what gains, zeros and friction that grow with time
leave."""
CHANNELS = ("reference", "pressure_a", "pressure_b")


@dataclass(frozen=True, eq=False)
class Left:
    """What is left of a balance while the piston slides, N (n,), what friction and inertia can
    explain of it (n, 4), time from 0 to 1 (n,), the way travelled (n,), each channel's own force, N
    (n,), and the size of all forces, N.
    """

    rest_n: Array
    plain: Array
    time: Array
    travel: Array
    own_n: Mapping[str, Array]
    size_n: float

    def without(self, gain: Array | None, *columns: Array) -> tuple[Array, Array]:
        """(what is left (n,) with a channel's own force and further columns, their weights).

        `gain`: that force, whose weight is 1 less a factor within SAME_SCALE.
        """
        left, found = self._solved(self.rest_n, *(() if gain is None else (gain,)), *columns)
        if gain is None:
            return left, found
        weight = float(np.clip(found[0], 1.0 - SAME_SCALE[1], 1.0 - SAME_SCALE[0]))
        if weight == found[0]:
            return left, found
        left, found = self._solved(self.rest_n - weight * gain, *columns)
        return left, np.concatenate([[weight], found])

    def _solved(self, rest_n: Array, *columns: Array) -> tuple[Array, Array]:
        design = np.column_stack([self.plain, *columns])
        found = np.asarray(np.linalg.lstsq(design, rest_n, rcond=None)[0], dtype=np.float64)
        return rest_n - design @ found, found[self.plain.shape[1] :]

    def smooth(self, own: Array) -> tuple[Array, ...]:
        """What grows with time or with the way, beside one channel's gain."""
        return self.travel, self.time, own * self.time, self.plain[:, 1] * self.time

    def share(self, gain: Array | None = None, *columns: Array) -> float:
        """Root mean square of that, as a share of the forces."""
        return float(np.sqrt(np.mean(self.without(gain, *columns)[0] ** 2))) / self.size_n


def check_gains(forces: Forces, names: Mapping[str, str]) -> Iterator[Finding]:
    """A load cell whose gain is off, or a sensor whose gain jumps."""
    left = _left(forces)
    if left is None:
        yield from _held(forces, names)
        return
    jumps = list(_jumps(left, forces, names))
    yield from jumps or _off(left, names)


def _left(forces: Forces) -> Left | None:
    """None where too little slides, nothing is beside it, or the balance closes as it is."""
    rows = np.flatnonzero(forces.even.moving)
    rows = rows[:: max(1, rows.size // ENOUGH)]
    rest_n, speed, size_n = forces.left_over({})
    names = [name for name in CHANNELS if name in forces.even.series]
    if rows.size < FEW or len(names) < 2:
        return None
    own_n = {name: (forces.left_over({name: 2.0})[0] - rest_n)[rows] for name in names}
    even = forces.even
    plain = np.column_stack([np.ones_like(speed), np.sign(speed), speed, even.acceleration_m_s2])[
        rows
    ]
    time = rows / max(len(speed) - 1, 1)
    travel = np.cumsum(speed)[rows]
    left = Left(
        rest_n[rows],
        plain / np.maximum(np.abs(plain).max(axis=0), 1e-12),
        time,
        travel,
        own_n,
        size_n,
    )
    return left if left.share() > WORST else None


def _off(left: Left, names: Mapping[str, str]) -> Iterator[Finding]:
    """A load cell of another gain; where another channel's gain would mend the balance as well,
    that is said.
    """
    if "reference" not in left.own_n:
        return
    before = left.share()
    shares = {name: left.share(own) for name, own in left.own_n.items()}
    factor = 1.0 - float(left.without(left.own_n["reference"])[1][0])
    best = shares["reference"]
    rivals = [*shares.values(), left.share(None, left.travel)]  # by a spring that the model lacks
    better = any(share * ALIKE + 0.1 * WORST < best for share in rivals)
    if best > MENDED * before or abs(factor - 1.0) < OFF or factor <= 0.0 or better:
        return
    others = [names[n] for n, share in shares.items() if n != "reference" and share < BESIDE * best]
    yield Finding(
        "warning",
        names["reference"],
        f"reads {1.0 / factor:.3g} times the force that balances"
        + (f" (or the gain of {' or '.join(others)} is off)" if others else ""),
        f"friction, weight and inertia leave {100 * before:.2g} % of the forces as it is, "
        f"{100 * best:.2g} % with it multiplied by {factor:.3g}",
        "put the load cell's gain right, or the pressures' and the bore",
    )


def _held(forces: Forces, names: Mapping[str, str]) -> Iterator[Finding]:
    """A load cell at a held pressure, of whose force more than any sensor's zero is missing."""
    cell, moving = forces.even.series.get("reference"), forces.even.moving
    if cell is None or moving.sum() < FEW or forces.misfit({}) < WORST:
        return
    force, speed, size_n = forces.left_over({})
    ways = [force[moving & (sign * speed > 0.0)] for sign in (1.0, -1.0)]
    mean_n, spread_n = float(np.mean(cell[moving])), float(np.std(cell[moving]))
    if min(len(way) for way in ways) < FEW // 4 or spread_n > HELD * abs(mean_n):
        return
    zero_n = 0.5 * sum(float(np.median(way)) for way in ways)
    factor = 1.0 + zero_n / mean_n
    if abs(zero_n) < ZERO * size_n or abs(factor - 1.0) < OFF:
        return
    yield Finding(
        "warning",
        names["reference"],
        f"reads {1.0 / factor:.3g} times the force that balances (or pressures, bore or a weight "
        "are off: the pressure is held, which tells them not apart)",
        f"{zero_n:.3g} N are missing both ways, beside {mean_n:.3g} N that it reads",
        "put the load cell's gain right, or the pressures' and the bore",
    )


def _jump(left: Left, own: Array) -> tuple[float, float]:
    """(share of the forces that a jump of one channel's gain leaves at its best moment, that moment
    from 0 to 1).
    """
    inner = np.linspace(ENDS[0], ENDS[1], MOMENTS)
    moments = np.quantile(left.time, inner)
    for finer in (True, False):
        shares = [left.share(own, own * (left.time > at)) for at in moments]
        best = int(np.argmin(shares))
        at, ends = float(moments[best]), moments[[max(best - 1, 0), min(best + 1, MOMENTS - 1)]]
        if finer:
            moments = np.linspace(ends[0], ends[1], MOMENTS)
    return shares[best], at


def _jumps(left: Left, forces: Forces, names: Mapping[str, str]) -> Iterator[Finding]:
    """The one sensor whose gain jumps, where that explains what smooth changes do not."""
    found = []
    for name, own in left.own_n.items():
        share, at = _jump(left, own)
        gain, jump = (float(weight) for weight in left.without(own, own * (left.time > at))[1])
        found.append((share, name, at, (1.0 - gain) / (1.0 - gain - jump)))
    share, name, at, factor = min(found)
    sharp = share < SHARPER * left.share(left.own_n[name], *left.smooth(left.own_n[name]))
    if not sharp or abs(factor - 1.0) < JUMPED:
        return
    others = [names[n] for rest, n, *_ in found if n != name and rest < BESIDE * share]
    at_s = at * (len(forces.even.speed_m_s) - 1) / forces.even.rate_hz
    yield Finding(
        "error",
        names[name],
        f"its gain jumps by a factor of {factor:.3g}"
        + (f" (or that of {' or '.join(others)}, the other way)" if others else ""),
        f"friction, weight and inertia leave {100 * left.share():.2g} % of the forces as it is, "
        f"{100 * share:.2g} % with a jump",
        "cut the recording in two there, and look at the sensor's supply and calibration",
        at_s,
        at_s,
    )
