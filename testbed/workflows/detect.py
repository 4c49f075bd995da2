"""`testbed detect`: the contact state of every foot of a recording as a table, and how well it
follows a reference.
"""

from __future__ import annotations

from dataclasses import dataclass, fields
from pathlib import Path
from typing import Any

import numpy as np

from testbed.errors import InputError
from testbed.estimation.contact_losses import (
    LOSS_S,
    LOSS_SHARE,
    ContactScore,
    LossRule,
    intervals,
    score_contact,
)
from testbed.estimation.detectors import foot_scale as scales
from testbed.estimation.detectors.single_force import MOST_SPREAD, SingleForce
from testbed.formats.arrays import Array, Flags
from testbed.formats.records import SET
from testbed.report.page import significant
from testbed.workflows.own_files import check_answer
from testbed.workflows.recorded_feet import RecordedFeet, carrying_of, read_feet

MOST_LOSS_S = 10.0
LEAST = 1e-3
"""So much of the time a force may be below the lower end of its interval: lone samples may lie (E).
"""


@dataclass(frozen=True)
class FootScale:
    """The scale of one foot, and where it comes from, in words."""

    nominal_load_n: float
    nominal_load_from: str
    breakaway_n: float
    breakaway_from: str


@dataclass(frozen=True)
class Options:
    """What a user may choose: see `testbed detect --help`."""

    detector: str | None = None
    force: str | None = None
    reference: str | None = None
    model: Path | None = None
    scale_n: float | None = None
    loss_share: float = LOSS_SHARE
    loss_s: float = LOSS_S

    def rule(self, nominal_load_n: float) -> LossRule:
        """What a loss is, of a foot with this nominal load."""
        return LossRule(nominal_load_n, self.loss_share, self.loss_s)


def scale_options(text: str | None) -> dict[str, float]:
    """`--scale N` or `--scale N,SHARE,SECONDS` as Options have it. Raises InputError for anything
    else.
    """
    if text is None:
        return {}
    names = ("scale_n", "loss_share", "loss_s")
    parts = text.split(",")
    try:
        found = dict(zip(names, map(float, parts), strict=len(parts) != 1))
    except ValueError:
        found = {}
    rule = found | {"loss_share": found.get("loss_share", LOSS_SHARE)}
    possible = 0.0 < rule.get("scale_n", 0.0) < np.inf and 0.0 < rule["loss_share"] < 1.0
    if not possible or not 0.0 <= rule.get("loss_s", LOSS_S) <= MOST_LOSS_S:
        allowed = f"N or N,SHARE,SECONDS: more than 0 N, a share below 1, up to {MOST_LOSS_S:g} s"
        raise InputError("is out of range", field="--scale", value=text, allowed=allowed)
    return found


def detect_file(recording: str | Path, out: str | Path, options: Options) -> dict[str, Any]:
    """Judge every foot of a recording and write `t`, `contact_<foot>` and `known_<foot>`, one row a
    sample.

    Returns what was found: `feet` (foot -> what was called lost, and its score where there is a
    reference), `scale`, and where all of it comes from. Raises InputError for what cannot be used;
    then nothing is written.
    """
    from testbed.formats.table import write_columns

    feet = read_feet(recording, options.force, options.reference, options.model)
    file = check_answer(out, (".parquet", ".csv"))
    scale = {foot: _scale(feet, foot, options.scale_n) for foot in feet.force_n}
    name, states, known = _judged(feet, scale, options)
    columns: dict[str, Array] = {"t": feet.time_s}
    for index, foot in enumerate(feet.force_n):
        columns[f"contact_{foot}"] = states[:, index]
    for index, foot in enumerate(feet.force_n):
        columns[f"known_{foot}"] = known[:, index].astype(np.float64)
    found = {
        foot: _found(feet, foot, states[:, k], options.rule(scale[foot].nominal_load_n))
        for k, foot in enumerate(feet.force_n)
    }
    write_columns(file, columns)
    return {
        "feet": found,
        "detector": name,
        "force": feet.force_from,
        "reference": feet.reference_from,
        "loss": {"share_of_nominal_load": options.loss_share, "time_s": options.loss_s},
        "scale": {foot: vars(s) for foot, s in scale.items()},
        "rows": len(feet.time_s),
        "columns": list(columns),
        "out": str(file),
    }


