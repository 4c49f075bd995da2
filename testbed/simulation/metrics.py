"""What a run is worth in numbers, from its recorded columns.

All arrays are (rows,) at the recording's rate. Estimates and expected loads are measured against `foot_load_<leg>`,
the true force along the vertical joint's axis; contact against `contact_normal_<leg>`, the true normal force.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
import numpy.typing as npt

from testbed.estimation.losses import (
    DETECTION_WINDOW_S,
    LOSS_S,
    LOSS_SHARE,
    carrying_from_load,
    intervals,
    loss_force_n,
    score_contact,
)
from testbed.formats.records import SET
from testbed.machine.names import LEGS, SIDES
from testbed.machine.scale import ROBOCLIMBER_NOMINAL_N
from testbed.simulation.residuals import residual_summary

Array = npt.NDArray[np.float64]
Flags = npt.NDArray[np.bool_]
Columns = Mapping[str, Array]

LOSS_FORCE_N = loss_force_n(ROBOCLIMBER_NOMINAL_N)
"""A foot with less normal force than this for LOSS_S has lost its contact (estimation/losses.py)."""
MARGIN_WINDOW_S = 0.1


def methods(columns: Columns) -> list[str]:
    """Names of the estimates in a recording, in its order: `estimate_<method>_<leg>`."""
    found = (
        c.removeprefix("estimate_").rpartition("_") for c in columns if c.startswith("estimate_")
    )
    return list(dict.fromkeys(m for m, _, leg in found if leg in LEGS))


def rms(values: Array) -> float:
    """Root mean square; nan where nothing finite is there."""
    finite = values[np.isfinite(values)]
    return float(np.sqrt(np.mean(finite**2))) if finite.size else float("nan")


def force_rms_n(data: Columns, truth: Columns) -> dict[str, float]:
    """Root mean square of estimate minus truth over all legs and the whole run, per method [N]."""
    return {
        m: rms(np.concatenate([_error(data, truth, f"estimate_{m}", leg) for leg in LEGS]))
        for m in methods(data)
    }


def force_rms_by_leg_n(data: Columns, truth: Columns) -> dict[str, dict[str, float]]:
    """The same, leg by leg [N]."""
    return {
        m: {leg: rms(_error(data, truth, f"estimate_{m}", leg)) for leg in LEGS}
        for m in methods(data)
    }


def expected_rms_n(data: Columns, truth: Columns) -> dict[str, float]:
    """Root mean square of the model's expected load minus the true one, per leg [N]."""
    return {
        leg: rms(_error(data, truth, "expected", leg)) for leg in LEGS if f"expected_{leg}" in data
    }


def _error(data: Columns, truth: Columns, prefix: str, leg: str) -> Array:
    return data[f"{prefix}_{leg}"] - truth[f"foot_load_{leg}"]


@dataclass(frozen=True)
class Loss:
    """A foot without load. `meant`: the control had lifted it. `delay_s`: until the detector said so; None: missed."""

    leg: str
    start_s: float
    end_s: float
    meant: bool
    delay_s: float | None

    def as_dict(self) -> dict[str, Any]:
        """For `summary.json`."""
        return dict(self.__dict__)


def contact_losses(data: Columns, truth: Columns, loss_n: float = LOSS_FORCE_N) -> list[Loss]:
    """Every stretch of at least 20 ms in which a foot's true normal force is below `loss_n`, in order of time."""
    time_s = truth["t"]
    found = []
    for leg in LEGS:
        lost = truth[f"contact_normal_{leg}"] < loss_n
        word = data.get(f"contact_{leg}")
        for a, b in intervals(lost, time_s, LOSS_S):
            delay = None if word is None else _delay(word, time_s, a, b)
            found.append(
                Loss(leg, float(time_s[a]), float(time_s[b - 1]), _meant(data, leg, a, b), delay)
            )
    return sorted(found, key=lambda loss: loss.start_s)


def _meant(data: Columns, leg: str, a: int, b: int) -> bool:
    """Whether the control did not want this foot to carry, at any time from just before the loss to its end."""
    carry = data.get(f"carrying_{leg}")
    return carry is not None and bool(np.any(carry[max(a - 1, 0) : b] < SET))


def _delay(word: Array, time_s: Array, a: int, b: int) -> float | None:
    end = int(
        np.searchsorted(time_s, min(time_s[a] + DETECTION_WINDOW_S, time_s[b - 1]), side="right")
    )
    spoken = np.flatnonzero(word[a:end] < SET)
    return float(time_s[a + spoken[0]] - time_s[a]) if spoken.size else None


