"""Every estimator on the same runs: the paper's ladder, ours built up and with each idea taken
away, sensors' floor.

A run's scores are sums, so that runs add up: `scores` makes them, `merged` adds them, `marks` turns
them into numbers.
Moving: the vertical cylinder faster than 3 mm/s by the encoder, smoothed over 5 ms to both sides;
the first second of a run, in which everything starts from nothing, is left out.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable
from dataclasses import replace
from typing import Any

import numpy as np

from testbed.benchmarks.estimators.trials import BASE_C, Series
from testbed.estimation.detectors.base import start
from testbed.estimation.estimator import estimator_of, loads_over
from testbed.estimation.filters import persistent
from testbed.estimation.leg.motion import motion, through_steps
from testbed.estimation.live.believed import Believed
from testbed.estimation.live.joined import replay, replay_rows
from testbed.estimation.live.own_tuning import OwnTuning, without
from testbed.formats.arrays import Array
from testbed.formats.intervals import Z90
from testbed.formats.sockets import user_code
from testbed.machine.names import LEGS
from testbed.robot.model import RobotModel
from testbed.world.believed_robot import BelievedRobot

Scores = dict[str, dict[str, dict[str, Any]]]
MOVING_M_S, SLOW_M_S = 3e-3, 5e-3
LEFT_OUT_S = 1.0
FULL_SCALE_N = 15_000.0
BIN_N, BINS = 5.0, 1200

PAPER = ("one_chamber", "two_chamber", "friction", "kbf", "modified_kbf")
IDEAS = ("rich", "swing", "balance", "friction", "weighs", "robust", "shakes")
NOTHING = without(OwnTuning(), *IDEAS)
OWN: dict[str, OwnTuning] = {
    "three cylinders": NOTHING,
    "+ what friction depends on": replace(NOTHING, rich=True),
    "+ zero learnt in swing": replace(NOTHING, rich=True, swing=True),
    "+ balance of the body": replace(NOTHING, rich=True, swing=True, balance=True),
    "+ friction learnt": without(OwnTuning(), "weighs", "robust", "shakes"),
    "own: all, robust": OwnTuning(),
    "own without what friction depends on": without(OwnTuning(), "rich"),
    "own without zero learnt in swing": without(OwnTuning(), "swing"),
    "own without the care for bad sensors": without(OwnTuning(), "robust"),
    "own without balance of the body": without(OwnTuning(), "balance"),
    "own without the body's acceleration": without(OwnTuning(), "shakes"),
    "own without friction learnt": without(OwnTuning(), "friction"),
    "own without weight and ropes learnt": without(OwnTuning(), "weighs"),
}
"""Built up idea by idea, then each idea taken away from the whole."""
NAMES = {
    "one_chamber": "paper: one chamber (1)",
    "two_chamber": "paper: two chambers (3)",
    "friction": "paper: less friction (7)",
    "kbf": "paper: filtered, KBF",
    "modified_kbf": "paper: modified KBF",
    "alone": "vertical cylinder alone, friction a set",
    "floor": "floor: sensors' noise and filter",
}
APART = ("dither", "still", "liar")
"""Kinds of runs that stand for themselves, outside the groups of all runs."""
WHOLE, FLOOR, ALONE = "own: all, robust", "floor", "alone"


def scores(series: Series, believed: BelievedRobot, own: Iterable[str] = ()) -> Scores:
    """Sums of one run: estimator -> category -> sums. `own`: classes of the user's own,
    FILE.py:Class.
    """
    belief, model = believed.legs(1e-3), RobotModel(believed.machine.urdf)
    late = series.data["t"] > LEFT_OUT_S
    speed = np.array([_speed(series, leg) for leg in LEGS])[:, late]
    true = np.array([series.truth[f"foot_load_{leg}"] for leg in LEGS])[:, late]
    across = foot_forces_in_body(series)[:, :2, late]
    out: Scores = {}

    def keep(
        name: str, load: Array, sd: Array | None = None, tangential: Array | None = None
    ) -> None:
        out[name] = _sums(load[:, late] - true, speed, None if sd is None else sd[:, late])
        if tangential is not None:
            off = np.hypot(*np.moveaxis(tangential[:, :, late] - across, 1, 0))
            out[name] |= {
                f"tangential_{key}": value for key, value in _sums(off, speed, None).items()
            }

    alone = replay(series.data, belief)
    for method in PAPER:
        keep(method, _legs(alone, f"estimate_{method}"))
    keep(ALONE, _legs(alone, "estimate_own"), _legs(alone, "own_sd"))
    for name, tuning in OWN.items():
        whole = believed.with_body(belief, model, series.ropes, tuning)
        found = replay(series.data, whole)
        sideways = np.array([[found[f"own_{axis}_{leg}"] for axis in "xy"] for leg in LEGS])
        keep(name, _legs(found, "estimate_own"), _legs(found, "own_sd"), sideways)
    keep(FLOOR, floor(series, belief))
    whole = believed.with_body(belief, model, series.ropes)
    for name in own:
        estimator = estimator_of(name, "--estimator")
        start(estimator, belief.dt_s)
        with user_code():
            loads = loads_over(estimator, replay_rows(series.data, whole))
        keep(name, loads.T)
    return out


def floor(series: Series, belief: Believed) -> Array:
    """The true load with the sensors' noise on it, through the own estimate's filter, N (4, n).

    What the readings differ from the chambers by, less its mean (the thermal zero), through the
    areas.
    """
    tuning, out = OwnTuning(), []
    constants = {
        "process_variance": tuning.filter_q_n2,
        "measurement_variance": tuning.filter_r_n2,
        "innovation_limit": tuning.e_max_n,
        "hold_samples": tuning.hold_samples,
    }
    for leg, numbers in zip(LEGS, belief.legs, strict=True):
        noise = np.zeros(len(series.data["t"]))
        for side, area in (("a", numbers.area_a_m2), ("b", -numbers.area_b_m2)):
            joint = f"{side}_{leg}_vertical"
            noise += area * (series.data[f"pressure_{joint}"] - series.truth[f"chamber_{joint}"])
        read = series.truth[f"foot_load_{leg}"] + noise - noise.mean()
        out.append(persistent.run(read, **constants))
    return np.array(out)


def foot_forces_in_body(series: Series) -> Array:
    """True force of the ground on each foot in the body frame, N (4, 3, n)."""
    x, y, z, w = (series.truth[f"body_pose_in_world_q{axis}"] for axis in "xyzw")
    rotation = np.array(
        [
            [1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w)],
            [2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w)],
            [2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y)],
        ]
    )
    world = np.array(
        [[series.truth[f"foot_force_in_world_{leg}_{axis}"] for axis in "xyz"] for leg in LEGS]
    )
    turned: Array = np.einsum("ijn,lin->ljn", rotation, world)
    return turned


def _legs(columns: dict[str, Array], stem: str) -> Array:
    return np.array([columns[f"{stem}_{leg}"] for leg in LEGS])


def _speed(series: Series, leg: str) -> Array:
    """Size of the vertical cylinder's speed, m/s, from both sides of each sample."""
    drawn = through_steps(series.data["t"], series.data[f"position_{leg}_vertical"], 1e-4)
    return np.abs(motion(drawn, 1000.0, 0.005)[1])


