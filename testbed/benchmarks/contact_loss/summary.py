"""The benchmark's scenes summed up: recall, false alarms, delays and curves of every detector, and the warning's."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from itertools import pairwise
from typing import Any

import numpy as np
from numpy.typing import NDArray

from testbed.benchmarks.contact_loss.score import GRADUAL_S, LOADED_N, LOSS_N, NEAR_N, delays_s
from testbed.benchmarks.contact_loss.warning import CURVE_N, LEAD_S, WITHIN_S, gradual, marks
from testbed.benchmarks.contact_loss.watch import ORACLE, ORACLE_NOISE_N
from testbed.benchmarks.statistics import poisson, wilson
from testbed.estimation.detectors.table import BEST
from testbed.estimation.detectors.warning import NUMBERS
from testbed.report.tables import Table

Array = NDArray[np.float64]
Tree = dict[str, Any]
BUDGET_1_H = 1.0 / 8.0
"""False alarms a foot may have in an hour."""
PROMPT_S = 0.040
MARGIN = 0.1
"""A threshold lies this far from where losses are missed towards where loaded feet are called lost."""
CURVE_POINTS = 40
SLOPES = (30, 45, 60, 70, 80)


@dataclass(frozen=True)
class Records:
    """All scenes' records of all detectors side by side."""

    losses: list[Tree]
    stairs: dict[str, list[list[list[float]]]]
    low_n: Array
    window_s: Array
    windows: dict[str, Array]
    window_slope: Array
    window_sound: NDArray[np.bool_]
    """Whether the plant had no undeclared effect."""

    @classmethod
    def of(cls, scenes: Sequence[Tree]) -> Records:
        """From the scenes' files."""
        names = list(scenes[0]["stairs"]) if scenes else []
        losses = [
            loss | {"slope_deg": s["slope_deg"], "sound": not s["undeclared"], "scene": k}
            for k, s in enumerate(scenes)
            for loss in s["losses"]
        ]
        of_window = [(s["slope_deg"], not s["undeclared"]) for s in scenes for _ in s["window_s"]]
        return cls(
            losses,
            {name: [stair for s in scenes for stair in s["stairs"][name]] for name in names},
            np.array([v for s in scenes for v in s["window_low_n"]]),
            np.array([v for s in scenes for v in s["window_s"]]),
            {name: np.array([v for s in scenes for v in s["windows"][name]]) for name in names},
            np.array([slope for slope, _ in of_window]),
            np.array([sound for _, sound in of_window], dtype=bool),
        )

    @property
    def loaded(self) -> NDArray[np.bool_]:
        """Losses of feet that bore more than sticking can hide."""
        return np.array([loss["load_before_n"] >= LOADED_N for loss in self.losses], dtype=bool)


def tuned(scenes: Sequence[Tree]) -> dict[str, float]:
    """Thresholds from tuning scenes: within the budget of false alarms, and as far from it as the recall allows."""
    r = Records.of([s for s in scenes if s["scene"]["kind"] != "supervised"])
    return {name: _threshold(r, name) for name in r.stairs if name != ORACLE}


def _threshold(r: Records, name: str) -> float:
    quiet = np.sort(r.windows[name][r.low_n >= LOADED_N])
    allowed = int(BUDGET_1_H * r.window_s[r.low_n >= LOADED_N].sum() / 3600.0)
    edge = float(quiet[-1 - allowed]) if len(quiet) > allowed else float("-inf")
    stairs = [s for s, loaded in zip(r.stairs[name], r.loaded, strict=True) if loaded]
    highest = np.array(
        [max((score for t, score in stair if t <= PROMPT_S), default=np.inf) for stair in stairs]
    )
    seen = highest[highest > edge]
    if not len(seen) or not np.isfinite(edge):
        return float(np.nextafter(edge, np.inf)) if np.isfinite(edge) else 0.0
    missing = float(seen.min())
    full = len(seen) == len(highest)
    return float(
        f"{missing - MARGIN * (missing - edge) if full else np.nextafter(edge, np.inf):.6g}"
    )