def false_alarms(data: Columns, truth: Columns, loss_n: float = LOSS_FORCE_N) -> int:
    """How often a detector says `lost` while the foot's true normal force stays at `loss_n` or more all the time.

    Word and force are compared over the whole stretch of the word, so that a late end of a true loss is no alarm. A
    word from the first row on is none either: the detector has not spoken yet.
    """
    count = 0
    for leg in LEGS:
        word = data.get(f"contact_{leg}")
        if word is None:
            continue
        loaded = truth[f"contact_normal_{leg}"] >= loss_n
        count += sum(
            a > 0 and bool(np.all(loaded[a:b])) for a, b in intervals(word < SET, truth["t"])
        )
    return count


def wrong_leg_seconds(
    data: Columns, truth: Columns, loss_n: float = LOSS_FORCE_N
) -> dict[str, float]:
    """For how long the contact word was wrong, summed over the feet: seconds in the air called loaded, and the reverse.

    Empty where there is no word. A word that is wrong without ever changing counts here, though it is no alarm.
    """
    found = [
        score_contact(
            data[f"contact_{leg}"],
            carrying_from_load(truth[f"contact_normal_{leg}"], truth["t"], loss_n / LOSS_SHARE),
            truth["t"],
        )
        for leg in LEGS
        if f"contact_{leg}" in data
    ]
    if not found:
        return {}
    return {
        "missed_s": sum(score.missed_s for score in found),
        "false_flight_s": sum(score.false_flight_s for score in found),
    }


def unloaded(
    data: Columns, truth: Columns, loss_n: float = LOSS_FORCE_N
) -> tuple[dict[str, float], dict[str, float]]:
    """By foot: the longest time in a row in which it was meant to carry and bore less than `loss_n` [s], and the share
    of all the time in which it was meant to carry [1].
    """
    time_s = truth["t"]
    longest_s: dict[str, float] = {}
    share: dict[str, float] = {}
    for leg in LEGS:
        meant = data.get(f"carrying_{leg}", np.ones(len(time_s))).astype(bool)
        hangs = meant & (truth[f"contact_normal_{leg}"] < loss_n)
        spans = intervals(hangs, time_s, LOSS_S)
        longest_s[leg] = max((float(time_s[b - 1] - time_s[a]) for a, b in spans), default=0.0)
        share[leg] = float(hangs.sum() / max(meant.sum(), 1))
    return longest_s, share


def detector_summary(losses: list[Loss], alarms: int, hours: float) -> dict[str, Any]:
    """Delays, misses and false alarms of the contact word."""
    delays = [loss.delay_s for loss in losses if loss.delay_s is not None]
    return {
        "losses": len(losses),
        "missed": sum(loss.delay_s is None for loss in losses),
        "delay_median_s": float(np.median(delays)) if delays else None,
        "delay_p95_s": float(np.quantile(delays, 0.95)) if delays else None,
        "false_alarms": alarms,
        "false_alarms_per_hour": alarms / hours if hours > 0 else None,
    }


def stability_margin(truth: Columns, loss_n: float = LOSS_FORCE_N) -> Array:
    """Share of the normal load that does not rest on the edge about which the robot would tip first, 0 to 0.5.

    Weight, ropes, drill and acceleration all act on it, because it is formed from the true normal forces: with four
    loaded feet it is the smallest sum over a side's two feet, with three the smallest single foot, with fewer 0.
    Forces are means over 0.1 s: four tonnes do not tip within the bounce of a foot.
    """
    normal = np.stack([truth[f"contact_normal_{leg}"] for leg in LEGS], axis=1).clip(min=0.0)
    normal = _moving_mean(normal, rows=_rows_in(truth["t"], MARGIN_WINDOW_S))
    total = normal.sum(axis=1)
    share = normal / np.where(total > 0, total, 1.0)[:, None]
    fl, fr, rl, rr = share.T
    four = np.minimum.reduce([fl + fr, rl + rr, fl + rl, fr + rr])
    loaded = normal >= loss_n
    three = np.where(loaded, share, np.inf).min(axis=1)
    feet = loaded.sum(axis=1)
    return np.where(feet == 4, four, np.where(feet == 3, three, 0.0))


