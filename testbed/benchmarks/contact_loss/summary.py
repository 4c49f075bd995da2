"""The benchmark's scenes summed up: every detector's marks over all load classes, its curve, and
the aims.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from itertools import pairwise
from typing import Any, NamedTuple

import numpy as np

from testbed.benchmarks.contact_loss import bounds
from testbed.benchmarks.contact_loss.scenes import Scene
from testbed.benchmarks.contact_loss.score import CLASSES, LIGHT_SHARE, NEAR_SHARE
from testbed.benchmarks.contact_loss.warning import DEFINITIONS as WARNING_DEFINITIONS
from testbed.benchmarks.contact_loss.warning import marks as warning_marks
from testbed.benchmarks.contact_loss.warning import supervisor_marks
from testbed.benchmarks.harness import poisson
from testbed.control.layers import CALM_S
from testbed.estimation.contact_losses import EARLY_S, FOUND_S, LOSS_S, LOSS_SHARE, STANDING_S
from testbed.estimation.detectors.table import BEST
from testbed.report.page import Table

Tree = dict[str, Any]
COMMISSIONED = "commissioned"
"""Under this an answer and the result have what is made of commissioned beliefs."""
EVENT_S = CALM_S
"""What a false alarm, or a loss that was missed, costs beside its own seconds: after an alarm the
supervisor keeps the drill waiting for so long, s."""
BUDGET_1_H = 1.0
"""False alarms an hour and foot above the floor's, at which detectors are compared with it."""
TRADED_1_H = (12.0, 25.0, 50.0)
"""So many false alarms an hour and foot, for the trade of recall against them."""
SLOPES = (20, 40, 60, 75, 86)
DRAWS = 1000
"""Machines are drawn anew so often for the interval of a recall."""
DRIFTING = 2
"""From so many drifting sensors on a scene counts as drifting."""

DEFINITIONS = {
    "loss": (
        f"the true normal force is below {LOSS_SHARE:g} of the nominal load (a quarter of the weight) for "
        f"{1e3 * LOSS_S:g} ms or longer; a touchdown likewise; shorter ones are bounces"
    ),
    "recall": f"the word says lost within {FOUND_S:g} s of the loss and before it ends",
    "delay": "from the loss to the word; 0 where it stood already",
    "false_alarm": (
        f"the word turns to lost while the foot carries and goes on to for {EARLY_S:g} s or more; one that stands counts "
        f"again every {STANDING_S:g} s; an hour of one foot"
    ),
    "missed_s": "seconds an hour of one foot that it is lost and the word says loaded",
    "false_flight_s": "seconds an hour of one foot that it carries and the word says lost",
    "cost_s": (
        f"both, and {EVENT_S:g} s for every false alarm and every missed loss: what all thresholds are set to make least, "
        "on tuning scenes"
    ),
    "near": f"below {NEAR_SHARE:g} of the nominal load: a loss by what the foot bore in the 2 s before (it bore more for a "
    "tenth of them), time in contact by the lowest load within half a second",
    "light": f"likewise, {NEAR_SHARE:g} to {LIGHT_SHARE:g}: friction may hide as much as is there",
    "loaded": f"likewise, {LIGHT_SHARE:g} and more",
    "floor": (
        "the true load through the foot's own pressure transducers as drawn (lag, ripple, noise, converter, bow, hysteresis, "
        "zero and gain by the oil's warmth), its likelihood ratio added up over a window as long as a loss must last; "
        "threshold for the least cost on the tuning scenes. It has no friction, no drifting sensor and no undeclared effect"
    ),
    **WARNING_DEFINITIONS,
}


class Timed(NamedTuple):
    """A true loss (with what is known of its scene), and when the word followed; None: never."""

    loss: Tree
    delay_s: float | None


