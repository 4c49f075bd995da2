"""The early warning judged: which warnings came true, and how many gradual losses were announced in
time.

A warning speaks of the two seconds after it, and is judged only while there is something to warn
of:

- the foot has been in contact for the last 0.5 s; else the alarm has spoken, and it is `late`;
- it came true only if a loss of that foot (estimation/contact_losses.py) begins within the 2 s;
  other warnings are false; those whose load fell below twice the force of a loss are `near`;
- every warning counts, also a second one of the same fall;
- feet that bore LIGHT_SHARE of the nominal load in the last 2 s count; lighter feet apart.

A gradual loss is warned of in time by a warning 0.1 to 2 s before it. Of the warnings that came
true, those that came 0.1 s or more before the foot was lost count apart as `early`: the others
say little that the alarm does not.
"""

from __future__ import annotations

from bisect import bisect_right
from collections.abc import Mapping, Sequence
from itertools import accumulate
from typing import Any

import numpy as np
from numpy.typing import NDArray

from testbed.benchmarks.contact_loss import warning_rule as rule
from testbed.benchmarks.contact_loss.recordings import Tape
from testbed.benchmarks.contact_loss.scenes import SETTLE_S, Scene, draw
from testbed.benchmarks.contact_loss.score import CLASSES, NEAR_SHARE, Reference
from testbed.benchmarks.contact_loss.warning_rule import NUMBERS, NUMBERS_ON_TRUTH, STEP_S
from testbed.benchmarks.harness import wilson
from testbed.estimation.contact_losses import intervals
from testbed.formats.arrays import Array
from testbed.formats.records import SET
from testbed.scenario.tasks import Drill
from testbed.world.drilling.drilling import ramp_share

# The thrust that a drill's program orders, and for how long it still rises: its controls know that
# beforehand.


def planned_thrust(task: object, steps: int, step_s: float) -> Array:
    """(steps, 2): thrust ordered at the end of each step (N, + away from the slope), seconds that
    it still rises.

    Zeros for whatever is no list of phases: what a hole drilled through layers asks for, the rock
    decides.
    """
    plan = np.zeros((steps, 2))
    if not isinstance(task, Drill):
        return plan
    starts = list(accumulate((phase.duration_s for phase in task.phases), initial=0.0))
    for index in range(steps):
        plan[index, 0] = _ordered_n(task, starts, (index + 1) * step_s - task.start_s)
    for index in range(steps - 2, -1, -1):
        plan[index, 1] = plan[index + 1, 1] + step_s if plan[index + 1, 0] > plan[index, 0] else 0.0
    return plan


def _ordered_n(task: Drill, starts: list[float], since_s: float) -> float:
    if since_s < 0.0 or (since_s >= starts[-1] and not task.repeat):
        return 0.0
    within = since_s % starts[-1]
    order = bisect_right(starts, within) - 1
    phase = task.phases[order]
    most = getattr(phase, "feed_n", 0.0) - getattr(phase, "pull_n", 0.0)
    return ramp_share(within - starts[order], phase.duration_s, task.ramp_s) * float(most)


Tree = dict[str, Any]
WITHIN_S, LEAD_S, CARRIED_S = 2.0, 0.1, 0.5
CURVE_N = (100, 200, 280, 450, 600, 800, 1200)
"""Predicted loads to warn at, for the trade-off of precision against time, N."""
LOADED = CLASSES.index("loaded")
DEFINITIONS = {
    "warned": f"a warning of that foot {LEAD_S:g} to {WITHIN_S:g} s before a gradual loss of a loaded foot",
    "right_warning": f"a loss of that foot begins within {WITHIN_S:g} s after it",
    "gradual": "the second half of the way down to the force of a loss took 0.1 s or more",
}


def means(values: Array, dt_s: float) -> Array:
    """Means of 5 ms of (n, feet); what is left over at the end is dropped."""
    each = max(round(STEP_S / dt_s), 1)
    whole = len(values) // each
    return np.asarray(values[: whole * each].reshape(whole, each, -1).mean(axis=1))


def looked_at(
    loads_n: Array, plan: Array | None = None, carrying: Array | None = None
) -> NDArray[Any]:
    """What the warning looks at, `Seen` (m,): loads (m, 4), the thrust's plan (m, 2), and whether
    the control wishes a foot to carry (m, 4); None: unknown.
    """
    seen = rule.Seen.zeros(len(loads_n))
    seen["load"] = loads_n
    if carrying is not None:
        seen["lifted"] = carrying < SET
    if plan is not None:
        seen["thrust"], seen["rising"] = plan.T
    return seen


def raised(seen: NDArray[Any], numbers: Mapping[str, float]) -> list[tuple[int, float]]:
    """The warnings a rule with these numbers raises on what it looks at: foot, time s."""
    score = rule.raised(seen, numbers)
    time: Array = np.asarray(np.arange(1, len(score) + 1) * STEP_S, dtype=np.float64)
    found = [(foot, time[a]) for foot in range(4) for a, _ in intervals(score[:, foot] > SET, time)]
    return [(foot, round(float(t), 3)) for foot, t in found if t >= SETTLE_S]