def summarise(
    every: Sequence[Tree],
    hours: float,
    thresholds: Mapping[str, float],
    texts: Mapping[str, str],
) -> Tree:
    """The object of contact_loss.json. By detector: its threshold, and what it does (`texts`)."""
    scenes = [s for s in every if s["scene"]["kind"] != "supervised"]
    r = Records.of(scenes)
    oracle = delays_s(r.stairs[ORACLE], oracle_threshold())[r.loaded]
    floor = float(np.nanmean(oracle)) if np.isfinite(oracle).any() else None
    return {
        "format": "roboclimber-contact-loss/1",
        "command": f"testbed contact-loss --hours {hours:g}",
        "hours": hours,
        "losses": len(r.losses),
        "losses_loaded": int(r.loaded.sum()),
        "losses_gradual": sum(gradual(loss) for loss in r.losses),
        "foot_hours": {
            word: round(float(r.window_s[mask].sum()) / 3600.0, 4)
            for word, mask in _classes(r).items()
        },
        "scenes": len(scenes),
        "scenes_undeclared": sum(bool(s["undeclared"]) for s in scenes),
        "faults": [
            s["scene"]["kind"] + f" {s['scene']['number']}: {s['fault']}"
            for s in scenes
            if s["fault"]
        ],
        "verdicts": {
            v: sum(s["verdict"] == v for s in scenes)
            for v in sorted({s["verdict"] for s in scenes})
        },
        "detectors": [
            _entry(r, name, text, thresholds[name], floor) for name, text in texts.items()
        ],
        "warning": _warning(scenes),
        "supervisor": _supervisor(every),
        "definitions": DEFINITIONS,
    }


def oracle_threshold(dt_s: float = 1.0e-3) -> float:
    """Score of the oracle at which a foot that bears 300 N would be called lost once in the budget's time.

    The one-sample case of the matched test between 300 N and nothing (Lorden's bound, ln(samples) nats, is passed by
    a single sample: 300^2 / (2 37^2) = 33 nats): 300 N less the noise's quantile.
    """
    from statistics import NormalDist

    samples = 3600.0 / BUDGET_1_H / dt_s
    return -(LOSS_N - NormalDist().inv_cdf(1.0 - 1.0 / samples) * ORACLE_NOISE_N)


DEFINITIONS = {
    "loss": f"true normal force below {LOSS_N:.0f} N for 20 ms while meant to carry, after 0.5 s of carrying",
    "recall": f"losses of feet that bore {LOADED_N:.0f} N (twice the break-away force) or more in the 5 s before",
    "false_alarms_per_hour": f"per foot, while it bears {LOADED_N:.0f} N or more; a standing alarm counts once in 5 s",
    "light": f"the same while its lowest load in the window is between {NEAR_N:.0f} and {LOADED_N:.0f} N",
    "delay": "from the crossing of 300 N; 0 where the alarm already stood",
    "delay_floor_s": "mean delay of an oracle: true load, sensors' lag and noise, sampled; one alarm in 8 h at 300 N",
    "gradual": f"{GRADUAL_S:g} s or more below a fifth of the median load of the 5 s before",
    "warned": f"a warning of that foot {LEAD_S:g} to {WITHIN_S:g} s before a gradual loss",
    "right_warning": (
        f"the true normal force of that foot falls below {LOSS_N:.0f} N for 20 ms, beginning within {WITHIN_S:g} s "
        f"after the warning; every warning counts, of feet that bore {LOADED_N:.0f} N or more in the 5 s before it; a "
        f"shorter touch or a load that stops above {LOSS_N:.0f} N makes it false (near: it fell below {NEAR_N:.0f} N)"
    ),
    "early_warning": f"a right warning {LEAD_S:g} s or more before the foot is lost",
    "late_warning": f"the foot was below {LOSS_N:.0f} N in the 0.5 s before: the alarm has spoken; not counted",
}


