"""Forces that a simulated bench or drive has and its published model lacks: listed effects, and
others.

Each law gives the force against extension, N, shape (n,), along a prescribed motion; `size_n` is
what it is worth. What is listed follows the formula of its name; what is outside the list follows
none of them.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from testbed.formats.arrays import Array
from testbed.formats.yaml_files import read_yaml

LISTED = read_yaml(Path(__file__).with_name("listed_laws.yaml"))
"""Which law stands for which listed effect, by kind of rig."""


@dataclass(frozen=True)
class Motion:
    """A prescribed motion, each array of shape (n,), SI; `level_n`: friction's Coulomb level;
    `pressure_pa`: of chamber A, 0 on a drive; `current`: of an actuator that nobody declares, 0 to
    1.
    """

    time_s: Array
    position_m: Array
    velocity_m_s: Array
    acceleration_m_s2: Array
    pressure_pa: Array
    current: Array
    level_n: float
    stroke_m: float

    @property
    def direction(self) -> Array:
        """Sign of the speed, softened over 1 mm/s."""
        return np.tanh(self.velocity_m_s / 1e-3)

    @property
    def fastest_m_s(self) -> float:
        """The speed that one sample in fifty exceeds."""
        return float(np.percentile(np.abs(self.velocity_m_s), 98))


Law = Callable[[Motion, float, np.random.Generator], Array]
"""(motion, size_n, random numbers that are the same for all recordings of a rig) -> force, N."""


def bristle(motion: Motion, size_n: float, reach_m: float) -> Array:
    """An elastic element that slips at `size_n` after `reach_m`: clipped increments, N."""
    out = np.zeros_like(motion.position_m)
    step = np.diff(motion.position_m) * size_n / reach_m
    for index in range(1, len(out)):
        out[index] = min(max(out[index - 1] + step[index - 1], -size_n), size_n)
    return out


def soft_bristle(motion: Motion, size_n: float, reach_m: float) -> Array:
    """The first-order bristle of `friction.presliding`: dz = dx - |dx| z / reach, N."""
    out = np.zeros_like(motion.position_m)
    for index, moved in enumerate(np.diff(motion.position_m), start=1):
        aim = size_n if moved > 0.0 else -size_n
        out[index] = aim + (out[index - 1] - aim) * np.exp(-abs(moved) / reach_m)
    return out


def _lagged(values: Array, rate_hz: float, time_constant_s: float) -> Array:
    from scipy.signal import lfilter

    share = 1.0 - np.exp(-1.0 / (rate_hz * time_constant_s))
    return np.asarray(lfilter([share], [1.0, share - 1.0], values))


def _rate_hz(motion: Motion) -> float:
    return 1.0 / float(motion.time_s[1] - motion.time_s[0])


def quadratic_drag(motion: Motion, size_n: float, rng: np.random.Generator) -> Array:
    """Grows with the square of the speed, in one direction more than in the other."""
    skew = 1.0 + rng.uniform(0.2, 0.6) * motion.direction
    speed = motion.velocity_m_s / motion.fastest_m_s
    return 2.0 * size_n * skew * speed * np.abs(speed)


def hysteresis(motion: Motion, size_n: float, rng: np.random.Generator) -> Array:
    """Prandtl and Ishlinskii: elements that slip after 1 to 60 % of the travel, and remember where
    they turned.
    """
    travel = float(np.ptp(motion.position_m))
    reaches = travel * np.geomspace(0.01, 0.6, 6)
    shares = rng.dirichlet(np.ones(6))
    parts = [
        bristle(motion, 2.0 * size_n * share, reach)
        for share, reach in zip(shares, reaches, strict=True)
    ]
    return np.asarray(np.sum(parts, axis=0))


def cogging(motion: Motion, size_n: float, rng: np.random.Generator) -> Array:
    """Four harmonics of a pitch along the stroke."""
    pitch = motion.stroke_m * rng.uniform(0.06, 0.2)
    weights, phases = rng.uniform(0.4, 1.0, 4), rng.uniform(0.0, 2.0 * np.pi, 4)
    angle = 2.0 * np.pi * motion.position_m / pitch
    pairs = enumerate(zip(weights, phases, strict=True), start=1)
    waves = [weight * np.sin(order * angle + phase) for order, (weight, phase) in pairs]
    return np.asarray(size_n * np.sum(waves, axis=0))


def damper(motion: Motion, size_n: float, rng: np.random.Generator) -> Array:
    """A semi-active damper: its level follows a current that the model does not know."""
    knee = motion.fastest_m_s * rng.uniform(0.05, 0.2)
    return 2.5 * size_n * motion.current * np.tanh(motion.velocity_m_s / knee)


def lagging(motion: Motion, size_n: float, rng: np.random.Generator) -> Array:
    """Friction that follows the speed late, so that it is not the same on the way up and on the way
    down.
    """
    speed = _lagged(np.abs(motion.velocity_m_s), _rate_hz(motion), rng.uniform(0.15, 0.5))
    knee = motion.fastest_m_s * rng.uniform(0.15, 0.4)
    return 2.5 * size_n * motion.direction * np.exp(-((speed / knee) ** 1.5))


def wander(motion: Motion, size_n: float, rng: np.random.Generator) -> Array:
    """A slow force of no state at all: a cable that drags, a guide that warms up here and there."""
    own = np.random.default_rng([int(1e6 * abs(motion.position_m[0])), len(motion.time_s)])
    noise = own.standard_normal(len(motion.time_s))
    slow = _lagged(_lagged(noise, _rate_hz(motion), 0.4), _rate_hz(motion), 0.4)
    return 1.5 * size_n * slow / max(float(np.std(slow)), 1e-12)


def power_stroke(motion: Motion, size_n: float, rng: np.random.Generator) -> Array:
    """Friction that waxes and wanes several times along the stroke."""
    waves = rng.uniform(2.0, 5.0)
    return (
        2.0
        * size_n
        * motion.direction
        * np.sin(2.0 * np.pi * waves * motion.position_m / motion.stroke_m)
    )


OUTSIDE: dict[str, Law] = {
    "quadratic drag": quadratic_drag,
    "hysteresis": hysteresis,
    "cogging": cogging,
    "damper": damper,
    "lagging": lagging,
    "wander": wander,
    "waves along the stroke": power_stroke,
}


USUAL_1_S2 = 2.5
"""Acceleration of these motions by their stroke. What is hidden is the machine's: the same in every
recording of a rig, whatever the motion."""
DRAWN_IN, CUSHION = 0.14, 0.36
"""Shares of the stroke: about the least extension of these motions, and where a cushion begins."""


def along(motion: Motion, size_n: float, rng: np.random.Generator) -> Array:
    """friction.position, its slope such that it is worth `size_n` at the ends."""
    return 3.0 * size_n * motion.direction * (motion.position_m / motion.stroke_m - 0.5)


def presliding(motion: Motion, size_n: float, rng: np.random.Generator) -> Array:
    """friction.presliding: the Coulomb level builds up over some millimetres."""
    reach = motion.stroke_m * rng.uniform(0.015, 0.045)
    return soft_bristle(motion, motion.level_n, reach) - motion.level_n * motion.direction


def mass(motion: Motion, size_n: float, rng: np.random.Generator) -> Array:
    """inertia.mass of a level axis, at USUAL_1_S2 as large as the Coulomb level; its size is not
    `size_n`.
    """
    return motion.level_n * motion.acceleration_m_s2 / (USUAL_1_S2 * motion.stroke_m)


def spring(motion: Motion, size_n: float, rng: np.random.Generator) -> Array:
    """force.spring."""
    return 4.0 * size_n * (motion.position_m / motion.stroke_m - rng.uniform(0.2, 0.5))


def cushion(motion: Motion, size_n: float, rng: np.random.Generator) -> Array:
    """force.cushion: near the retracted end."""
    start, reach = CUSHION * motion.stroke_m, (CUSHION - DRAWN_IN) * motion.stroke_m
    return np.asarray(-5.0 * size_n * np.maximum(start - motion.position_m, 0.0) / reach)


def pressing(motion: Motion, size_n: float, rng: np.random.Generator) -> Array:
    """friction.pressure, at 3 bar half as large as the Coulomb level; its size is not `size_n`."""
    return 0.5 * motion.level_n * motion.direction * motion.pressure_pa / 3e5


def _listed(kind: str) -> dict[str, Law]:
    """Laws by the name of the effect that each stands for, on one kind of rig."""
    laws: dict[str, Law] = {
        law.__name__: law for law in (along, presliding, mass, spring, cushion, pressing)
    }
    return {effect: laws[law] for effect, law in LISTED[kind].items()}


ON_A_DRIVE: dict[str, Law] = _listed("drive")
ON_A_CYLINDER: dict[str, Law] = _listed("cylinder")
AS_LARGE_AS_FRICTION: tuple[str, ...] = tuple(LISTED["as_large_as_friction"])
"""Listed laws whose size one recording does not determine: friction itself sets it."""
