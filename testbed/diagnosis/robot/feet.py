"""The feet's places: a foot that stands does not move, so encoders and attitude must agree on where
it is.

In the frame of the slope, turned by the measured attitude, every standing foot is at its own place
plus the body's way, which is the same for all four. What is left says that a foot slipped or sank,
or that an encoder's zero is elsewhere. A joint with play lies at one end of it or the other, unseen
by its encoder: its foot seems to go to and fro as the leg is turned and pushed.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from testbed.diagnosis.robot.balance import BodyBalance
from testbed.diagnosis.robot.bins import Bins
from testbed.diagnosis.robot.evidence import RawGroup
from testbed.diagnosis.robot.piston_positions import lies_in_play, wanders
from testbed.diagnosis.robot.tolerances import standard_deviation
from testbed.effects.signature import Change
from testbed.machine.names import AXES, LEGS
from testbed.machine.scale import Scale

Array = npt.NDArray[np.float64]
ALL_ALONG, MEANT = 0.99, 0.01
"""A foot carries all along a bin from the first share on; below the second it is lifted, and stands
at another place afterwards. One that is unloaded without being lifted stays where it is.
"""
EVERY = 3
"""Every third bin: places change slowly."""
WHITE_M, SLOW_M, SLOW_S = 1.0e-4, 2.0e-4, 5.0
"""Rounding of the encoders; creep of foot and ground (E)."""
PLACE_M, WAY_M = 5.0, 5.0
"""Nobody knows where a foot was set down, nor where the body went."""
GIVES_M_N = 1.5e-7
"""A ground of 7 MN/m gives by this under a newton, more or less (E)."""
SLIPS_AT, SURELY_AT, SLIP_M = 0.15, 0.35, 1.5e-3
"""A foot that uses more friction than the first may slip; from the second on by SLIP_M from bin to
bin: a sound machine on its ground does, too (E).
"""
GIVES_WAY_AT, GONE_AT, GOES_M = 0.45, 0.6, 8.0e-3
"""Between these uses of friction the ground of a sound machine gives way, and a foot goes as far as
that from bin to bin (E).
"""
ROLLS = 0.02
"""What slips goes off the slope by this share of it (E)."""
LEAST_LOAD_N, AROUND = 1500.0, 3
"""A foot that carries less in one of so many bins to either side may be in the air."""
NEAR_BINS = 5
"""A slip comes about a bin's use of friction: so many bins to either side count."""
TILT_RAD = 2.0e-4
"""Noise of the inertial unit in a bin (E)."""


@dataclass(frozen=True, eq=False)
class Standing:
    """Rows of the group: place (m) of a standing foot along one axis of the slope's frame in one
    bin.
    """

    bins: npt.NDArray[np.int64]
    legs: npt.NDArray[np.int64]
    axes: npt.NDArray[np.int64]
    phase: npt.NDArray[np.int64]
    """Which standing of this foot it is."""
    missing: Array


def group_of(balance: BodyBalance, bins: Bins, scale: Scale) -> RawGroup | None:
    """The group of a measured robot; None where no foot bears enough to be sure that it stands, as
    on a wall.
    """
    standing = standing_of(balance, bins, scale)
    if not len(standing.bins):
        return None
    return RawGroup(
        missing=standing.missing,
        time_s=bins.time_s[standing.bins],
        noise=_noise(standing, balance, scale),
        tolerated=_tolerated(standing, balance, scale),
        rows_of=lambda change: rows_of(standing, balance, change),
        unknown=_unknown(standing),
    )


def _unknown(s: Standing) -> tuple[npt.NDArray[np.intp], ...]:
    """Nobody knows where a foot was set down, nor where the body is in a bin."""
    place = np.ravel_multi_index((s.legs, s.phase, s.axes), (len(LEGS), int(s.phase.max()) + 1, 3))
    return np.asarray(place), np.asarray(3 * s.bins + s.axes)


def standing_of(balance: BodyBalance, bins: Bins, scale: Scale) -> Standing:
    """Which foot stands when, and where it seems to be."""
    least_n = scale.times("N") * LEAST_LOAD_N
    stands = _stands(bins, in_slope(balance, balance.foot_force)[:, :, 2], least_n)
    some = stands.copy()
    some[np.arange(bins.count) % EVERY != 0] = False
    k, leg = np.nonzero(some)
    meant = bins.carrying > MEANT
    phases = np.cumsum(np.diff(meant.astype(int), axis=0, prepend=0) > 0, axis=0)
    rows, legs, axes = (np.repeat(k, 3), np.repeat(leg, 3), np.tile(np.arange(3), len(k)))
    place = in_slope(balance, balance.seen.foot_m)
    missing = place[rows, legs, axes]
    if len(missing):
        missing = missing - missing.mean()
    return Standing(rows, legs, axes, phases[rows, legs].astype(np.int64), missing)


def rows_of(standing: Standing, balance: BodyBalance, change: Change) -> Array:
    """One column of the group: what `change` does to its rows."""
    if change.feet is None:
        return np.zeros(len(standing.missing))
    moved = in_slope(balance, change.feet)
    return np.asarray(moved[standing.bins, standing.legs, standing.axes])


