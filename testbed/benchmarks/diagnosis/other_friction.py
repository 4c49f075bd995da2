"""Friction of other laws than the simulator's, in all twelve cylinders at once, as a change of a
recording's pressures.

A robot whose valves hold its positions moves as it is told, whatever its seals are like: another
friction is found in its pressures, hardly in its motion. Each law gives the force that a piston has
to push against beside its own friction, N, shape (n, 12), AXES order, with the sign of the motion;
what it rests at stays, as a stuck seal and shut-in oil hold it.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass

import numpy as np
from scipy.ndimage import gaussian_filter1d
from scipy.signal import lfilter

from testbed.formats.arrays import Array
from testbed.machine.model import Machine
from testbed.machine.names import AXES
from testbed.robot.robot import Robot

EVERY_S = 0.01
"""Friction is reckoned so often, and goes straight in between."""
SMOOTH_S = 0.02
"""Encoders' counts are smoothed over so long, standard deviation."""
TURNED_M = 2.0e-4
"""A plain law has turned round after such a way: less than that encoders do not show."""
SHARE_OF_COULOMB = (0.03, 0.08)
"""How large each cylinder's is, of the drawing's Coulomb friction: what a workshop leaves (E)."""
MOVES_M_S = 5.0e-4


@dataclass(frozen=True, eq=False)
class Pistons:
    """How the pistons move, every EVERY_S: (n, 12) each but `time_s` (n,)."""

    time_s: Array
    extension_m: Array
    speed_m_s: Array
    level_n: Array
    """(12,) size of the friction."""

    @property
    def sense(self) -> Array:
        """Sense of the last motion, -1 to 1."""
        return elastic(self.extension_m, TURNED_M)

    @property
    def step_s(self) -> float:
        """Between two instants."""
        return float(self.time_s[1] - self.time_s[0])


Law = Callable[[Pistons, np.random.Generator], Array]
"""(motion, random numbers that are the same for all recordings of a machine) -> force, N."""


def elastic(way_m: Array, reach_m: float | Array) -> Array:
    """(n, k) an elastic element that follows ways (n, k) and slips after `reach_m`, number or (k,):
    -1 to 1, from 0.
    """
    out = np.zeros_like(way_m)
    steps = np.diff(way_m, axis=0) / reach_m
    for at, step in enumerate(steps, start=1):
        out[at] = np.clip(out[at - 1] + step, -1.0, 1.0)
    return out


def bristles(pistons: Pistons, rng: np.random.Generator) -> Array:
    """Maxwell slip: three elements in each seal that slip after 0.3 to 3 mm."""
    count = pistons.extension_m.shape[1]
    shares = rng.dirichlet(np.ones(3), count).T
    reaches_m = np.exp(rng.uniform(np.log(0.3e-3), np.log(3.0e-3), (3, count)))
    parts = zip(shares, reaches_m, strict=True)
    made = [share * elastic(pistons.extension_m, reach) for share, reach in parts]
    return np.asarray(np.sum(made, axis=0))


def waves(pistons: Pistons, rng: np.random.Generator) -> Array:
    """Waxes and wanes along the stroke, every 5 to 40 mm."""
    count = pistons.extension_m.shape[1]
    length_m = rng.uniform(5.0e-3, 40.0e-3, count)
    phase = rng.uniform(0.0, 2.0 * np.pi, count)
    return pistons.sense * np.sin(2.0 * np.pi * pistons.extension_m / length_m + phase)


def lagging(pistons: Pistons, rng: np.random.Generator) -> Array:
    """A film that builds up and drains late: less on the way to rest than on the way from it."""
    count = pistons.extension_m.shape[1]
    knee_m_s = rng.uniform(3.0e-3, 15.0e-3, count)
    late_s = np.asarray(rng.uniform(0.15, 0.5, count))
    speed = np.abs(pistons.speed_m_s)
    film = np.empty_like(speed)
    for k in range(count):
        share = -np.expm1(-pistons.step_s / late_s[k])
        film[:, k] = lfilter([share], [1.0, share - 1.0], speed[:, k])
    missing = np.exp(-film / knee_m_s) - np.exp(-speed / knee_m_s)
    return np.asarray(2.0 * pistons.sense * missing)


