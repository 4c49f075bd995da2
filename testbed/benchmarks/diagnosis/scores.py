"""What the blind test of the diagnosis says: confusion, accuracy by strength, calibration, closed
share, baselines.
"""

from __future__ import annotations

from collections.abc import Sequence
from itertools import pairwise
from typing import Any

import numpy as np

from testbed.benchmarks.reference_leg.rigs import ANSWERS
from testbed.benchmarks.statistics import wilson

Trial = dict[str, Any]
BINS = 10
STRENGTHS = (0.1, 0.2, 0.4, 0.8, 1.6)
"""Edges of the classes of strength; 1 is well visible."""


def scores(trials: Sequence[Trial]) -> dict[str, Any]:
    """The contents of evaluation.json."""
    seen = [t for t in trials if t["visible"]]
    single = [t for t in seen if t["kind"] == "single"]
    double = [t for t in seen if t["kind"] == "double"]
    outside = [t for t in seen if t["kind"] == "outside"]
    clean = [t for t in trials if t["kind"] == "clean"]
    shares = [share for t in single + double if (share := closed(t)) is not None]
    oracle = [
        t["oracle_closed_force"] for t in single + double if t["oracle_closed_force"] is not None
    ]
    added = [share for t in single + double if (share := closed_of_added(t)) is not None]
    generic = [t["closed_force"] for t in outside if t["closed_force"] is not None]
    return {
        "rigs": len(trials),
        "visible": len(seen),
        "single_named": rate([set(t["names"]) == set(t["truth"]) for t in single]),
        "single_among_first_two": rate([_among(t, 2) for t in single]),
        "double_both_named": rate([set(t["names"]) == set(t["truth"]) for t in double]),
        "double_one_named_no_wrong": rate(
            [len(t["names"]) > 0 and set(t["names"]) < set(t["truth"]) for t in double]
        ),
        "clean_none": rate([t["verdict"] == "none" for t in clean]),
        "clean_made_worse": max((worsened(t) for t in clean), default=0.0),
        "outside_unnamed": rate([t["verdict"] == "unnamed" for t in outside]),
        "outside_confidently_misnamed": rate([_confident(t) for t in outside]),
        "closed_share": quantiles(shares),
        "closed_share_of_the_oracle": quantiles(oracle),
        "closed_share_of_what_was_added": quantiles(added),
        "closed_share_outside": quantiles(generic),
        "outside_made_worse": quantiles([worsened(t) for t in outside]),
        "accuracy_by_strength": by_strength([t for t in trials if t["kind"] == "single"]),
        "calibration": calibration(trials),
        "intervals": coverage(single),
        "confusion": confusion(trials),
        "seconds_a_rig": quantiles([t["seconds"] for t in trials]),
        "baselines": baselines(trials, single, double, clean),
    }


SHOWS = 0.1
"""Share of the force error that knowing the names must close for an effect to count as one of the
force.
"""


def closed(t: Trial) -> float | None:
    """Share of the closable squared error closed: of the force, or of the flow for effects that
    only flows show.
    """
    force = t["oracle_closed_force"] is not None and t["oracle_closed_force"] >= SHOWS
    share: float | None = t["closed_force"] if force else t["closed_flow"]
    return share


def closed_of_added(t: Trial) -> float | None:
    """Share of the squared error that the hidden effects add which is closed: above the error of
    the refitted model of the sound twin, not above the sensors' floor; averaged over the recordings
    where refit > 1.1 of that.

    The floor knows sensors and encoder only; what a friction law of another form leaves over in a
    sound machine, and landings on the load cell, no effect's name can close.
    """
    quantity = "force_n" if (t["oracle_closed_force"] or 0.0) >= SHOWS else "flow_m3_s"
    shares = []
    for name, row in (t.get("sound") or {}).items():
        e, least = t["error"][name].get(quantity), row.get(quantity, 0.0)
        if e and e["refit"] > 1.1 * max(least, e["floor"]):
            least = max(least, e["floor"])
            shares.append((e["refit"] ** 2 - e["after"] ** 2) / (e["refit"] ** 2 - least**2))
    return float(np.mean(shares)) if shares else None


def rate(hits: Sequence[bool]) -> dict[str, float]:
    """Share of hits, their number and the 95 % interval (Wilson)."""
    interval = wilson(sum(hits), len(hits), z=1.96)
    if interval is None:
        return {"share": float("nan"), "of": 0}
    low, high = interval
    return {"share": sum(hits) / len(hits), "of": len(hits), "low95": low, "high95": high}


def quantiles(values: Sequence[float]) -> dict[str, float]:
    """10th percentile, median, 90th percentile."""
    if not values:
        return {}
    return {f"p{q}": float(np.percentile(values, q)) for q in (10, 50, 90)}


def _among(t: Trial, count: int) -> bool:
    sets = [set(h["names"]) for h in t["hypotheses"][:count]]
    return set(t["truth"]) in sets