@dataclass(frozen=True)
class Followed:
    """What one detector at one threshold made of many scenes."""

    losses: list[Timed]
    touchdowns_s: list[float | None]
    false_alarms: list[int]
    """By class, like what follows."""
    missed_s: list[float]
    false_flight_s: list[float]
    foot_s: list[float]

    @classmethod
    def of(cls, scenes: Sequence[Tree], name: str, at: int) -> Followed:
        """Of the scenes' answers, at a place of the detector's thresholds."""
        rows = [scene["detectors"][name][at] for scene in scenes]
        losses = [
            Timed(loss | {word: scene[word] for word in ("slope_deg", "drifting", "scene")}, delay)
            for scene, row in zip(scenes, rows, strict=True)
            for loss, delay in zip(scene["losses"], row["delays_s"], strict=True)
        ]
        foot_s = [_added(scenes, "carried_s")[k] + _added(scenes, "lost_s")[k] for k in range(3)]
        return cls(
            losses,
            [delay for row in rows for delay in row["touchdowns_s"]],
            [round(v) for v in _added(rows, "false_alarms")],
            _added(rows, "missed_s"),
            _added(rows, "false_flight_s"),
            foot_s,
        )

    @property
    def hours(self) -> float:
        """Of one foot."""
        return sum(self.foot_s) / 3600.0

    @property
    def cost_s(self) -> float:
        """Wrong seconds an hour of one foot, with those that false alarms and missed losses
        cost.
        """
        events = sum(self.false_alarms) + sum(t.delay_s is None for t in self.losses)
        wrong = sum(self.missed_s) + sum(self.false_flight_s) + EVENT_S * events
        return wrong / max(self.hours, 1e-9)

    def marks(self) -> Tree:
        """Over all classes."""
        touched = [t for t in self.touchdowns_s if t is not None]
        return _loss_marks(self.losses) | {
            "false_alarms": sum(self.false_alarms),
            "false_alarms_per_hour": sum(self.false_alarms) / max(self.hours, 1e-9),
            "false_alarms_per_hour_interval95": poisson(sum(self.false_alarms), self.hours),
            "missed_s_per_hour": sum(self.missed_s) / max(self.hours, 1e-9),
            "false_flight_s_per_hour": sum(self.false_flight_s) / max(self.hours, 1e-9),
            "cost_s_per_hour": self.cost_s,
            "touchdowns": len(self.touchdowns_s),
            "touchdowns_missed": len(self.touchdowns_s) - len(touched),
            "touchdown_delay_median_s": float(np.median(touched)) if touched else None,
            "by_class": {word: self._of_class(k) for k, word in enumerate(CLASSES)},
        }

    def _of_class(self, k: int) -> Tree:
        hours = self.foot_s[k] / 3600.0
        wrong = {"missed_s": self.missed_s[k], "false_flight_s": self.false_flight_s[k]}
        return _loss_marks([t for t in self.losses if t.loss["load_class"] == k]) | {
            "foot_hours": round(hours, 4),
            "false_alarms": self.false_alarms[k],
            "false_alarms_per_hour": self.false_alarms[k] / hours if hours > 0.0 else None,
            **{f"{word}_per_hour": s / hours if hours > 0.0 else None for word, s in wrong.items()},
        }


def _added(rows: Sequence[Tree], word: str) -> list[float]:
    return [float(sum(row[word][k] for row in rows)) for k in range(len(CLASSES))]


def _loss_marks(losses: Sequence[Timed]) -> Tree:
    seen = [t.delay_s for t in losses if t.delay_s is not None]
    machines = [Scene(**t.loss["scene"]).machine_seed for t in losses]
    return {
        "losses": len(losses),
        "recall": len(seen) / len(losses) if losses else None,
        "recall_interval95": by_machine([t.delay_s is not None for t in losses], machines),
        "delay_median_s": float(np.median(seen)) if seen else None,
        "delay_p95_s": float(np.quantile(seen, 0.95)) if seen else None,
    }


def by_machine(found: Sequence[bool], machines: Sequence[int]) -> list[float] | None:
    """95 % interval of a share of losses: machines are drawn anew, with all theirs; None of one."""
    names, of = np.unique(machines, return_inverse=True)
    if len(names) < 2:
        return None
    hits, all_of_them = np.bincount(of, found), np.bincount(of)
    drawn = np.random.default_rng(0).multinomial(
        len(names), np.full(len(names), 1.0 / len(names)), DRAWS
    )
    low, high = np.quantile((drawn @ hits) / (drawn @ all_of_them), [0.025, 0.975])
    return [float(low), float(high)]


def tuned(scenes: Sequence[Tree], grids: Mapping[str, Sequence[float]]) -> dict[str, int]:
    """Place of the threshold with the least cost by detector, on tuning scenes."""
    kept = [scene for scene in scenes if scene["scene"]["kind"] != "supervised"]
    return {
        name: int(np.argmin([Followed.of(kept, name, at).cost_s for at in range(len(grid))]))
        for name, grid in grids.items()
    }