def _scale(feet: RecordedFeet, foot: str, given_n: float | None) -> FootScale:
    """What the states of a foot are judged by. A force that stays below what friction hides is that
    of a foot in the air, for all that can be seen: its own size would be a scale of errors.
    """
    force = feet.force_n[foot]
    if given_n is not None:
        nominal, nominal_from = given_n, "--scale"
    elif feet.nominal_load_n is not None:
        nominal, nominal_from = feet.nominal_load_n, feet.nominal_load_from
    else:
        nominal, nominal_from = scales.nominal_load_n(force), "estimated from the force"
        if feet.breakaway_n is not None and nominal < feet.breakaway_n:
            nominal = feet.breakaway_n / MOST_SPREAD
            nominal_from = "from the break-away force, which hides all there is"
    if feet.breakaway_n is not None:
        return FootScale(nominal, nominal_from, feet.breakaway_n, "declared")
    assumed = scales.assumed_breakaway_n(force, feet.time_s, nominal)
    noisy = assumed > scales.ASSUMED_SHARE * nominal
    source = "the noise at rest" if noisy else f"assumed, {scales.ASSUMED_SHARE:g} of that"
    return FootScale(nominal, nominal_from, assumed, source)


def _judged(
    feet: RecordedFeet, scale: dict[str, FootScale], options: Options
) -> tuple[str, Array, Flags]:
    """The detector's name, contact states and whether they are known, (n, k)."""
    from testbed.estimation.detectors.table import BEST, LIVE
    from testbed.estimation.live.selected import SelectedDetector
    from testbed.estimation.live.stream import Feet, force_detector

    if feet.robot is not None and options.detector != SingleForce.name:
        name = options.detector or BEST
        rows = feet.robot.rows
        if name != LIVE:  # the chain has judged by that one already
            SelectedDetector(name, feet.robot.belief, "--detector").fill(rows)
        states = rows["contact"].astype(np.float64)
        return name, states, np.ones(states.shape, dtype=bool)
    name = options.detector or SingleForce.name
    judge = Feet(
        force_detector(name, options.loss_share),
        np.array([s.nominal_load_n for s in scale.values()]),
        np.array([s.breakaway_n for s in scale.values()]),
    )
    return name, *judge.over(feet.time_s, np.column_stack(list(feet.force_n.values())))


def _found(feet: RecordedFeet, foot: str, states: Array, rule: LossRule) -> dict[str, Any]:
    """What was called lost, the least force, and the score against the reference: nothing but None
    where there is none.
    """
    called = intervals(states < SET, feet.time_s)
    least_n = float(np.nanquantile(feet.force_n[foot], LEAST))
    found: dict[str, Any] = {
        "called_lost": len(called),
        "called_lost_share": float(np.mean(states < SET)),
        "least_share_of_nominal_load": least_n / rule.nominal_load_n,
    }
    if foot not in feet.reference:
        return dict.fromkeys((part.name for part in fields(ContactScore)), None) | found
    carrying = carrying_of(feet.reference[foot], feet.time_s, rule, feet.folder)
    return score_contact(states, carrying, feet.time_s).as_dict() | found


def table(done: dict[str, Any]) -> tuple[str, list[str], list[list[str]]]:
    """Title, heads and rows for a person."""
    title = f"Contact by {done['detector']} from {done['force']}"
    heads = [
        "foot",
        "nominal load N",
        "break-away N",
        "called lost",
        "share of time",
        "least force, of nominal",
    ]
    scored = done["reference"] is not None
    if scored:
        title += f", against {done['reference']}"
        heads += [
            "losses",
            "missed",
            "false alarms",
            "delay ms",
            "p95",
            "touchdown ms",
            "missed s",
            "false flight s",
        ]
    rows = []
    for foot, found in done["feet"].items():
        scale = done["scale"][foot]
        row = [
            foot,
            f"{significant(scale['nominal_load_n'])} ({scale['nominal_load_from']})",
            f"{significant(scale['breakaway_n'], 3)} ({scale['breakaway_from']})",
            str(found["called_lost"]),
            f"{found['called_lost_share']:.3f}",
            f"{found['least_share_of_nominal_load']:.2f}",
        ]
        if scored:
            row += _scored(found)
        rows.append(row)
    return title, heads, rows


def _scored(found: dict[str, Any]) -> list[str]:
    def milliseconds(name: str) -> str:
        return "" if found.get(name) is None else f"{1e3 * found[name]:.1f}"

    if found.get("losses") is None:
        return [""] * 8
    return [
        str(found["losses"]),
        str(found["missed"]),
        str(found["false_alarms"]),
        milliseconds("delay_median_s"),
        milliseconds("delay_p95_s"),
        milliseconds("touchdown_delay_median_s"),
        f"{found['missed_s']:.3f}",
        f"{found['false_flight_s']:.3f}",
    ]
