"""The floor: what the best causal decision from the true load misses, through the sensors' own
delay and noise.

The true normal force of each foot goes through its vertical cylinder's two pressure transducers,
which err as those of the scene do: the same machine, the same draws, the same warmth of the oil.

    p_B   as the scene has it, smoothed;  p_A = (force + A_B p_B) / A_A
    z     = A_A seen(p_A) - A_B seen(p_B),  seen: the amplifier's lag, hysteresis, bow, zero and
            gain by warmth, ripple of the pump, noise, converter (world/sensing.py)
    S_k   = clip(S_(k-1) + clip((F - z_k + b_k) / (2 s), -1, 1), -H, H),  F the force of a loss, s
            the standard deviation of what z errs by

S adds up the likelihood ratio of `less than F` against `more`, at most one a sample, over a window
of 2 H samples: as long as a loss must last. b is the only thing that can be learnt of a slow error:
no load is less than nothing, so what z shows below that is the sensors', and is given back. (To
learn the level of flights too finds more losses and calls more loaded feet lost, at the same cost.)
A foot counts as lost from a threshold of S on, and is held as a detector's state is; both are set
on the tuning scenes for the least cost.

It leaves out what a decision from a foot's own sensors could not help either, and so stays a floor:
zeros and gains at the calibration's temperature, which a commissioning finds, undeclared effects
and drifting sensors, which other legs may contradict, and all that is no sensor: friction, inertia,
oil and legs that are not known. What friction hides at rest, some hundred newtons of a foot, no
sensor of pressure sees, and no detector here is free of it.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from testbed.benchmarks.contact_loss.recordings import Tape
from testbed.benchmarks.contact_loss.scenes import Scene, draw
from testbed.compiled import njit
from testbed.estimation.contact_losses import LossRule
from testbed.estimation.detectors.base import Hold
from testbed.formats.arrays import Array
from testbed.formats.records import Records
from testbed.machine.build import build_machine
from testbed.machine.groups import Sensor
from testbed.machine.model import Machine
from testbed.machine.names import LEGS, VERTICAL
from testbed.robot.robot import LegKinematics
from testbed.scenario.machines import machines_of
from testbed.scenario.scenario import Scenario
from testbed.world.sensing import Transducer, sensor_records, transduce

FLOOR, FLOOR_TEXT = "floor", "true load through the sensors' delay and errors"
FLOOR_THRESHOLD = 0.0
FLOOR_HOLD = Hold(margin=8.0, dwell_s=0.05)
"""Of least cost on the tuning scenes, too: a foot near F is not lost anew with every blow."""
SENSOR_STREAM = 0
"""Of a run's random numbers: its transducers' (world/assembly.py)."""
SMOOTH_S = 0.05
"""Time constant of chamber B's pressure: its place in the range is wanted, not its noise."""
SURE = 3.0
"""By so many standard deviations a smoothed load must lie below nothing to show a zero."""