def summarise(
    every: Sequence[Tree],
    hours: float,
    grids: Mapping[str, Sequence[float]],
    chosen: Mapping[str, int],
    texts: Mapping[str, str],
) -> Tree:
    """The object of contact_loss.json: `chosen` places in the thresholds `grids`, by detector of
    `texts`. Marks, warnings and aims are those of the drawing board's belief; of scenes that were
    also read with commissioned beliefs they stand under COMMISSIONED once more.
    """
    scenes = [s for s in every if s["scene"]["kind"] != "supervised"]
    lowest = Followed.of(scenes, bounds.FLOOR, chosen[bounds.FLOOR])

    def marks(scenes: Sequence[Tree]) -> Tree:
        entries = []
        for name, text in texts.items():
            entry = _entry(scenes, name, grids[name], chosen[name], lowest)
            entries.append({"name": name, "text": text, "best": name == BEST} | entry)
        best = next(entry for entry in entries if entry["best"])
        warning = warning_marks(scenes)
        return {
            "load_error_n": _load_error_n(scenes),
            "detectors": entries,
            "warning": warning,
            "aims": aims(best, entries[0], warning),
        }

    losses = [loss for scene in scenes for loss in scene["losses"]]
    commissioned = [scene | scene[COMMISSIONED] for scene in scenes if COMMISSIONED in scene]
    options = " --commission" if commissioned else ""
    return {
        "format": "roboclimber-contact-loss/2",
        "command": f"testbed contact-loss --hours {hours:g}{options}",
        "hours": round(lowest.hours, 4),
        "machine": scenes[0]["scene"]["machine"] or "drawing board",
        "losses_gradual": sum(loss["gradual"] for loss in losses),
        "losses_meant": sum(loss["meant"] for loss in losses),
        "foot_hours": {word: round(lowest.foot_s[k] / 3600.0, 4) for k, word in enumerate(CLASSES)},
        "scenes_drifting": sum(s["drifting"] >= DRIFTING for s in scenes),
        "faults": [f"{s['scene']['number']}: {s['fault']}" for s in scenes if s["fault"]],
        "verdicts": _counted([s["verdict"] for s in scenes]),
        **_size(scenes),
        **marks(scenes),
        COMMISSIONED: marks(commissioned) | _size(commissioned) if commissioned else None,
        "supervisor": supervisor_marks(every),
        "definitions": DEFINITIONS,
    }


def _size(scenes: Sequence[Tree]) -> Tree:
    """How much was scored."""
    return {
        "losses": sum(len(scene["losses"]) for scene in scenes),
        "scenes": len(scenes),
        "machines": len({Scene(**scene["scene"]).machine_seed for scene in scenes}),
    }


def _load_error_n(scenes: Sequence[Tree]) -> dict[str, float | None]:
    """RMS error of the whole-body estimate while a foot carries, by class, N."""
    sums, counts = np.sum([scene["square"] for scene in scenes], axis=0)
    return {
        word: math.sqrt(sums[k] / counts[k]) if counts[k] else None
        for k, word in enumerate(CLASSES)
    }


def _counted(words: Sequence[str]) -> dict[str, int]:
    return {word: words.count(word) for word in sorted(set(words))}


def _entry(
    scenes: Sequence[Tree], name: str, grid: Sequence[float], at: int, lowest: Followed
) -> Tree:
    found = Followed.of(scenes, name, at)
    points = [Followed.of(scenes, name, k) for k in range(len(grid))]
    lowest_rate = sum(lowest.false_alarms) / max(lowest.hours, 1e-9)
    groups: dict[str, Callable[[Tree], str]] = {
        "pace": lambda loss: "gradual" if loss["gradual"] else "abrupt",
        "intent": lambda loss: "meant" if loss["meant"] else "not meant",
        "drifting sensors": lambda loss: "two or more" if loss["drifting"] >= DRIFTING else "fewer",
        "slope [deg]": lambda loss: _slope(loss["slope_deg"]),
    }
    return {
        "threshold": grid[at],
        **found.marks(),
        "delay_floor_s": _loss_marks(lowest.losses)["delay_median_s"],
        "by": {word: _by(found.losses, key) for word, key in groups.items()},
        "at_floor_budget": _at_budget(points, grid, lowest_rate + BUDGET_1_H),
        "curve": _curve(points),
        "trade": [
            _traded(_at_budget(points, grid, most))
            for most in (lowest_rate + BUDGET_1_H, *TRADED_1_H)
        ],
    }


def _traded(found: Tree | None) -> Tree | None:
    """What of a threshold is shown beside others: recall by class, and what it costs."""
    if found is None:
        return None
    kept = ("threshold", "most_false_alarms_per_hour", "false_alarms_per_hour", "recall")
    words = (*kept, "delay_p95_s", "false_flight_s_per_hour", "cost_s_per_hour")
    classes = {word: marks["recall"] for word, marks in found["by_class"].items()}
    return {word: found[word] for word in words} | {"recall_by_class": classes}


def _slope(slope_deg: float) -> str:
    k = int(np.clip(np.searchsorted(SLOPES, slope_deg, side="right") - 1, 0, len(SLOPES) - 2))
    low, high = list(pairwise(SLOPES))[k]
    return f"{low}-{high}"


