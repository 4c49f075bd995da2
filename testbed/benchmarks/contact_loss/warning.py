"""The early warning judged: which warnings came true, and how many gradual losses were announced in time.

The loads of a scene are kept as means of 5 ms, so that a new rule or other numbers of it are judged without simulating
again. A warning speaks of the two seconds after it, and is judged only while there is something to warn of:

- the foot has borne 300 N or more for the last 0.5 s, as before a loss; else the alarm has spoken, and it is `late`;
- it came true only if the true normal force of that foot, meant to carry, falls below 300 N for 20 ms or more and that
  begins within the 2 s. A touch of less than 20 ms, or a load that stops at 301 N, is a false warning; those whose load
  fell below 600 N are counted among the false ones and told apart as `near`;
- every warning counts, also a second one of the same fall;
- feet that bore 1600 N or more in the last 5 s count, as losses of such feet do; lighter feet are told apart.

A gradual loss is warned of in time by a warning 0.1 to 2 s before it. Of the warnings that came true, those that came
0.1 s or more before the foot was lost are told apart as `early`: the others say little that the alarm does not.

The thrust that the drill's program orders is drawn again with its scene.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from testbed.benchmarks.contact_loss.scenes import SETTLE_S, Scene, draw
from testbed.benchmarks.contact_loss.score import (
    CARRIED_S,
    GRADUAL_S,
    LOADED_BEFORE_S,
    LOADED_N,
    NEAR_N,
    stretches,
)
from testbed.benchmarks.statistics import wilson
from testbed.control.drilling.thrust_plan import planned_thrust
from testbed.estimation.detectors import warning as rule
from testbed.estimation.detectors.warning import NUMBERS, NUMBERS_ON_TRUTH, STEP_S
from testbed.estimation.losses import LOSS_S

Array = NDArray[np.float64]
Tree = dict[str, Any]
WITHIN_S, LEAD_S = 2.0, 0.1
CURVE_N = (250, 300, 350, 400, 450, 500, 560, 600, 700, 800)
"""Predicted loads to warn at, for the trade-off of precision against time, N."""


def looked_at(loads_n: Array, plan: Array | None = None) -> NDArray[Any]:
    """What the warning looks at, `Seen` (m,): loads (m, 4) and the thrust's plan (m, 2); None: unknown."""
    seen = rule.Seen.zeros(len(loads_n))
    seen["load"] = loads_n
    if plan is not None:
        seen["thrust"], seen["rising"] = plan.T
    return seen


def raised(seen: NDArray[Any], numbers: Mapping[str, float]) -> list[tuple[int, float]]:
    """The warnings a rule with these numbers raises on what it looks at: foot, time s."""
    score = rule.raised(seen, numbers)
    found = [
        (foot, (a + 1) * STEP_S) for foot in range(4) for a, _ in stretches(score[:, foot] > 0.5)
    ]
    return [(foot, round(t, 3)) for foot, t in found if t >= SETTLE_S]


def judged(
    foot: int, t: float, off: Sequence[Sequence[float]], true_n: Array
) -> tuple[bool, str] | None:
    """Whether the foot was loaded, and `early`, `lost`, `near` or `false`; `late` where it was off just before.

    None for a warning whose two seconds the scene cuts off.
    """
    mine = [s for s in off if s[0] == foot]
    if any(start <= t and end > t - CARRIED_S for _, start, end, _ in mine):
        return True, "late"
    at, ahead = round(t / STEP_S), round(WITHIN_S / STEP_S)
    before = true_n[max(0, at - round(LOADED_BEFORE_S / STEP_S)) : at, foot]
    loaded = bool(before.max(initial=0.0) >= LOADED_N)
    if at + ahead > len(true_n):
        return None
    soon = [s for s in mine if t < s[1] <= t + WITHIN_S]
    lost = [start for _, start, end, meant in soon if meant and end - start >= LOSS_S - 1e-9]
    if lost:
        return loaded, "early" if min(lost) - t >= LEAD_S - 1e-9 else "lost"
    return loaded, "near" if soon or true_n[at : at + ahead, foot].min() < NEAR_N else "false"


def outcome(scene: Tree, seen: NDArray[Any], true_n: Array, numbers: Mapping[str, float]) -> Tree:
    """What a scene says of a rule on what it looks at: counts, and the lead before each gradual loss, s."""
    given = raised(seen, numbers)
    words = [judged(foot, t, scene["off"], true_n) for foot, t in given]
    counts = {
        word: sum(w == (True, word) for w in words)
        for word in ("early", "lost", "near", "false", "late")
    }
    counts["lost"] += counts["early"]
    counts["light"] = sum(w is not None and not w[0] for w in words)
    counts["light_lost"] = sum(w in ((False, "lost"), (False, "early")) for w in words)
    leads = []
    for loss in scene["losses"]:
        if gradual(loss):
            ahead = [loss["start_s"] - t for foot, t in given if foot == loss["foot"]]
            leads.append(max((lead for lead in ahead if 0.0 < lead <= WITHIN_S), default=0.0))
    return counts | {"leads_s": leads}


def gradual(loss: Tree) -> bool:
    """Whether there was time to warn of a loss, and sticking could not hide it."""
    return bool(loss["load_before_n"] >= LOADED_N and loss["below_share_s"] >= GRADUAL_S)


def outcomes(scene: Tree, loads: dict[str, Array]) -> Tree:
    """What a scene says of the warning, of other thresholds, and of what it would be with more and with less known."""
    true = loads["true"]
    plan = planned_thrust(draw(Scene(**scene["scene"])).scenario.task, len(true), STEP_S)
    seen = looked_at(loads["own"], plan)
    curve = {str(n): outcome(scene, seen, true, {**NUMBERS, "warn_at": n}) for n in CURVE_N}
    return {
        "own": outcome(scene, seen, true, NUMBERS),
        "unplanned": outcome(scene, looked_at(loads["own"]), true, NUMBERS),
        "true": outcome(scene, looked_at(true, plan), true, NUMBERS_ON_TRUTH),
        "curve": curve,
    }


def marks(found: Sequence[Tree]) -> Tree:
    """What all scenes say, added up; intervals are those of 95 %."""
    leads = [lead for o in found for lead in o["leads_s"]]
    words = ("lost", "early", "near", "false", "late", "light", "light_lost")
    lost, early, near, false, late, light, light_lost = (
        sum(o[word] for o in found) for word in words
    )
    in_time, given = sum(lead >= LEAD_S - 1e-9 for lead in leads), lost + near + false
    wrong = near + false
    return {
        "gradual_losses": len(leads),
        "warned_100_ms_ahead": in_time / len(leads) if leads else None,
        "warned_interval95": wilson(in_time, len(leads)),
        "lead_median_s": float(np.median(leads)) if leads else None,
        "warnings": given,
        "lost": lost,
        "near": near,
        "false": false,
        "late": late,
        "precision": lost / given if given else None,
        "precision_interval95": wilson(lost, given),
        "early": early,
        "precision_of_early": early / (early + wrong) if early + wrong else None,
        "light_feet": {"warnings": light, "lost": light_lost},
    }