def _classes(r: Records) -> dict[str, NDArray[np.bool_]]:
    return {
        "loaded": r.low_n >= LOADED_N,
        "light": (r.low_n < LOADED_N) & (r.low_n >= NEAR_N),
        "near_losses": r.low_n < NEAR_N,
    }


def _entry(r: Records, name: str, text: str, threshold: float, floor: float | None) -> Tree:
    delays = delays_s(r.stairs[name], threshold)
    main = _losses_marks(delays[r.loaded])
    classes = _classes(r)
    alarms = {word: _alarm_marks(r, name, threshold, mask) for word, mask in classes.items()}
    sound = np.array([loss["sound"] for loss in r.losses], dtype=bool)
    slopes = np.array([_slope(v) for v in r.window_slope])
    groups: dict[str, Callable[[Tree], str]] = {
        "phase": lambda loss: str(loss["phase"]),
        "cause": lambda loss: str(loss["cause"]),
        "slope_deg": lambda loss: _slope(loss["slope_deg"]),
        "pace": lambda loss: "gradual" if gradual(loss) else "abrupt",
    }
    return {
        "name": name,
        "text": text,
        "best": name == BEST,
        "threshold": threshold,
        **main,
        "false_alarms": alarms["loaded"]["count"],
        "false_alarms_per_hour": alarms["loaded"]["per_hour"],
        "false_alarms_per_hour_interval95": alarms["loaded"]["interval95"],
        "light": alarms["light"],
        "near_losses": alarms["near_losses"],
        "delay_floor_s": floor,
        "declared": _losses_marks(delays[r.loaded & sound])
        | {"false_alarms": _alarm_marks(r, name, threshold, classes["loaded"] & r.window_sound)},
        "undeclared": _losses_marks(delays[r.loaded & ~sound])
        | {"false_alarms": _alarm_marks(r, name, threshold, classes["loaded"] & ~r.window_sound)},
        "unloaded_before": _losses_marks(delays[~r.loaded]),
        "by": {word: _by(r, delays, key) for word, key in groups.items()},
        "light_by_slope_deg": {
            word: _alarm_marks(r, name, threshold, classes["light"] & (slopes == word))
            for word in _slope_names()
        },
        "curve": _curve(r, name),
    }


def _slope_names() -> list[str]:
    return [f"{low}-{high}" for low, high in pairwise(SLOPES)]


def _slope(slope_deg: float) -> str:
    k = int(np.clip(np.searchsorted(SLOPES, slope_deg, side="right") - 1, 0, len(SLOPES) - 2))
    return _slope_names()[k]


def _by(r: Records, delays: Array, key: Callable[[Tree], str]) -> dict[str, Tree]:
    words = np.array([key(loss) for loss in r.losses])
    return {
        str(w): _losses_marks(delays[r.loaded & (words == w)])
        for w in sorted(set(words[r.loaded].tolist()))
    }


def _losses_marks(delays: Array) -> Tree:
    seen = delays[np.isfinite(delays)]
    none = len(seen) == 0
    return {
        "of": len(delays),
        "recall": len(seen) / len(delays) if len(delays) else None,
        "recall_interval95": wilson(len(seen), len(delays)),
        "delay_median_s": None if none else float(np.median(seen)),
        "delay_p95_s": None if none else float(np.quantile(seen, 0.95)),
        "delay_mean_s": None if none else float(np.mean(seen)),
    }


def _alarm_marks(r: Records, name: str, threshold: float, mask: NDArray[np.bool_]) -> Tree:
    count, hours = (
        int((r.windows[name][mask] >= threshold).sum()),
        float(r.window_s[mask].sum()) / 3600.0,
    )
    return {
        "count": count,
        "foot_hours": round(hours, 4),
        "per_hour": count / hours if hours > 0 else None,
        "interval95": poisson(count, hours),
    }