def _by(losses: Sequence[Timed], key: Callable[[Tree], str]) -> dict[str, Tree]:
    words = sorted({key(t.loss) for t in losses})
    return {word: _loss_marks([t for t in losses if key(t.loss) == word]) for word in words}


def _at_budget(points: Sequence[Followed], grid: Sequence[float], most_1_h: float) -> Tree | None:
    """The threshold with the most recall among those with no more false alarms an hour than
    that.
    """
    marks = [point.marks() for point in points]
    within = [k for k, m in enumerate(marks) if m["false_alarms_per_hour"] <= most_1_h]
    if not within:
        return None
    k = max(within, key=lambda n: (marks[n]["recall"] or 0.0, -points[n].cost_s))
    return {"threshold": grid[k], "most_false_alarms_per_hour": most_1_h} | marks[k]


def _curve(points: Sequence[Followed]) -> list[list[float | None]]:
    """[false alarms an hour and foot, median delay, recall] by falling recall's threshold, rarest
    alarms first.
    """
    rows = [point.marks() for point in points]
    found = [[m["false_alarms_per_hour"], m["delay_median_s"], m["recall"]] for m in rows]
    return sorted(found, key=lambda row: (row[0], row[2] or 0.0))


def aims(best: Tree, lowest: Tree, warning: Tree) -> list[Tree]:
    """What the best detector is to reach, what it reached, and whether it did; None: nothing to
    measure.
    """
    budget = best["at_floor_budget"]
    out: list[Tree] = []

    def add(what: str, aim: float, measured: float | None, unit: str, least: bool) -> None:
        met = None if measured is None else bool(measured >= aim if least else measured <= aim)
        out.append(
            {
                "what": what,
                "aim": aim,
                "least": least,
                "unit": unit,
                "measured": measured,
                "met": met,
            }
        )

    for word in CLASSES:
        of_floor = lowest["by_class"][word]["recall"]
        mine = None if budget is None else budget["by_class"][word]["recall"]
        if of_floor is not None:
            what = f"recall, {word} feet, at the floor's false alarms + {BUDGET_1_H:g}/h"
            add(what, of_floor - 0.02, 0.0 if mine is None else mine, "1", True)
    add("delay, median", 0.020, best["delay_median_s"], "s", False)
    add("delay, 95th percentile", 0.080, best["delay_p95_s"], "s", False)
    flight = "false_flight_s_per_hour"
    add("false flight", 2.0 * lowest[flight] + 2.0, best[flight], "s/h", False)
    by = best["by"]["drifting sensors"]
    fell = [by.get(word, {}).get("recall") for word in ("fewer", "two or more")]
    cost = None if None in fell else fell[0] - fell[1]
    add("recall that two drifting sensors cost", 0.03, cost, "1", False)
    add("touchdown found, median", 0.040, best["touchdown_delay_median_s"], "s", False)
    add("warnings that come true", 0.85, warning["precision"], "1", True)
    add("gradual losses warned of in time", 0.70, warning["warned_100_ms_ahead"], "1", True)
    return out


def tables(result: Tree) -> list[Table]:
    """All detectors side by side, with the drawing board's belief and after commissioning."""
    machine = result["machine"]
    title = f"Contact loss: {result['losses']} losses in {result['hours']:.2f} hours of one foot"
    found = [_table(result, f"{title}, {machine}, not commissioned")]
    if result[COMMISSIONED] is not None:
        found.append(_table(result[COMMISSIONED], f"{title}, {machine}, commissioned"))
    return found


def _table(result: Tree, title: str) -> Table:
    heads = ["detector", "recall", *CLASSES, "false alarms/h", "delay ms", "p95", "touchdown ms"]
    heads += ["missed s/h", "false flight s/h", "cost s/h", "recall at the floor's alarms"]

    def share(v: float | None) -> str:
        return "" if v is None else f"{100 * v:.1f}"

    def ms(v: float | None) -> str:
        return "" if v is None else f"{1e3 * v:.0f}"

    rows = []
    for d in sorted(result["detectors"], key=lambda d: d["cost_s_per_hour"]):
        budget = d["at_floor_budget"]
        row = [d["name"] + (" *" if d["best"] else ""), share(d["recall"])]
        row += [share(d["by_class"][word]["recall"]) for word in CLASSES]
        row += [f"{d['false_alarms_per_hour']:.1f}", ms(d["delay_median_s"]), ms(d["delay_p95_s"])]
        row += [ms(d["touchdown_delay_median_s"]), f"{d['missed_s_per_hour']:.1f}"]
        row += [f"{d['false_flight_s_per_hour']:.1f}", f"{d['cost_s_per_hour']:.0f}"]
        rows.append([*row, "" if budget is None else share(budget["recall"])])
    return Table(title, heads, rows)
