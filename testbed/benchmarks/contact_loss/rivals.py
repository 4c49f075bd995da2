"""Who is compared: all shipped detectors, one that sees single forces alone, the user's own, and
the floor and the limits that nobody can use.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from testbed.benchmarks.contact_loss import bounds
from testbed.benchmarks.contact_loss.recordings import Tape
from testbed.benchmarks.contact_loss.scenes import SETTLE_S, Scene
from testbed.benchmarks.contact_loss.summary import COMMISSIONED
from testbed.estimation.detectors.base import Hold, scores_over, start
from testbed.estimation.detectors.foot_scale import believed_breakaway_n
from testbed.estimation.detectors.learned import Patient
from testbed.estimation.detectors.single_force import SingleForce
from testbed.estimation.detectors.table import BEST, DETECTORS, LIVE, detector_of
from testbed.estimation.live.selected import hold_of
from testbed.formats.arrays import Array
from testbed.formats.sockets import user_code
from testbed.machine.build import build_machine

# What contact_loss.json holds of the result: what a reader or a page quotes, and no more.

Tree = dict[str, Any]
IN_CLASS = (
    *("losses", "recall", "recall_interval95"),
    *("false_alarms_per_hour", "false_flight_s_per_hour"),
)
"""What contact_loss.json says of a load class."""


def published(result: Tree) -> Tree:
    """What contact_loss.json holds: of all detectors their marks and by load class the few that
    count, of those COMPARED their losses by kind; after commissioning these alone; no curves, which
    the page draws.
    """
    found = result | {
        "detectors": [_published(entry) for entry in result["detectors"]],
        "warning": {k: v for k, v in result["warning"].items() if k != "curve"},
    }
    if result.get(COMMISSIONED) is not None:
        after = published(result[COMMISSIONED])
        compared = [entry for entry in after["detectors"] if entry["name"] in COMPARED]
        found[COMMISSIONED] = after | {"detectors": compared}
    return found


def _published(entry: Tree) -> Tree:
    left_out = {"curve", "trade", "by_class", "at_floor_budget"} | (
        set() if entry["name"] in COMPARED else {"by"}
    )
    found = {word: value for word, value in entry.items() if word not in left_out}
    budget = entry["at_floor_budget"]
    at_budget = None if budget is None else _in_short(budget) | {"threshold": budget["threshold"]}
    return found | _in_short(entry) | {"at_floor_budget": at_budget}


def _in_short(marks: Tree) -> Tree:
    """Marks by load class, and over all."""
    kept = {word: marks[word] for word in IN_CLASS}
    classes = marks["by_class"].items()
    return kept | {"by_class": {word: {k: m[k] for k in IN_CLASS} for word, m in classes}}


FORMAT = "roboclimber-thresholds/2"
FLOOR_THRESHOLDS = tuple(np.arange(-1.0, 10.0).tolist())
"""Further down its hold would never let go of a foot."""
SHARES = np.linspace(0.0, 1.0, 12)
RARE = 1.0 - np.logspace(-5.0, -0.3, 16)
"""Quantiles of the scores of lost feet, and of feet that carry, at which thresholds are looked
at.
"""

COMPARED = (LIVE, BEST, Patient.name)
"""Shipped detectors that are looked at with many thresholds, beside the floor and the limits."""


def rivals(own: Sequence[str] = ()) -> dict[str, str]:
    """Every detector of the benchmark by name, with what it does: those shipped, then classes of
    the user's own.
    """
    shipped = {d.name: d.text for d in DETECTORS} | {SingleForce.name: SingleForce.text}
    unreal = {bounds.FLOOR: bounds.FLOOR_TEXT} | bounds.TEXTS
    return unreal | shipped | dict.fromkeys(own, "of your own")


def shipped_thresholds() -> dict[str, float]:
    """Threshold of every shipped detector, of the floor and of the limits, as its own file has
    it.
    """
    shipped = {d.name: float(d.threshold) for d in DETECTORS}
    unreal = {bounds.FLOOR: bounds.FLOOR_THRESHOLD} | bounds.THRESHOLDS
    return unreal | shipped | {SingleForce.name: SingleForce.threshold}


def scores_of(name: str, tape: Tape, scene: Scene) -> tuple[Array, Hold]:
    """A rival's scores (n, 4) over a scene's tape, and when a foot that it calls lost counts as
    loaded again.
    """
    if name == bounds.FLOOR:
        path = bounds.SensorPath.of(scene, tape)
        return bounds.floor_scores(tape.normal_n, path, tape.rule, tape.dt_s), bounds.FLOOR_HOLD
    if name in bounds.TEXTS:
        return bounds.limit_scores(name, tape, scene), bounds.HOLDS[name]
    return detector_scores(name, tape)


def detector_scores(name: str, tape: Tape) -> tuple[Array, Hold]:
    """Scores of a detector over a tape, and its rule; it needs no scene."""
    if name == SingleForce.name:
        return single_force_scores(tape), Hold(dwell_s=0.0)
    detector = detector_of(name, "--detector")
    start(detector, tape.dt_s)
    scores = scores_over(detector, tape.samples)
    return np.asarray(scores, dtype=float), hold_of(detector)


def single_force_scores(tape: Tape) -> Array:
    """Each foot by its estimated load alone, with the declared scale: 1 where it is called lost."""
    own = np.ascontiguousarray(tape.samples["row"]["estimate"]["own"])
    feet = np.ones(own.shape[1])
    scale = tape.rule.nominal_load_n * feet, believed_breakaway_n(build_machine()) * feet
    return SingleForce().over(tape.time_s, own, *scale)


def grid_of(
    tapes: Sequence[Tape], own: Sequence[str], every: bool = False
) -> dict[str, tuple[float, ...]]:
    """Thresholds to look at by rival, that of a shipped one first, from how it scores a few
    scenes; of those that are not COMPARED none but their own, unless all are to be tuned (`every`).
    """
    shipped = shipped_thresholds()
    grids: dict[str, tuple[float, ...]] = {}
    for name in rivals(own):
        first = (shipped[name],) if name in shipped else ()
        if name == bounds.FLOOR:
            grids[name] = (*first, *FLOOR_THRESHOLDS)
        elif name in bounds.TEXTS:
            grids[name] = (*first, *bounds.GRID)
        elif name == SingleForce.name or not (every or name in (*COMPARED, *own)):
            grids[name] = first
        else:
            with user_code():
                grids[name] = (*first, *_quantiles(name, tapes))
    return grids


def _quantiles(name: str, tapes: Sequence[Tape]) -> list[float]:
    lost, carried = [], []
    for tape in tapes:
        late = tape.time_s >= SETTLE_S
        score, off = detector_scores(name, tape)[0][late], tape.carries[late]
        lost.append(score[~off])
        carried.append(score[off])
    found = [
        np.quantile(np.concatenate(part), shares)
        for part, shares in ((lost, SHARES), (carried, RARE))
        if sum(map(len, part))
    ]
    return [float(f"{v:.6g}") for v in np.unique(np.concatenate(found))]


def thresholds_text(thresholds: Mapping[str, float], hours: float) -> str:
    """What a tuning found, as YAML."""
    lines = [
        f"format: {FORMAT}",
        f"# testbed contact-loss --tune --hours {hours:g} --out DIR",
        "thresholds:",
        *(f"  {name}: {value:.6g}" for name, value in thresholds.items()),
    ]
    return "\n".join(lines) + "\n"
