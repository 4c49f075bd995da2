"""The limit that friction sets: what one decides who knows all but the friction of resting pistons.

Like the floor (floor.py) this sees the true load through the transducers' own delay and errors, but
the load and the *true* friction of the cylinder together, as a piston's pressures show them:

    z_k = seen(load_k + friction_k)

All constants, inertia, weight, ropes and drill are known exactly, undeclared effects too. Of the
friction of a piston that does not slide only its set is: within +-g_k, as far as this cylinder's
went in this scene; while it slides by its encoder, friction is known. What remains is a set of
loads:

    one foot     L_k in [z_k - g_k, z_k + g_k],  L_k >= 0
    four feet    moreover the loads keep the body's balance exactly, so that all four err by one
                 number, the twist t that weight and moments leave open: L = L_true + t n, n the
                 loads without force and moment

Every load in its set is as likely as any other; the score is the log of the odds of less than a
loss's force against more, smoothed over a quarter of a loss's shortest time. It has no memory: what
the last slip, the oil's creep and a foot that is stirred tell of friction is not used, which is all
that a detector may know more.
"""

from __future__ import annotations

import numpy as np

from testbed.benchmarks.contact_loss.floor import SensorPath
from testbed.benchmarks.contact_loss.scenes import Scene
from testbed.benchmarks.contact_loss.tapes import Tape
from testbed.estimation.detectors.base import Hold
from testbed.formats.arrays import Array
from testbed.machine.build import build_machine
from testbed.machine.names import LEGS
from testbed.robot.robot import LegKinematics

ONE, FOUR = "limit_one_foot", "limit_four_feet"
TEXTS = {
    ONE: "limit: pressures of one foot without error but for friction's set and the sensors'",
    FOUR: "limit: the same of all feet, with the body's balance known exactly",
}
THRESHOLDS = {ONE: 4.0, FOUR: 4.0}
GRID = tuple(np.arange(-2.0, 11.1, 1.0).tolist())
HOLDS = {
    ONE: Hold(margin=6.5, dwell_s=0.6, sure_margin=8.5, sure_s=0.02),
    FOUR: Hold(margin=8.0, dwell_s=0.6, sure_margin=9.5, sure_s=0.05),
}
"""Of little cost on tuning scenes."""
SET_QUANTILE = 0.995
"""Of the size of a cylinder's friction in a scene: the half width of its set."""
SLIDING_M_S = 1.0e-3
"""From this speed on, by the encoder, a piston slides."""
MOST_ODDS = 12.0
"""The log of the odds is kept within this."""
SMOOTH_SHARE = 0.25
"""Time constant of the score, share of a loss's shortest time."""


def limit_scores(name: str, tape: Tape, scene: Scene) -> Array:
    """Scores (n, 4) of ONE or FOUR over a scene's tape."""
    path = SensorPath.of(scene, tape)
    friction = tape.friction_n
    width = np.quantile(np.abs(friction), SET_QUANTILE, axis=0)
    slides = np.abs(np.asarray(tape.samples["derived"]["velocity"])) > SLIDING_M_S
    unknown = np.where(slides, 0.0, width) + path.quick_n
    known = np.where(slides, friction, 0.0)
    middle = path.measured_n(tape.normal_n + friction, tape.dt_s) - known
    low, high = np.maximum(middle - unknown, 0.0), np.maximum(middle + unknown, 1.0)
    if name == FOUR:
        low, high = balanced(
            low, high, tape.normal_n, twists(np.asarray(tape.samples["row"]["position"]))
        )
    share = (tape.rule.force_n - low) / np.maximum(high - low, 1.0)
    odds = _log_odds(np.clip(share, 0.0, 1.0))
    return _smoothed(odds, SMOOTH_SHARE * tape.rule.shortest_s, tape.dt_s)


def balanced(low: Array, high: Array, load: Array, twist: Array) -> tuple[Array, Array]:
    """Sets of loads [low, high] (n, 4) that are left where the loads err by a multiple of `twist`
    (n, 4) alone; true loads (n, 4), N.
    """
    size = np.where(np.abs(twist) < 1.0e-3, 1.0e-3, twist)
    ends = np.stack([(low - load) / size, (high - load) / size])
    least = np.minimum(ends.min(axis=0).max(axis=1), 0.0)
    most = np.maximum(ends.max(axis=0).min(axis=1), 0.0)
    edges = np.stack([load + least[:, None] * twist, load + most[:, None] * twist])
    return np.maximum(edges.min(axis=0), 0.0), edges.max(axis=0)


def twists(position: Array) -> Array:
    """Loads (n, 4) of the feet without force and moment, largest 1, from joints (n, 12), rad and
    m.
    """
    legs = LegKinematics.from_machine(build_machine())
    every = max(len(position) // 50, 1)
    out = np.empty((len(position), len(LEGS)))
    for start in range(0, len(position), every):
        feet = legs.feet(position[start])
        balance = np.vstack([np.ones(len(LEGS)), feet[:, 0], feet[:, 1]])
        free = np.linalg.svd(balance)[2][-1]
        out[start : start + every] = free / np.abs(free).max()
    return out


def _log_odds(share: Array) -> Array:
    """Log odds of shares, kept within MOST_ODDS."""
    edge = 1.0 / (1.0 + np.exp(MOST_ODDS))
    inside = np.clip(share, edge, 1.0 - edge)
    return np.asarray(np.log(inside / (1.0 - inside)))


def _smoothed(values: Array, time_s: float, dt_s: float) -> Array:
    """Columns (n, 4) behind a running mean of this time constant."""
    from scipy.signal import lfilter

    share = dt_s / (time_s + dt_s)
    start = (1.0 - share) * values[:1]
    return np.asarray(lfilter([share], [1.0, share - 1.0], values, axis=0, zi=start)[0])