def _sums(error: Array, speed: Array, sd: Array | None) -> dict[str, dict[str, Any]]:
    """Sums over the samples of each category: count, error, its square, histogram of its size,
    coverage, width.
    """
    moving = speed > MOVING_M_S
    parts = {
        "moving": moving,
        "slow": moving & (speed < SLOW_M_S),
        "fast": speed >= SLOW_M_S,
        "rest": ~moving,
        "all": np.ones_like(moving),
    }
    out: dict[str, dict[str, Any]] = {}
    for name, mask in parts.items():
        wrong = error[mask]
        places = np.minimum(np.abs(wrong) / BIN_N, BINS - 1).astype(np.int64)
        out[name] = {
            "n": int(wrong.size),
            "sum": float(wrong.sum()),
            "square": float(wrong @ wrong),
            "sizes": np.bincount(places, minlength=BINS).tolist(),
        }
        if sd is not None:
            out[name] |= {
                "held": int((np.abs(wrong) <= Z90 * sd[mask]).sum()),
                "width": float(2.0 * Z90 * sd[mask].sum()),
            }
    return out


def merged(parts: Iterable[dict[str, Any]]) -> dict[str, Any]:
    """Sums of several runs added up, category by category."""
    out: dict[str, Any] = {}
    for part in parts:
        for name, sums in part.items():
            mine = out.setdefault(
                name, {field: (np.zeros(BINS) if field == "sizes" else 0) for field in sums}
            )
            for key, value in sums.items():
                mine[key] = mine[key] + np.asarray(value) if key == "sizes" else mine[key] + value
    return out


def marks(sums: dict[str, Any]) -> dict[str, float | None]:
    """Root mean square, bias, 99th percentile of the size (N), coverage of the 90 % interval and
    its mean width (N).
    """
    count = sums["n"]
    if count == 0:
        return {"rmse_n": None, "bias_n": None, "p99_n": None, "n": 0}
    share = np.cumsum(sums["sizes"]) / count
    out: dict[str, float | None] = {
        "rmse_n": math.sqrt(sums["square"] / count),
        "bias_n": sums["sum"] / count,
        "p99_n": float((np.searchsorted(share, 0.99) + 1) * BIN_N),
        "n": count,
    }
    if "held" in sums:
        out |= {"covered": sums["held"] / count, "width_n": sums["width"] / count}
    return out


def result(found: list[dict[str, Any]]) -> dict[str, Any]:
    """Everything that `estimators.json` holds: marks by estimator, over groups of runs."""
    groups: dict[str, Callable[[dict[str, Any]], bool]] = {
        "all temperatures": lambda r: r["kind"] not in APART,
        "at the calibration's temperature": lambda r: (
            r["oil_degc"] == BASE_C and r["kind"] not in APART
        ),
        **{
            kind: (lambda r, kind=kind: r["kind"] == kind)  # type: ignore[misc]
            for kind in dict.fromkeys(run["kind"] for run in found)
        },
    }
    out: dict[str, Any] = {
        "full_scale_n": FULL_SCALE_N,
        "runs": [run["name"] for run in found],
        "groups": {},
    }
    for group, belongs in groups.items():
        members = [run["scores"] for run in found if belongs(run)]
        if members:
            out["groups"][group] = {
                name: {
                    key: marks(sums)
                    for key, sums in merged(member[name] for member in members).items()
                }
                for name in members[0]
            }
    return out