@dataclass(frozen=True, eq=False)
class SensorPath:
    """The pressure transducers of four vertical cylinders in one run."""

    transducers: NDArray[Any]
    """Transducer (2, 4): chamber by leg, before anything that nobody declared."""
    lag_s: Array
    """Time constant of the amplifiers, (4,)."""
    areas_m2: Array
    """(2, 4)."""
    chamber_b_pa: Array
    """What stands in chamber B, (n, 4)."""
    warm_k: Array
    """Oil's temperature less that of the calibration, (n,)."""
    slow_pa: Array
    """Standard deviation of what a transducer errs by slowly, by its data sheet, (n,)."""
    seed: int

    @classmethod
    def of(cls, scene: Scene, tape: Tape) -> SensorPath:
        """Those of a scene's machine, as drawn."""
        scenario = draw(scene).scenario
        row = tape.samples["row"]
        pressure_b = np.asarray(row["pressure_b"])[:, list(VERTICAL)]
        return cls.built(
            machines_of(scenario).truth,
            scenario,
            _lagged(pressure_b, np.full(len(LEGS), SMOOTH_S), tape.dt_s),
            np.asarray(row["oil_temperature"]),
        )

    @classmethod
    def built(
        cls, machine: Machine, scenario: Scenario, chamber_b_pa: Array, oil_degc: Array
    ) -> SensorPath:
        """Those of a machine in a run of this scenario, drawn as the run draws them."""
        rng = np.random.default_rng([scenario.seed, SENSOR_STREAM])
        drawn, _ = sensor_records(machine, scenario.sensors, rng, scenario.machine.seed)
        axes = [machine.axes[f"{leg}_vertical"] for leg in LEGS]
        bandwidth = np.array([axis.sensor.transducer_bandwidth_hz for axis in axes])
        warm_k = oil_degc - machine.sensor.calibration_temperature_degc
        return cls(
            drawn[:, list(VERTICAL)].copy(),
            1.0 / (2.0 * math.pi * bandwidth),
            np.array([axis.cylinder.areas_m2 for axis in axes]).T.copy(),
            chamber_b_pa,
            warm_k,
            slow_sd_pa(machine.sensor, warm_k),
            scenario.seed,
        )

    @property
    def quick_n(self) -> Array:
        """Standard deviation of what is quick in a measured load: noise, converter, ripple, (4,),
        N.
        """
        t = self.transducers
        variance = t["noise"] ** 2 + t["resolution"] ** 2 / 12.0 + t["ripple"] ** 2 / 2.0
        return np.asarray(np.sqrt((variance * self.areas_m2**2).sum(axis=0)))

    @property
    def error_n(self) -> Array:
        """Standard deviation of all that a measured load errs by, (n, 4), N."""
        slow = np.outer(self.slow_pa, np.hypot(*self.areas_m2))
        return np.asarray(np.hypot(slow, self.quick_n))

    def measured_n(self, force_n: Array, dt_s: float) -> Array:
        """Forces (n, 4) as these sensors show them."""
        area_a, area_b = self.areas_m2
        chamber_a_pa = (force_n + area_b * self.chamber_b_pa) / area_a
        noise = np.random.default_rng([self.seed, 7]).standard_normal((2, *force_n.shape))
        out = np.zeros(force_n.shape)
        for chamber, (area, pressure) in enumerate(
            ((area_a, chamber_a_pa), (-area_b, self.chamber_b_pa))
        ):
            late = _lagged(pressure, self.lag_s, dt_s)
            out += area * _read(
                late, dt_s, self.warm_k, noise[chamber], self.transducers[chamber].copy()
            )
        return out


def slow_sd_pa(sensor: Sensor, warm_k: Array) -> Array:
    """What a data sheet says of bow, loop and zero by warmth, as one standard deviation, (n,), Pa;
    each is as likely anywhere up to its largest.
    """
    per_kelvin = sensor.thermal_zero_share * sensor.pressure_range_pa / sensor.thermal_range_k
    bent = math.hypot(sensor.pressure_linearity_pa, sensor.pressure_hysteresis_pa)
    return np.asarray(np.hypot(per_kelvin * warm_k, bent) / math.sqrt(3.0))


def _lagged(values: Array, lag_s: Array, dt_s: float) -> Array:
    """Columns (n, 4) behind first-order lags (4,), from rest."""
    from scipy.signal import lfilter

    out = np.empty(values.shape)
    for k, lag in enumerate(lag_s):
        keep = math.exp(-dt_s / lag)
        column = values[:, k]
        out[:, k] = lfilter([1.0 - keep], [1.0, -keep], column, zi=[keep * column[0]])[0]
    return out


