"""What the blind test of the diagnosis says: confusion, accuracy by strength, calibration, closed
share, baselines.
"""

from __future__ import annotations

from collections.abc import Sequence
from itertools import pairwise
from typing import Any

import numpy as np

from testbed.benchmarks.harness import wilson
from testbed.benchmarks.reference_leg.rigs import answers

Trial = dict[str, Any]
BINS = 10
STRENGTHS = (0.1, 0.2, 0.4, 0.8, 1.6)
"""Edges of the classes of strength; 1 is well visible."""


def scores(trials: Sequence[Trial]) -> dict[str, Any]:
    """The contents of evaluation.json."""
    seen = [trial for trial in trials if trial["visible"]]
    single = [trial for trial in seen if trial["kind"] == "single"]
    double = [trial for trial in seen if trial["kind"] == "double"]
    outside = [trial for trial in seen if trial["kind"] == "outside"]
    clean = [trial for trial in trials if trial["kind"] == "clean"]
    shares = [share for trial in single + double if (share := closed(trial)) is not None]
    oracle = [
        trial["oracle_closed_force"]
        for trial in single + double
        if trial["oracle_closed_force"] is not None
    ]
    added = [share for trial in single + double if (share := closed_of_added(trial)) is not None]
    generic = [trial["closed_force"] for trial in outside if trial["closed_force"] is not None]
    return {
        "rigs": len(trials),
        "visible": len(seen),
        "single_named": rate([set(trial["names"]) == set(trial["truth"]) for trial in single]),
        "single_among_first_two": rate([_among(trial, 2) for trial in single]),
        "double_both_named": rate([set(trial["names"]) == set(trial["truth"]) for trial in double]),
        "double_one_named_no_wrong": rate(
            [
                len(trial["names"]) > 0 and set(trial["names"]) < set(trial["truth"])
                for trial in double
            ]
        ),
        "clean_none": rate([trial["verdict"] == "none" for trial in clean]),
        "clean_made_worse": max((worsened(trial) for trial in clean), default=0.0),
        "outside_unnamed": rate([trial["verdict"] == "unnamed" for trial in outside]),
        "outside_confidently_misnamed": rate([_confident(trial) for trial in outside]),
        "closed_share": quantiles(shares),
        "closed_share_of_the_oracle": quantiles(oracle),
        "closed_share_of_what_was_added": quantiles(added),
        "closed_share_outside": quantiles(generic),
        "outside_made_worse": quantiles([worsened(trial) for trial in outside]),
        "accuracy_by_strength": by_strength(
            [trial for trial in trials if trial["kind"] == "single"]
        ),
        "calibration": calibration(trials),
        "intervals": coverage(single),
        "confusion": confusion(trials),
        "seconds_a_rig": quantiles([trial["seconds"] for trial in trials]),
        "baselines": baselines(trials, single, double, clean),
    }


SHOWS = 0.1
"""Share of the force error that knowing the names must close for an effect to count as one of the
force.
"""


def closed(trial: Trial) -> float | None:
    """Share of the closable squared error closed: of the force, or of the flow for effects that
    only flows show.
    """
    force = trial["oracle_closed_force"] is not None and trial["oracle_closed_force"] >= SHOWS
    share: float | None = trial["closed_force"] if force else trial["closed_flow"]
    return share


def closed_of_added(trial: Trial) -> float | None:
    """Share of the squared error that the hidden effects add which is closed: above the error of
    the refitted model of the sound twin, not above the sensors' floor; averaged over the recordings
    where refit > 1.1 of that.

    The floor knows sensors and encoder only; what a friction law of another form leaves over in a
    sound machine, and landings on the load cell, no effect's name can close.
    """
    quantity = "force_n" if (trial["oracle_closed_force"] or 0.0) >= SHOWS else "flow_m3_s"
    shares = []
    for name, row in (trial.get("sound") or {}).items():
        errors, least = trial["error"][name].get(quantity), row.get(quantity, 0.0)
        if errors and errors["refit"] > 1.1 * max(least, errors["floor"]):
            least = max(least, errors["floor"])
            shares.append(
                (errors["refit"] ** 2 - errors["after"] ** 2) / (errors["refit"] ** 2 - least**2)
            )
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
    return {f"p{percent}": float(np.percentile(values, percent)) for percent in (10, 50, 90)}


def _among(trial: Trial, count: int) -> bool:
    sets = [set(hypothesis["names"]) for hypothesis in trial["hypotheses"][:count]]
    return set(trial["truth"]) in sets


def _confident(trial: Trial) -> bool:
    top = trial["hypotheses"][0]
    return bool(trial["verdict"] == "effect" and top["probability"] > 0.8)