def _confident(t: Trial) -> bool:
    top = t["hypotheses"][0]
    return bool(t["verdict"] == "effect" and top["probability"] > 0.8)


def worsened(t: Trial) -> float:
    """Largest relative growth of a recording's force error from refit to after."""
    rows = [r["force_n"] for r in t["error"].values()]
    return max((e["after"] / e["refit"] - 1.0 for e in rows), default=0.0)


def truth_set(t: Trial) -> frozenset[str]:
    """The set that a perfect diagnosis would call most probable."""
    if not t["visible"] or t["kind"] == "clean":
        return frozenset()
    return frozenset(t["truth"]) if t["kind"] != "outside" else frozenset(["unnamed"])


def calibration(trials: Sequence[Trial]) -> dict[str, Any]:
    """Expected calibration error and Brier score of the top hypothesis; the Brier score of base
    rates beside it.
    """
    stated = np.array([t["hypotheses"][0]["probability"] for t in trials])
    right = np.array(
        [frozenset(t["hypotheses"][0]["names"]) == truth_set(t) for t in trials], dtype=float
    )
    index = np.minimum((stated * BINS).astype(int), BINS - 1)
    rows, error = [], 0.0
    for b in range(BINS):
        here = index == b
        if here.any():
            rows.append([float(stated[here].mean()), float(right[here].mean()), int(here.sum())])
            error += abs(rows[-1][0] - rows[-1][1]) * here.mean()
    brier = float(np.mean([_brier(t) for t in trials]))
    truths = [truth_set(t) for t in trials]
    base = {s: truths.count(s) / len(truths) for s in set(truths)}
    norm = sum(p * p for p in base.values())
    reference = float(np.mean([norm - 2 * base[s] + 1.0 for s in truths]))
    return {
        "expected_calibration_error": float(error),
        "bins": rows,
        "brier": brier,
        "brier_of_base_rates": reference,
    }


def _brier(t: Trial) -> float:
    truth = truth_set(t)
    given = {frozenset(h["names"]): h["probability"] for h in t["hypotheses"]}
    return float(
        sum((p - (s == truth)) ** 2 for s, p in given.items()) + (0.0 if truth in given else 1.0)
    )


def by_strength(single: Sequence[Trial]) -> list[dict[str, Any]]:
    """Share of single effects named right in classes of strength, visible or not."""
    out = []
    for low, high in pairwise(STRENGTHS):
        here = [t for t in single if low <= t["strength"][0] < high]
        named = rate([set(t["names"]) == set(t["truth"]) for t in here])
        out.append(
            {"from": low, "to": high, "named": named, "visible": rate([t["visible"] for t in here])}
        )
    return out


def coverage(single: Sequence[Trial]) -> dict[str, Any]:
    """How often 90 % intervals hold the truth, where the hidden law is the contract's."""
    hits = []
    for t in single:
        name = t["truth"][0]
        if name not in t["parameters"] or name not in ANSWERS or t["form"][0] != 0:
            continue
        parameter, number = ANSWERS[name]
        _, interval = t["parameters"][name].get(parameter, (None, None))
        if interval:
            hits.append(interval[0] <= t["numbers"][number] <= interval[1])
    return rate(hits)


def confusion(trials: Sequence[Trial]) -> dict[str, dict[str, int]]:
    """Hidden set -> said set -> how often; effects that are not visible count as none."""
    out: dict[str, dict[str, int]] = {}
    for t in trials:
        hidden = " + ".join(sorted(truth_set(t))) or "none"
        said = " + ".join(sorted(t["names"])) or t["verdict"]
        row = out.setdefault(hidden, {})
        row[said] = row.get(said, 0) + 1
    return out


def baselines(
    trials: Sequence[Trial],
    single: Sequence[Trial],
    double: Sequence[Trial],
    clean: Sequence[Trial],
) -> dict[str, Any]:
    """The same marks for doing nothing, refitting only, raw BIC stepwise and a black-box
    regression.
    """
    black = [
        t["black_box_closed_force"]
        for t in [*single, *double]
        if t["black_box_closed_force"] is not None
    ]
    return {
        "do_nothing": {"single_named": 0.0, "clean_none": 1.0, "closed_share": 0.0},
        "refit_only": {"single_named": 0.0, "clean_none": 1.0, "closed_share": 0.0},
        "raw_bic": {
            "single_named": rate([set(t["raw_bic"]) == set(t["truth"]) for t in single]),
            "double_both_named": rate([set(t["raw_bic"]) == set(t["truth"]) for t in double]),
            "clean_none": rate([not t["raw_bic"] for t in clean]),
            "outside_unnamed": rate(
                [False for t in trials if t["kind"] == "outside" and t["visible"]]
            ),
        },
        "black_box": {"closed_share": quantiles(black)},
    }