@njit
def _read(
    pressure: Array, dt_s: float, warm_k: Array, noise: Array, transducers: Records[Transducer]
) -> Array:
    """Readings (n, 4) of Transducers (4,) at these pressures, Pa."""
    out = np.empty(pressure.shape)
    for k in range(pressure.shape[1]):
        transducers[k].shown = pressure[0, k]
        for n in range(pressure.shape[0]):
            t = dt_s * n
            out[n, k] = transduce(pressure[n, k], t, warm_k[n], noise[n, k], transducers[k])
    return out


def floor_scores(normal_n: Array, path: SensorPath, rule: LossRule, dt_s: float) -> Array:
    """Scores (n, 4), -H to H, of true normal forces (n, 4)."""
    out = np.empty(normal_n.shape)
    half = 0.5 * rule.shortest_s / dt_s
    seen = path.measured_n(normal_n, dt_s)
    share = dt_s / (rule.shortest_s + dt_s)
    margin = SURE * path.quick_n * math.sqrt(0.5 * share)
    _add_up(seen, rule.force_n, path.error_n, margin, share, half, out)
    return out


@njit
def _add_up(
    seen: Array, force: float, sd: Array, margin: Array, share: float, most: float, out: Array
) -> None:
    """Loads (n, 4) as measured, with their errors sd (n, 4) -> scores (n, 4). `share`: of a sample
    in the running mean; margin (4): what that may lie below nothing by noise.
    """
    for foot in range(seen.shape[1]):
        total, zero, mean = 0.0, 0.0, seen[0, foot]
        for n in range(seen.shape[0]):
            mean += share * (seen[n, foot] - mean)
            zero = min(zero, mean + margin[foot])
            gain = (force + zero - seen[n, foot]) / (2.0 * sd[n, foot])
            total += min(max(gain, -1.0), 1.0)
            total = min(max(total, -most), most)
            out[n, foot] = total


# The limit that friction sets: what one decides who knows all but the friction of resting pistons.
#
# Like the floor above this sees the true load through the transducers' own delay and
# errors, but the load and the *true* friction of the cylinder together, as a piston's pressures
# show them:
#
#     z_k = seen(load_k + friction_k)
#
# All constants, inertia, weight, ropes and drill are known exactly, undeclared effects too. Of the
# friction of a piston that does not slide only its set is: within +-g_k, as far as this cylinder's
# went in this scene; while it slides by its encoder, friction is known. What remains is a set of
# loads:
#
#     one foot     L_k in [z_k - g_k, z_k + g_k],  L_k >= 0
#     four feet    moreover the loads keep the body's balance exactly, so that all four err by one
#                  number, the internal force t that weight and moments leave open:
#                  L = L_true + t n, n the loads without force and moment
#
# Every load in its set is as likely as any other; the score is the log of the odds of less than a
# loss's force against more, smoothed over a quarter of a loss's shortest time. It has no memory:
# what the last slip, the oil's creep and a foot that is stirred tell of friction is not used, which
# is all that a detector may know more.

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
            low, high, tape.normal_n, internal_modes(np.asarray(tape.samples["row"]["position"]))
        )
    share = (tape.rule.force_n - low) / np.maximum(high - low, 1.0)
    odds = _log_odds(np.clip(share, 0.0, 1.0))
    return _smoothed(odds, SMOOTH_SHARE * tape.rule.shortest_s, tape.dt_s)


def balanced(low: Array, high: Array, load: Array, mode: Array) -> tuple[Array, Array]:
    """Sets of loads [low, high] (n, 4) that are left where the loads err by a multiple of `mode`
    (n, 4) alone; true loads (n, 4), N.
    """
    size = np.where(np.abs(mode) < 1.0e-3, 1.0e-3, mode)
    ends = np.stack([(low - load) / size, (high - load) / size])
    least = np.minimum(ends.min(axis=0).max(axis=1), 0.0)
    most = np.maximum(ends.max(axis=0).min(axis=1), 0.0)
    edges = np.stack([load + least[:, None] * mode, load + most[:, None] * mode])
    return np.maximum(edges.min(axis=0), 0.0), edges.max(axis=0)


def internal_modes(position: Array) -> Array:
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
