"""The figures of a run, computed from its recorded columns.

All arrays are (rows,) at the recording's rate. Estimates and expected loads are measured against
`foot_load_<leg>`, the true force along the vertical joint's axis; contact against
`contact_normal_<leg>`, the true normal force.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import asdict, dataclass
from typing import Any

import numpy as np

from testbed.estimation.contact_losses import (
    LOSS_S,
    ContactScore,
    LossRule,
    follow,
    intervals,
    score_contact,
)
from testbed.formats.arrays import Array, Columns, Flags
from testbed.formats.records import SET
from testbed.machine.names import LEGS, SIDES
from testbed.machine.scale import ROBOCLIMBER_NOMINAL_N
from testbed.simulation.residuals import residual_summary

LOSS_FORCE_N = LossRule(ROBOCLIMBER_NOMINAL_N).force_n
"""For pictures: below it a foot of the shipped machine carries nothing, N. What is counted goes by
the run's own rule.
"""
MARGIN_WINDOW_S = 0.1
DOUBTED = 2.0
"""From this `own_balance_doubt` on loads follow the pressures rather than the body's balance."""


def methods(columns: Columns) -> list[str]:
    """Names of the estimates in a recording, in its order: `estimate_<method>_<leg>`."""
    found = (
        column.removeprefix("estimate_").rpartition("_")
        for column in columns
        if column.startswith("estimate_")
    )
    return list(dict.fromkeys(method for method, _, leg in found if leg in LEGS))


def rms(values: Array) -> float:
    """Root mean square; nan where nothing finite is there."""
    finite = values[np.isfinite(values)]
    return float(np.sqrt(np.mean(finite**2))) if finite.size else float("nan")


def force_rms_n(data: Columns, truth: Columns) -> dict[str, float]:
    """Root mean square of estimate minus truth over all legs and the whole run, per method [N]."""
    return {
        method: rms(
            np.concatenate([_error(data, truth, f"estimate_{method}", leg) for leg in LEGS])
        )
        for method in methods(data)
    }


def force_rms_by_leg_n(data: Columns, truth: Columns) -> dict[str, dict[str, float]]:
    """Root mean square of estimate minus truth over the whole run, per method and leg [N]."""
    return {
        method: {leg: rms(_error(data, truth, f"estimate_{method}", leg)) for leg in LEGS}
        for method in methods(data)
    }


def expected_rms_n(data: Columns, truth: Columns) -> dict[str, float]:
    """Root mean square of the model's expected load minus the true one, per leg [N]."""
    return {
        leg: rms(_error(data, truth, "expected", leg)) for leg in LEGS if f"expected_{leg}" in data
    }


def _error(data: Columns, truth: Columns, prefix: str, leg: str) -> Array:
    return data[f"{prefix}_{leg}"] - truth[f"foot_load_{leg}"]


def balance_doubted_s(data: Columns) -> float:
    """For how long the pressures contradicted weight, ropes or drill as believed, s."""
    doubt = data.get("own_balance_doubt")
    if doubt is None or len(doubt) < 2:
        return 0.0
    return float(np.mean(doubt >= DOUBTED) * (data["t"][-1] - data["t"][0]))


def surprise(data: Columns) -> float:
    """How much further from its belief the machine seemed at the end than was stated, by the
    square; 1: as stated, or nothing said so.
    """
    level = data.get("own_surprise")
    return 1.0 if level is None or not len(level) else float(level[-1])


@dataclass(frozen=True)
class Loss:
    """A foot without load. `meant`: the control had lifted it. `delay_s`: until the detector said
    so; None: missed.
    """

    leg: str
    start_s: float
    end_s: float
    meant: bool
    delay_s: float | None

    def as_dict(self) -> dict[str, Any]:
        """For `summary.json`."""
        return dict(self.__dict__)


def contact_losses(data: Columns, truth: Columns, rule: LossRule) -> list[Loss]:
    """Every loss of a foot by its true normal force, in order of time; one that was on at the start
    is none.
    """
    time_s = truth["t"]
    found = []
    for leg in LEGS:
        carrying = rule.carrying(truth[f"contact_normal_{leg}"], time_s)
        for loss in follow(_lost(data, leg, carrying), carrying, time_s).losses:
            start, stop = loss.start, loss.end
            meant, delay = _meant(data, leg, start, stop), loss.delay_s
            found.append(Loss(leg, float(time_s[start]), float(time_s[stop - 1]), meant, delay))
    return sorted(found, key=lambda loss: loss.start_s)


def _lost(data: Columns, leg: str, carrying: Flags) -> Flags:
    """Where the contact state says lost; nowhere where there is none."""
    state = data.get(f"contact_{leg}")
    return np.zeros(len(carrying), dtype=bool) if state is None else state < SET


def _meant(data: Columns, leg: str, start: int, stop: int) -> bool:
    """Whether the control did not want this foot to carry, at any time from just before the loss to
    its end.
    """
    carry = data.get(f"carrying_{leg}")
    return carry is not None and bool(np.any(carry[max(start - 1, 0) : stop] < SET))


def state_scores(data: Columns, truth: Columns, rule: LossRule) -> dict[str, ContactScore]:
    """How well the contact state of each foot follows its true normal force
    (estimation/contact_losses.py).
    """
    return {
        leg: score_contact(
            data[f"contact_{leg}"],
            rule.carrying(truth[f"contact_normal_{leg}"], truth["t"]),
            truth["t"],
        )
        for leg in LEGS
        if f"contact_{leg}" in data
    }


def any_bears(truth: Columns, loss_n: float) -> Flags:
    """(N) whether any foot bears at least `loss_n`."""
    bears: Flags = np.any([truth[f"contact_normal_{leg}"] >= loss_n for leg in LEGS], axis=0)
    return bears