def worsened(trial: Trial) -> float:
    """Largest relative growth of a recording's force error from refit to after."""
    rows = [row["force_n"] for row in trial["error"].values()]
    return max((row["after"] / row["refit"] - 1.0 for row in rows), default=0.0)


def truth_set(trial: Trial) -> frozenset[str]:
    """The set that a perfect diagnosis would call most probable."""
    if not trial["visible"] or trial["kind"] == "clean":
        return frozenset()
    return frozenset(trial["truth"]) if trial["kind"] != "outside" else frozenset(["unnamed"])


def calibration(trials: Sequence[Trial]) -> dict[str, Any]:
    """Expected calibration error and Brier score of the top hypothesis; the Brier score of base
    rates beside it.
    """
    stated = np.array([trial["hypotheses"][0]["probability"] for trial in trials])
    right = np.array(
        [frozenset(trial["hypotheses"][0]["names"]) == truth_set(trial) for trial in trials],
        dtype=float,
    )
    index = np.minimum((stated * BINS).astype(int), BINS - 1)
    rows, error = [], 0.0
    for bin_ in range(BINS):
        here = index == bin_
        if here.any():
            rows.append([float(stated[here].mean()), float(right[here].mean()), int(here.sum())])
            error += abs(rows[-1][0] - rows[-1][1]) * here.mean()
    brier = float(np.mean([_brier(trial) for trial in trials]))
    truths = [truth_set(trial) for trial in trials]
    base = {truth: truths.count(truth) / len(truths) for truth in set(truths)}
    norm = sum(probability * probability for probability in base.values())
    reference = float(np.mean([norm - 2 * base[truth] + 1.0 for truth in truths]))
    return {
        "expected_calibration_error": float(error),
        "bins": rows,
        "brier": brier,
        "brier_of_base_rates": reference,
    }


def _brier(trial: Trial) -> float:
    truth = truth_set(trial)
    given = {
        frozenset(hypothesis["names"]): hypothesis["probability"]
        for hypothesis in trial["hypotheses"]
    }
    return float(
        sum((probability - (name == truth)) ** 2 for name, probability in given.items())
        + (0.0 if truth in given else 1.0)
    )


def by_strength(single: Sequence[Trial]) -> list[dict[str, Any]]:
    """Share of single effects named right in classes of strength, visible or not."""
    out = []
    for low, high in pairwise(STRENGTHS):
        here = [trial for trial in single if low <= trial["strength"][0] < high]
        named = rate([set(trial["names"]) == set(trial["truth"]) for trial in here])
        out.append(
            {
                "from": low,
                "to": high,
                "named": named,
                "visible": rate([trial["visible"] for trial in here]),
            }
        )
    return out


def coverage(single: Sequence[Trial]) -> dict[str, Any]:
    """How often 90 % intervals hold the truth, where the hidden law is the contract's."""
    hits, known = [], answers()
    for trial in single:
        name = trial["truth"][0]
        if name not in trial["parameters"] or name not in known or trial["form"][0] != 0:
            continue
        parameter, number = known[name]
        _, interval = trial["parameters"][name].get(parameter, (None, None))
        if interval:
            hits.append(interval[0] <= trial["numbers"][number] <= interval[1])
    return rate(hits)


def confusion(trials: Sequence[Trial]) -> dict[str, dict[str, int]]:
    """Hidden set -> said set -> how often; effects that are not visible count as none."""
    out: dict[str, dict[str, int]] = {}
    for trial in trials:
        hidden = " + ".join(sorted(truth_set(trial))) or "none"
        said = " + ".join(sorted(trial["names"])) or trial["verdict"]
        row = out.setdefault(hidden, {})
        row[said] = row.get(said, 0) + 1
    return out


def baselines(
    trials: Sequence[Trial],
    single: Sequence[Trial],
    double: Sequence[Trial],
    clean: Sequence[Trial],
) -> dict[str, Any]:
    """Marks for doing nothing, refitting only, raw BIC stepwise and a black-box
    regression.
    """
    black = [
        trial["black_box_closed_force"]
        for trial in [*single, *double]
        if trial["black_box_closed_force"] is not None
    ]
    return {
        "do_nothing": {"single_named": 0.0, "clean_none": 1.0, "closed_share": 0.0},
        "refit_only": {"single_named": 0.0, "clean_none": 1.0, "closed_share": 0.0},
        "raw_bic": {
            "single_named": rate(
                [set(trial["raw_bic"]) == set(trial["truth"]) for trial in single]
            ),
            "double_both_named": rate(
                [set(trial["raw_bic"]) == set(trial["truth"]) for trial in double]
            ),
            "clean_none": rate([not trial["raw_bic"] for trial in clean]),
            "outside_unnamed": rate(
                [False for trial in trials if trial["kind"] == "outside" and trial["visible"]]
            ),
        },
        "black_box": {"closed_share": quantiles(black)},
    }