def _curve(r: Records, name: str) -> list[list[float | None]]:
    """[false alarms an hour and foot, median delay, recall] at thresholds from never to always."""
    quiet = r.windows[name][r.low_n >= LOADED_N]
    hours = float(r.window_s[r.low_n >= LOADED_N].sum()) / 3600.0
    stairs = [s for s, loaded in zip(r.stairs[name], r.loaded, strict=True) if loaded]
    reached = np.array([stair[-1][1] for stair in stairs if stair])
    if not len(reached) or hours <= 0.0:
        return []
    shares = np.linspace(0.0, 1.0, CURVE_POINTS)
    rare = np.sort(quiet)[-CURVE_POINTS // 2 :]
    above = np.nextafter(quiet.max(), np.inf)
    at = np.unique(
        np.concatenate([np.quantile(reached, shares), np.quantile(quiet, shares), rare, [above]])
    )
    rows: list[list[float | None]] = []
    for threshold in at[::-1]:
        delays = delays_s(stairs, float(threshold))
        seen = delays[np.isfinite(delays)]
        median = float(np.median(seen)) if len(seen) else None
        rows.append([float((quiet >= threshold).sum()) / hours, median, len(seen) / len(delays)])
    return rows


def _warning(scenes: Sequence[Tree]) -> Tree:
    """The early warning, on the true load, without the thrust's plan, and the trade-off over the load to warn at."""
    curve = [
        {"warn_at_n": n} | marks([s["warning"]["curve"][str(n)] for s in scenes]) for n in CURVE_N
    ]
    return marks([s["warning"]["own"] for s in scenes]) | {
        "warn_at_n": NUMBERS["warn_at"],
        "on_true_load": marks([s["warning"]["true"] for s in scenes]),
        "without_plan": marks([s["warning"]["unplanned"] for s in scenes]),
        "curve": curve,
    }


def _supervisor(scenes: Sequence[Tree]) -> Tree:
    """Seconds that feet meant to carry bore nothing, with and without the supervisor, on the same seeds."""
    off = {(s["scene"]["kind"], s["scene"]["number"]): s for s in scenes}
    pairs = [
        (off["losses", n], s)
        for (kind, n), s in off.items()
        if kind == "supervised" and ("losses", n) in off
    ]
    return {
        "pairs": len(pairs),
        "off_s_without": round(sum(a["off_s"] for a, _ in pairs), 3),
        "off_s_with": round(sum(b["off_s"] for _, b in pairs), 3),
        "better": sum(b["off_s"] < a["off_s"] for a, b in pairs),
        "simulated_s": round(sum(b["simulated_s"] for _, b in pairs), 1),
        "fell_or_slid_without": sum(a["verdict"] != "stood" for a, _ in pairs),
        "fell_or_slid_with": sum(b["verdict"] != "stood" for _, b in pairs),
    }


def table(result: Tree) -> Table:
    """All detectors side by side."""
    heads = [
        "detector",
        "recall",
        "95 %",
        "false alarms/h",
        "95 %",
        "light/h",
        "delay ms",
        "p95",
        "mean",
        "floor",
    ]

    def share(v: Any) -> str:
        return "" if v is None else f"{v:.4f}"

    def ms(v: Any) -> str:
        return "" if v is None else f"{1e3 * v:.1f}"

    def span(v: Any, form: str) -> str:
        return "" if v is None else f"{v[0]:{form}} to {v[1]:{form}}"

    rows = []
    for d in result["detectors"]:
        rate, light = d["false_alarms_per_hour"], d["light"]["per_hour"]
        rows.append(
            [
                d["name"] + (" *" if d["best"] else ""),
                share(d["recall"]),
                span(d["recall_interval95"], ".3f"),
                "" if rate is None else f"{rate:.2f}",
                span(d["false_alarms_per_hour_interval95"], ".2f"),
                "" if light is None else f"{light:.0f}",
                ms(d["delay_median_s"]),
                ms(d["delay_p95_s"]),
                ms(d["delay_mean_s"]),
                ms(d["delay_floor_s"]),
            ]
        )
    return Table("Contact loss", heads, rows)