def off_its_feet_s(truth: Columns, loss_n: float) -> float:
    """How long no foot has borne when the run ends, s."""
    bears = np.flatnonzero(any_bears(truth, loss_n))
    return float(truth["t"][-1] - truth["t"][bears[-1] if len(bears) else 0])


def unloaded(
    data: Columns, truth: Columns, loss_n: float = LOSS_FORCE_N
) -> tuple[dict[str, float], dict[str, float]]:
    """By foot: the longest time in a row in which it was meant to carry and bore less than `loss_n`
    [s], and the share of all the time in which it was meant to carry [1]. A robot that lies is not
    meant to carry until a foot of it first bears.
    """
    time_s = truth["t"]
    began = np.logical_or.accumulate(any_bears(truth, loss_n))
    longest_s: dict[str, float] = {}
    share: dict[str, float] = {}
    for leg in LEGS:
        meant = began & data.get(f"carrying_{leg}", np.ones(len(time_s))).astype(bool)
        hangs = meant & (truth[f"contact_normal_{leg}"] < loss_n)
        spans = intervals(hangs, time_s, LOSS_S)
        longest_s[leg] = max(
            (float(time_s[stop - 1] - time_s[start]) for start, stop in spans), default=0.0
        )
        share[leg] = float(hangs.sum() / max(meant.sum(), 1))
    return longest_s, share


def detector_summary(
    losses: list[Loss], scores: Mapping[str, ContactScore], hours: float
) -> dict[str, Any]:
    """Delays, misses, false alarms and wrong seconds of the contact state, all feet; an hour is one
    of the run.
    """
    delays = [loss.delay_s for loss in losses if loss.delay_s is not None]
    alarms = sum(score.false_alarms for score in scores.values())
    return {
        "losses": len(losses),
        "missed": sum(loss.delay_s is None for loss in losses),
        "delay_median_s": float(np.median(delays)) if delays else None,
        "delay_p95_s": float(np.quantile(delays, 0.95)) if delays else None,
        "false_alarms": alarms,
        "false_alarms_per_hour": alarms / hours if hours > 0 else None,
        "missed_s": sum(score.missed_s for score in scores.values()),
        "false_flight_s": sum(score.false_flight_s for score in scores.values()),
    }


def stability_margin(truth: Columns, loss_n: float = LOSS_FORCE_N) -> Array:
    """Share of the normal load that does not rest on the edge about which the robot would tip
    first, 0 to 0.5.

    Weight, ropes, drill and acceleration all act on it, because it is formed from the true normal
    forces: with four loaded feet it is the smallest sum over a side's two feet, with three the
    smallest single foot, with fewer 0.
    Forces are means over 0.1 s: four tonnes do not tip within the bounce of a foot. A foot below
    `loss_n` bears nothing.
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
    """Angle between the body's z axis (the drill's) and the slope's normal (-sin, 0, cos in the
    world) [deg].
    """
    x, y, z, w = (truth[f"body_pose_in_world_q{axis}"] for axis in "xyzw")
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
        float(truth[f"body_pose_in_world_{axis}"][-1] - truth[f"body_pose_in_world_{axis}"][0])
        for axis in "xz"
    )
    return float(dx * np.cos(slope) + dz * np.sin(slope))


def rope_tension_n(truth: Columns, side: str) -> Array:
    """True tension of a rope: length of its force on the body [N]."""
    force = np.stack([truth[f"rope_force_in_world_{side}_{axis}"] for axis in "xyz"])
    tension: Array = np.linalg.norm(force, axis=0)
    return tension


def run_metrics(data: Columns, truth: Columns, slope_deg: float, rule: LossRule) -> dict[str, Any]:
    """All of it, as it goes into `summary.json`; `rule`: what a loss of contact is."""
    losses = contact_losses(data, truth, rule)
    hours = float(truth["t"][-1] - truth["t"][0]) / 3600.0
    margin = stability_margin(truth, rule.force_n)
    first = int(np.argmax(any_bears(truth, rule.force_n)))  # what lies does not tip
    longest_unloaded_s, unloaded_share = unloaded(data, truth, rule.force_n)
    return {
        "nominal_load_n": rule.nominal_load_n,
        "force_rms_n": force_rms_n(data, truth),
        "force_rms_by_leg_n": force_rms_by_leg_n(data, truth),
        "expected_rms_n": expected_rms_n(data, truth),
        "balance_doubted_s": balance_doubted_s(data),
        "surprise": surprise(data),
        "residuals": residual_summary(data, methods(data), rule.nominal_load_n),
        "contact_loss_events": [loss.as_dict() for loss in losses],
        "contact_losses_not_meant": sum(not loss.meant for loss in losses),
        "contact_loss_rule": asdict(rule) | {"force_n": rule.force_n},
        "detector": detector_summary(losses, state_scores(data, truth, rule), hours),
        "longest_unloaded_s": longest_unloaded_s,
        "unloaded_share": unloaded_share,
        "off_its_feet_s": off_its_feet_s(truth, rule.force_n),
        "lowest_stability_margin": float(margin[first:].min()),
        "tilt_max_deg": float(tilt_deg(truth, slope_deg).max()),
        "climbed_m": climbed_m(truth, slope_deg),
        "rope_tension_max_n": {side: float(rope_tension_n(truth, side).max()) for side in SIDES},
        "foot_load_min_n": {leg: float(truth[f"foot_load_{leg}"].min()) for leg in LEGS},
        "foot_load_max_n": {leg: float(truth[f"foot_load_{leg}"].max()) for leg in LEGS},
    }