def stribeck(pistons: Pistons, rng: np.random.Generator) -> Array:
    """Falls with speed by another exponent than the model's 2, steeply at first or late."""
    count = pistons.extension_m.shape[1]
    knee_m_s = rng.uniform(3.0e-3, 15.0e-3, count)
    exponent = np.where(rng.random(count) < 0.5, rng.uniform(0.4, 0.8, count), 4.0)
    fallen = np.exp(-((np.abs(pistons.speed_m_s) / knee_m_s) ** exponent))
    return pistons.sense * fallen


def breakaway(pistons: Pistons, rng: np.random.Generator) -> Array:
    """More after a rest, the more the longer it was, gone after 0.5 to 3 mm of sliding."""
    count = pistons.extension_m.shape[1]
    sticks_s = rng.uniform(1.0, 10.0, count)
    gone_m = rng.uniform(0.5e-3, 3.0e-3, count)
    moves = np.abs(pistons.speed_m_s) > MOVES_M_S
    steps = np.abs(np.diff(pistons.extension_m, axis=0, prepend=pistons.extension_m[:1]))
    fades = np.where(moves, np.exp(-steps / gone_m), 1.0)
    grows = np.where(moves, 1.0, np.exp(-pistons.step_s / sticks_s))
    stuck = np.zeros_like(steps)
    for at in range(1, len(steps)):
        stuck[at] = (1.0 - (1.0 - stuck[at - 1]) * grows[at]) * fades[at]
    return 2.0 * pistons.sense * stuck


LAWS: Mapping[str, Law] = {
    law.__name__: law for law in (bristles, waves, lagging, stribeck, breakaway)
}


def pistons_of(data: Mapping[str, Array], robot: Robot, rng: np.random.Generator) -> Pistons:
    """How the pistons of a recording move, and how large each one's friction of another law is."""
    time_s = np.asarray(data["t"])
    smooth = SMOOTH_S / float(np.median(np.diff(time_s)))
    joints = np.column_stack([data[f"position_{axis}"] for axis in AXES])
    extension = gaussian_filter1d(robot.linkages.rods(joints)[0], smooth, axis=0, mode="nearest")
    at = np.arange(time_s[0], time_s[-1], EVERY_S)
    sampled = np.column_stack([np.interp(at, time_s, one) for one in extension.T])
    cylinders = [axis.cylinder for axis in robot.machine.axes.values()]
    coulomb_n = np.array([0.5 * (c.coulomb_out_n + c.coulomb_in_n) for c in cylinders])
    level_n = coulomb_n * rng.uniform(*SHARE_OF_COULOMB, len(AXES))
    return Pistons(at, sampled, np.gradient(sampled, EVERY_S, axis=0), level_n)


def change_of(
    law: str, data: Mapping[str, Array], robot: Robot, rng: np.random.Generator, size: float
) -> dict[str, Array]:
    """Column -> (samples,) Pa by which the pressures are higher with friction of this law that is
    `size` times as large as SHARE_OF_COULOMB.
    """
    pistons = pistons_of(data, robot, rng)
    force_n = size * pistons.level_n * LAWS[law](pistons, rng)
    out = {}
    for axis, force in zip(AXES, force_n.T, strict=True):
        now = np.interp(data["t"], pistons.time_s, force)
        for column, by_force in zip(_columns(axis), _shared(robot.machine, axis), strict=True):
            out[column] = by_force * now
    return out


def _columns(axis: str) -> tuple[str, str]:
    return f"pressure_a_{axis}", f"pressure_b_{axis}"


def _shared(machine: Machine, axis: str) -> tuple[float, float]:
    """Pa by a newton of pistons' force in chambers A and B, as one spool shares it: its drops at
    both edges stay in the ratio of the squares of the areas.
    """
    area_a, area_b = machine.axes[axis].cylinder.areas_m2
    share = 1.0 / (1.0 + (area_b / area_a) ** 3)
    return share / area_a, (share - 1.0) / area_b