def in_slope(balance: BodyBalance, points: Array) -> Array:
    """Points or ways (n, 4, 3) of the body frame along x up the slope, y left, z off it."""
    return np.asarray(np.einsum("nij,nlj->nli", balance.seen.slope_frame, points))


def _stands(bins: Bins, load_n: Array, least_n: float) -> npt.NDArray[np.bool_]:
    """(n, 4) a foot is meant to carry and does, by its load off the slope (n, 4), in this bin and
    in those about it.
    """
    carries = (bins.carrying > ALL_ALONG) & (load_n > least_n)
    return np.asarray(_about(carries, AROUND).all(axis=0))


def _about(values: Array | npt.NDArray[np.bool_], reach: int) -> npt.NDArray[np.generic]:
    """(2 reach + 1, n, ...) values (n, ...) of the bins about each bin."""
    bins = np.arange(len(values))
    near = [np.clip(bins + k, 0, len(values) - 1) for k in range(-reach, reach + 1)]
    return np.array([values[index] for index in near])


def _noise(s: Standing, balance: BodyBalance, scale: Scale) -> Array:
    """Covariance of the rows beside what tolerances make."""
    seen, slow_m, white_m = balance.seen, scale.length * SLOW_M, scale.length * WHITE_M
    time = seen.time_s[s.bins]
    same_foot = (s.legs[:, None] == s.legs[None, :]) & (s.phase[:, None] == s.phase[None, :])
    same_axis = s.axes[:, None] == s.axes[None, :]
    apart = np.abs(time[:, None] - time[None, :])
    own = np.where(same_foot & same_axis, slow_m**2 * np.exp(-apart / SLOW_S) + PLACE_M**2, 0.0)
    body = np.where((apart == 0.0) & same_axis, WAY_M**2, 0.0)
    level = (s.axes < 2)[:, None] & (s.axes < 2)[None, :]
    slipped = np.cumsum((scale.length * _slips(seen.friction_use)) ** 2, axis=0)[s.bins, s.legs]
    walk = np.minimum(slipped[:, None], slipped[None, :])
    out = own + body + white_m**2 * np.eye(len(time))
    out += np.where(same_foot & same_axis, np.where(level, 1.0, ROLLS**2) * walk, 0.0)
    for turned in _turned(s, balance):
        out += np.where(apart == 0.0, TILT_RAD**2, 0.0) * np.outer(turned, turned)
    for _, unsure in _played(s, balance, scale):
        out += wanders(time) * np.outer(unsure, unsure)
    return np.asarray(out)


def _played(s: Standing, balance: BodyBalance, scale: Scale) -> list[tuple[Array, Array]]:
    """What rows do by the play of each rotation joint, a standard deviation of it: where the leg's
    last motion left the joint, and where it may have gone since.
    """
    seen = balance.seen
    sd = standard_deviation("joint.play@*.half_width", scale=scale)
    lies, unsure = lies_in_play(seen.direction[:, ::3])
    out = []
    for leg in range(len(LEGS)):
        feet = np.zeros_like(seen.foot_m)
        feet[:, leg] = sd * seen.foot_by_joint[:, leg, :, 0]
        rows = in_slope(balance, feet)[s.bins, s.legs, s.axes]
        out.append((lies[s.bins, leg] * rows, unsure[s.bins, leg] * rows))
    return out


def _slips(use: Array) -> Array:
    """(n, 4) how far a foot of a sound machine may slip in a bin, m, by the friction it uses about
    then, (n, 4); of ROBOCLIMBER.
    """
    most = _about(use, NEAR_BINS).max(axis=0)
    slips = SLIP_M * np.clip((most - SLIPS_AT) / (SURELY_AT - SLIPS_AT), 0.0, 1.0)
    goes = GOES_M * np.clip((most - GIVES_WAY_AT) / (GONE_AT - GIVES_WAY_AT), 0.0, 1.0)
    return np.asarray(slips + goes)


def _turned(s: Standing, balance: BodyBalance) -> list[Array]:
    """What rows do if the body seems turned by 1 rad about x, y, z of the slope."""
    place = in_slope(balance, balance.seen.foot_m)
    middle = place - place.mean(axis=1, keepdims=True)
    return [np.cross(about, middle)[s.bins, s.legs, s.axes] for about in np.eye(3)]


def _tolerated(s: Standing, balance: BodyBalance, scale: Scale) -> Array:
    """(rows, k): every column a tolerance times its standard deviation."""
    seen = balance.seen
    force = in_slope(balance, balance.foot_force)
    gives = scale.times("m/N") * GIVES_M_N * force[s.bins, s.legs, s.axes]
    columns = [gives * (s.axes == k) for k in range(3)]
    sd = standard_deviation("sensor.encoder_offset@*.offset", scale=scale)
    for i in range(len(AXES)):
        leg, joint = divmod(i, 3)
        feet = np.zeros_like(seen.foot_m)
        feet[:, leg] = seen.foot_by_joint[:, leg, :, joint]
        columns.append(sd * in_slope(balance, feet)[s.bins, s.legs, s.axes])
    columns += [lies for lies, _ in _played(s, balance, scale)]
    unit = standard_deviation("robot.attitude@body.roll")
    columns += [unit * turned for turned in _turned(s, balance)]
    return np.column_stack(columns)