def judged(
    foot: int, t: float, off: Reference, true_n: Array, near_n: float
) -> tuple[bool, str] | None:
    """Whether the foot was loaded, and `early`, `lost`, `near` or `false`; `late` where it was off
    just before.

    true_n (m, 4): means of 5 ms from the scene's start. None for a warning whose two seconds the
    scene cuts off.
    """
    time, carries = off.time_s, off.carrying[:, foot]
    at = int(np.searchsorted(time, t))
    first = int(np.searchsorted(time, t - CARRIED_S))
    before = true_n[max(0, round((t - WITHIN_S) / STEP_S)) : round(t / STEP_S), foot]
    loaded = bool(len(before) and np.quantile(before, 0.9) >= off.loaded_n)
    if not carries[first : at + 1].all():
        return loaded, "late"
    if t + WITHIN_S > time[-1]:
        return None
    coming = [s.start_s - t for s in off.losses if s.foot == foot and 0 < s.start_s - t <= WITHIN_S]
    if coming:
        return loaded, "early" if min(coming) >= LEAD_S - 1e-9 else "lost"
    after = true_n[round(t / STEP_S) : round((t + WITHIN_S) / STEP_S), foot]
    return loaded, "near" if after.min() < near_n else "false"


def outcome(
    off: Reference, seen: NDArray[Any], true_n: Array, near_n: float, numbers: Mapping[str, float]
) -> Tree:
    """What a scene says of a rule on what it looks at: counts, and the lead before each gradual
    loss, s.
    """
    given = raised(seen, numbers)
    words = [judged(foot, t, off, true_n, near_n) for foot, t in given]
    kinds = ("early", "lost", "near", "false", "late")
    counts = {word: sum(w == (True, word) for w in words) for word in kinds}
    counts["lost"] += counts["early"]
    counts["light"] = sum(w is not None and not w[0] for w in words)
    counts["light_lost"] = sum(w in ((False, "lost"), (False, "early")) for w in words)
    leads = []
    for loss in off.losses:
        if loss.gradual and loss.load_class == LOADED:
            ahead = [loss.start_s - t for foot, t in given if foot == loss.foot]
            leads.append(max((lead for lead in ahead if 0.0 < lead <= WITHIN_S), default=0.0))
    return counts | {"leads_s": leads}


def outcomes(scene: Scene, tape: Tape, off: Reference) -> Tree:
    """What a scene says of the warning, of other thresholds, and of what it would be with more and
    with less known.
    """
    true = means(tape.normal_n, tape.dt_s)
    row = tape.samples["row"]
    own = means(np.asarray(row["estimate"]["own"]), tape.dt_s)
    carrying = means(np.asarray(row["carrying"]), tape.dt_s)
    plan = planned_thrust(draw(scene).scenario.task, len(true), STEP_S)
    near_n, planned = NEAR_SHARE * tape.rule.nominal_load_n, looked_at(own, plan, carrying)
    curve = {
        str(n): outcome(off, planned, true, near_n, {**NUMBERS, "warn_at": n}) for n in CURVE_N
    }
    return {
        "own": outcome(off, planned, true, near_n, NUMBERS),
        "unplanned": outcome(off, looked_at(own), true, near_n, NUMBERS),
        "true": outcome(off, looked_at(true, plan, carrying), true, near_n, NUMBERS_ON_TRUTH),
        "curve": curve,
    }


def marks(scenes: Sequence[Tree]) -> Tree:
    """The early warning, on the true load, without the thrust's plan and the orders, and the
    trade-off over the load to warn at.
    """
    kept = [scene["warning"] for scene in scenes]
    curve = [{"warn_at_n": n} | added_up([w["curve"][str(n)] for w in kept]) for n in CURVE_N]
    return added_up([w["own"] for w in kept]) | {
        "warn_at_n": NUMBERS["warn_at"],
        "on_true_load": added_up([w["true"] for w in kept]),
        "without_plan": added_up([w["unplanned"] for w in kept]),
        "curve": curve,
    }


def added_up(found: Sequence[Tree]) -> Tree:
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


def supervisor_marks(scenes: Sequence[Tree]) -> Tree:
    """Seconds that feet were off the ground, with and without the supervisor, on the same seeds."""
    off = {(s["scene"]["kind"], s["scene"]["number"]): s for s in scenes}
    pairs = [
        (off["drill", number], scene)
        for (kind, number), scene in off.items()
        if kind == "supervised" and ("drill", number) in off
    ]
    lost = [(sum(a["lost_s"]), sum(b["lost_s"])) for a, b in pairs]
    return {
        "pairs": len(pairs),
        "off_s_without": round(sum(a for a, _ in lost), 3),
        "off_s_with": round(sum(b for _, b in lost), 3),
        "better": sum(b < a for a, b in lost),
        "simulated_s": round(sum(b["simulated_s"] for _, b in pairs), 1),
        "fell_or_slid_without": sum(a["verdict"] != "stood" for a, _ in pairs),
        "fell_or_slid_with": sum(b["verdict"] != "stood" for _, b in pairs),
    }