def _rows_in(time_s: Array, window_s: float) -> int:
    return max(round(window_s / float(np.median(np.diff(time_s)))), 1) if len(time_s) > 1 else 1


def _moving_mean(values: Array, rows: int) -> Array:
    """Mean over the last `rows` rows, fewer at the start; (n, k) -> (n, k)."""
    total = np.cumsum(np.vstack([np.zeros(values.shape[1]), values]), axis=0)
    last = np.arange(1, len(values) + 1)
    first = np.maximum(last - rows, 0)
    mean: Array = (total[last] - total[first]) / (last - first)[:, None]
    return mean


def tilt_deg(truth: Columns, slope_deg: float) -> Array:
    """Angle between the body's z axis (the drill's) and the slope's normal (-sin, 0, cos in the world) [deg]."""
    x, y, z, w = (truth[f"body_pose_in_world_q{i}"] for i in "xyzw")
    body_z_in_world = np.stack([2 * (x * z + w * y), 2 * (y * z - w * x), 1 - 2 * (x * x + y * y)])
    slope = np.deg2rad(slope_deg)
    normal_in_world = np.array([-np.sin(slope), 0.0, np.cos(slope)])
    cross = np.linalg.norm(np.cross(body_z_in_world.T, normal_in_world), axis=1)
    degrees: Array = np.rad2deg(np.arctan2(cross, normal_in_world @ body_z_in_world))
    return degrees


def climbed_m(truth: Columns, slope_deg: float) -> float:
    """Way of the body up the slope from the first row to the last [m]."""
    slope = np.deg2rad(slope_deg)
    dx, dz = (
        float(truth[f"body_pose_in_world_{i}"][-1] - truth[f"body_pose_in_world_{i}"][0])
        for i in "xz"
    )
    return float(dx * np.cos(slope) + dz * np.sin(slope))


def rope_tension_n(truth: Columns, side: str) -> Array:
    """True tension of a rope: length of its force on the body [N]."""
    force = np.stack([truth[f"rope_force_in_world_{side}_{i}"] for i in "xyz"])
    tension: Array = np.linalg.norm(force, axis=0)
    return tension


def wanted_columns(columns: list[str]) -> list[str]:
    """The columns out of `columns` that the metrics read."""
    heads = (
        "estimate_",
        "own_low_",
        "own_high_",
        "expected_",
        "contact_",
        "carrying_",
        "foot_load_",
        "body_pose_",
        "rope_force_",
        "position_",
        "drill_wrench_",
        "rods_stored",
    )
    return ["t", *(c for c in columns if c.startswith(heads))]


def run_metrics(
    data: Columns, truth: Columns, slope_deg: float, nominal_n: float = ROBOCLIMBER_NOMINAL_N
) -> dict[str, Any]:
    """All of it, as it goes into `summary.json`; `nominal_n`: load of a foot that tells what bears and what does not."""
    loss_n = loss_force_n(nominal_n)
    losses = contact_losses(data, truth, loss_n)
    hours = float(truth["t"][-1] - truth["t"][0]) / 3600.0
    margin = stability_margin(truth, loss_n)
    longest_unloaded_s, unloaded_share = unloaded(data, truth, loss_n)
    detector = detector_summary(losses, false_alarms(data, truth, loss_n), hours)
    return {
        "nominal_load_n": nominal_n,
        "force_rms_n": force_rms_n(data, truth),
        "force_rms_by_leg_n": force_rms_by_leg_n(data, truth),
        "expected_rms_n": expected_rms_n(data, truth),
        "residuals": residual_summary(data, methods(data)),
        "contact_loss_events": [loss.as_dict() for loss in losses],
        "contact_losses_not_meant": sum(not loss.meant for loss in losses),
        "detector": detector | wrong_leg_seconds(data, truth, loss_n),
        "longest_unloaded_s": longest_unloaded_s,
        "unloaded_share": unloaded_share,
        "lowest_stability_margin": float(margin.min()),
        "tilt_max_deg": float(tilt_deg(truth, slope_deg).max()),
        "climbed_m": climbed_m(truth, slope_deg),
        "rope_tension_max_n": {side: float(rope_tension_n(truth, side).max()) for side in SIDES},
        "foot_load_min_n": {leg: float(truth[f"foot_load_{leg}"].min()) for leg in LEGS},
        "foot_load_max_n": {leg: float(truth[f"foot_load_{leg}"].max()) for leg in LEGS},
    }
