"""All balances of a recording, divided by their noise: what every hypothesis is held against.

Groups: `forces` (the body's six balances and the swinging feet's), `oil <axis>` (two chambers),
`feet` (places of standing feet), `supply` and, where they show, `ropes`; beside an earlier
recording `ground` (how steep it seems). Groups are taken as independent of each other.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace

import numpy as np
import numpy.typing as npt

from testbed.diagnosis.robot import (
    feet,
    forces,
    ground,
    oil_evidence,
    prior_transfer,
)
from testbed.diagnosis.robot.alike_numbers import told_by_others
from testbed.diagnosis.robot.balance import BodyBalance, OtherSigns, balance_of
from testbed.diagnosis.robot.bins import Bins, Frame, bins_of
from testbed.diagnosis.robot.evidence import RawGroup, Whitened
from testbed.diagnosis.robot.hauling import hauling_of
from testbed.diagnosis.robot.oil import oil_of
from testbed.diagnosis.robot.rope_stiffness import held_ropes
from testbed.diagnosis.robot.spectral_lines import lines_of
from testbed.diagnosis.robot.supply import supply_of
from testbed.diagnosis.robot.unexplained import ALL_UNEXPLAINED
from testbed.effects import ALL
from testbed.effects.base import Effect
from testbed.effects.signature import Course, RobotSeen, Signature
from testbed.machine.names import AXES
from testbed.machine.scale import ROBOCLIMBER, Scale
from testbed.robot.robot import Robot

Array = npt.NDArray[np.float64]
FORCES, FEET, SUPPLY, OIL, LINE = "forces", "feet", "supply", "oil", "line"
ROPES, GROUND = "ropes", "ground"
MOST_NUMBERS = 4
"""An effect with more numbers has a course in time."""


@dataclass(frozen=True, eq=False)
class Candidate:
    """An effect at a place, with what the measured balances would miss by it."""

    effect: Effect
    place: str
    signature: Signature
    scale: Scale = ROBOCLIMBER
    """Of the machine: how large its numbers may be expected to be."""
    courses: tuple[Course, ...] = ()
    """Signatures of which it may have any (courses.py)."""
    price: float = 0.0
    """What its evidence is less for having taken one of them."""

    @property
    def name(self) -> str:
        """`sensor.gain_a@fl_vertical`."""
        return f"{self.effect.kind}@{self.place}"

    @property
    def is_course(self) -> bool:
        """Whether its numbers are those of a course in time, which another recording does not
        share.
        """
        return len(self.signature) > MOST_NUMBERS or self.effect.band_amplitude is not None

    @property
    def spreads(self) -> Array:
        """Prior standard deviations of its numbers."""
        effect, scale = self.effect, self.scale
        return np.array([effect.spread(k) * effect.grows(k, scale) for k in self.signature])

    @property
    def least(self) -> Array:
        """Below which its numbers cannot lie; -inf: they may be any."""
        effect, scale = self.effect, self.scale
        return np.array([effect.least(k) * effect.grows(k, scale) for k in self.signature])


@dataclass(frozen=True, eq=False)
class Balances:
    """A recording's balances: `raw` and `groups` (divided by their noise) by group, `candidates` by
    name.
    """

    bins: Bins
    body: BodyBalance
    raw: Mapping[str, RawGroup]
    groups: Mapping[str, Whitened]
    candidates: Mapping[str, Candidate]
    others: tuple[BodyBalance, ...] = ()
    """Of several recordings together, the body's of those after the first."""
    recordings: tuple[Balances, ...] = ()
    """Those recordings, each by itself."""
    sound: Mapping[str, RawGroup] = field(default_factory=dict)
    """Those of an earlier recording of the same machine, where they are held beside one."""

    @property
    def bodies(self) -> tuple[BodyBalance, ...]:
        """The body's of each recording."""
        return (self.body, *self.others)

    def not_recalled(self) -> dict[str, int]:
        """Group -> how many numbers of the machine the earlier recording shows beyond what any
        workshop leaves; those without are left out.
        """
        counts = {key: group.not_recalled for key, group in self.sound.items()}
        return {key: count for key, count in counts.items() if count}


def balances_of(
    data: Mapping[str, Array],
    robot: Robot,
    ropes_in_world: Array,
    granted: Mapping[str, Mapping[str, float]],
    sound: Mapping[str, RawGroup] | None = None,
    beside: Mapping[int, Array] | None = None,
) -> Balances:
    """Measure a recording's columns against the believed robot; `ropes_in_world` (2, 3) as
    surveyed. `granted`: effect at its place -> parameters that are believed already, beside the
    robot's numbers. `sound`: `raw_groups` of an earlier recording of the same machine, when
    nothing was wrong with it. `beside`: see balance.balance_of.
    """
    bins, body, raw = raw_groups(data, robot, ropes_in_world, beside)
    found = {c.name: c for c in _candidates(body, robot.machine.scale)}
    raw = {key: _without(group, granted, found) for key, group in raw.items()}
    known = told_by_others(sound or {})
    raw = _beside(raw, known) if known else _of_one_oil(raw)
    signatures = {name: candidate.signature for name, candidate in found.items()}
    groups = {key: group.whitened(signatures) for key, group in raw.items()}
    return Balances(bins, body, raw, groups, found, sound=known)


def raw_groups(
    data: Mapping[str, Array],
    robot: Robot,
    ropes_in_world: Array,
    beside: Mapping[int, Array] | None = None,
) -> tuple[Bins, BodyBalance, dict[str, RawGroup]]:
    """The groups of a recording in their own units, with the bins and the body's balance that they
    are made of; `beside`: see balance.balance_of.
    """
    machine = robot.machine
    frame, bins = Frame.of(np.asarray(data["t"], dtype=float)), bins_of(data, robot)
    oils = oil_of(data, bins, frame, robot)
    supply = supply_of(oils, bins, frame, machine, hauling_of(bins, robot, ropes_in_world))
    lines = lines_of(data, machine)
    other = OtherSigns(
        oils,
        supply,
        np.array([line.frequency_hz for line in lines]),
        np.array([line.amplitude_n for line in lines]),
        held_ropes(bins, robot, ropes_in_world),
    )
    body = balance_of(bins, other, robot, ropes_in_world, beside)
    raw = {FORCES: forces.group_of(body, machine)}
    standing = feet.group_of(body, bins, machine.scale)
    if standing is not None:
        raw[FEET] = standing
    raw[SUPPLY] = supply.group(bins.time_s)
    if other.ropes.shown:
        raw[ROPES] = other.ropes.group()
    stood = ground.group_of(body, bins, ropes_in_world)
    if stood is not None:
        raw[GROUND] = stood
    for i in range(len(AXES)):
        raw[f"{OIL} {AXES[i]}"] = oil_evidence.group_of(oils[i], i, machine, bins.time_s)
        raw[f"{LINE} {AXES[i]}"] = lines[i].group(i, machine.scale)
    return bins, body, raw


def _candidates(body: BodyBalance, scale: Scale) -> list[Candidate]:
    """Every effect at every place that these balances could show."""
    placed = (
        (effect, place) for effect in (*ALL, *ALL_UNEXPLAINED) for place in effect.places_on_robot
    )
    found = (_candidate(effect, place, body.seen, scale) for effect, place in placed)
    return [candidate for candidate in found if candidate.signature]


def _candidate(effect: Effect, place: str, seen: RobotSeen, scale: Scale) -> Candidate:
    """An effect at a place, by the first of its courses."""
    courses = effect.courses(seen, place)
    return Candidate(effect, place, courses[0].signature, scale, courses)


def _beside(raw: Mapping[str, RawGroup], sound: Mapping[str, RawGroup]) -> dict[str, RawGroup]:
    """The groups with what those of an earlier recording leave of them; the ground's where that is
    from the same place alone.
    """
    elsewhere = not ground.is_same_place(raw.get(GROUND), sound.get(GROUND))
    kept = {k: group for k, group in raw.items() if k != GROUND or not elsewhere}
    share = prior_transfer.shares({k: g for k, g in kept.items() if k.startswith(OIL)}, sound)
    return {k: g.knowing(sound[k], share.get(k)) if k in sound else g for k, g in kept.items()}


def _of_one_oil(raw: Mapping[str, RawGroup]) -> dict[str, RawGroup]:
    """The groups, each about what the others show of the oil."""
    return {key: group.about_what_is_told() for key, group in told_by_others(raw).items()}


def _without(
    group: RawGroup,
    granted: Mapping[str, Mapping[str, float]],
    candidates: Mapping[str, Candidate],
) -> RawGroup:
    """The group less what effects make that are believed already."""
    missing = group.missing
    for name, values in granted.items():
        candidate = candidates.get(name)
        if candidate is None:
            continue
        linear = candidate.effect.to_linear(values)
        for number, change in candidate.signature.items():
            missing = missing - linear.get(number, 0.0) * group.rows_of(change)
    return replace(group, missing=missing)
