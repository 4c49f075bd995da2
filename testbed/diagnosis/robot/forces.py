"""The forces' group: the body's six balances and the swinging feet's, with all that a sound machine
leaves in them.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace

import numpy as np
import numpy.typing as npt

from testbed.diagnosis.robot.balance import BodyBalance
from testbed.diagnosis.robot.evidence import RawGroup
from testbed.diagnosis.robot.friction import side_coefficient, side_growth
from testbed.diagnosis.robot.motion_noise import (
    left_by_motions,
    piston_n,
    shaken_n,
    slides_surely,
    swings,
    switched_n,
    taken_by_stops,
    turning_from,
    turns,
)
from testbed.diagnosis.robot.tolerances import LATE_S, expected, middle, standard_deviation
from testbed.diagnosis.robot.walking_bias import hangs, lighter, spread_of_walks
from testbed.effects import ALL
from testbed.effects.friction_position import PositionFriction
from testbed.effects.friction_pressure import PressureFriction
from testbed.effects.sensor_delay import Delay
from testbed.effects.sensor_line_b import LineB
from testbed.effects.signature import Change, RobotSeen
from testbed.estimation.cylinder import friction_terms
from testbed.machine.groups import Seal
from testbed.machine.model import Axis, Machine
from testbed.machine.names import AXES
from testbed.machine.scale import Scale

Array = npt.NDArray[np.float64]
BODY = "body"
ACCELEROMETER = "sensor.specific_force_bias_m_s2"
SHAKEN_SHARE = 0.3
"""A line of more than this share of dry friction turns the piston to and fro."""
SIDE = 0.2
"""Friction by side load that a sound machine may have, share of it."""
BODY_ROWS = 6
VERTICAL = tuple(range(2, len(AXES), 3))
HELD_THRUST = 0.8
"""Share of the thrust that stuck vertical cylinders may take up by friction, until they break away
(E).
"""
LEFT_ALIKE = 0.3
"""Share of dry friction that the seals of all vertical cylinders hold alike while they rest (B:
from 0.1 to 0.5 of sound machines while they drill).
"""
HELD_ALIKE, HELD_EACH = 2.0, 0.5
"""Stiffness of a stuck seal over that of its oil column, common and each one's own: up to three
(B).
"""
HAMMER_SHARE = 0.04
PHASE_HOLDS_S = 3.5
"""For so long a line's phase may count as one (E)."""


@dataclass(frozen=True)
class ForceNoise:
    """What the forces of a sound machine miss beside its tolerances; shares are of dry friction."""

    white_n: float
    """A bin's noise of its own: sensors, accelerations, the bins' edges; and as much that lasts as
    long as `memory_s`.
    """
    white_n_m: float
    white_foot_n: float
    sliding_share: float
    """Friction while sliding beyond its tolerances, for `memory_s`."""
    memory_s: float
    rest_share: float
    """Friction at rest, for `rest_memory_s` or until the load has changed by `news_share`."""
    rest_memory_s: float
    news_share: float
    news_n: float
    """At rest a change of the load below this is noise."""
    alike_share: float
    """Friction at rest as the body's last motions along and about each axis left it, alike at all
    feet, for `alike_s`.
    """
    alike_s: float
    quick_share: float
    """Friction anew in each bin."""
    turning_share: float
    """A piston that turns round: the seal is somewhere on its way from one sense to the other."""
    turning_alike: float
    """Share of that variance which pistons that turn at once have alike, for `turning_s`: one
    motion of the body turns them.
    """
    turning_s: float
    switched_share: float
    """Share of the change where a load changes from one bin to the next."""
    shaken_share: float = 0.0
    """Share of what a piston's force swings to and fro by from bin to bin: its seal turns round
    within the bin, too. Above 0 stuck seals take up what the machine's shaking asks for.
    """

    def of_size(self, scale: Scale) -> ForceNoise:
        """The same for a machine of another size; these numbers are ROBOCLIMBER's."""
        newton, newton_metre = scale.times("N"), scale.times("N m")
        return replace(
            self,
            white_n=newton * self.white_n,
            white_n_m=newton_metre * self.white_n_m,
            white_foot_n=newton * self.white_foot_n,
            news_n=newton * self.news_n,
        )


OF_A_SOUND_MACHINE = ForceNoise(
    white_n=50.0,
    white_n_m=50.0,
    white_foot_n=60.0,
    sliding_share=0.08,
    memory_s=1.0,
    rest_share=0.5,
    rest_memory_s=120.0,
    news_share=3.0,
    news_n=20.0,
    alike_share=0.1,
    alike_s=100.0,
    quick_share=0.02,
    turning_share=0.5,
    turning_alike=0.6,
    turning_s=0.2,
    switched_share=0.03,
    shaken_share=0.25,
)
"""At rest the numbers under which the balances of 21 drawn sound machines are about likeliest;
while sliding wider than that: some machines slide far less evenly than most.
"""


def rows_of(balance: BodyBalance, change: Change) -> Array:
    """One column of the group: what `change` does to its counted rows."""
    out = np.zeros_like(balance.missing)
    for axis, force in change.force.items():
        out += balance.by_force[:, :, axis] * force[:, None]
    if change.wrench is not None:
        out[:, :6] += change.wrench
    if change.balance is not None:
        out += change.balance
    return np.asarray(out[balance.counted])


def tolerance_columns(balance: BodyBalance, machine: Machine) -> tuple[Array, Array]:
    """(rows, k), (rows, m): tolerances by a standard deviation, of machine and of recording."""
    each = [one for one in tolerated(balance.seen, machine) if one.sd > 0.0]
    if walks(balance):
        spread = spread_of_walks(balance.seen, balance.foot_force, machine.scale)
        each += [Tolerated(change, 1.0, passing=True) for change in spread]
    columns = np.column_stack([rows_of(balance, one.change.times(one.sd)) for one in each])
    passing = np.array([one.passing for one in each])
    return columns[:, ~passing], columns[:, passing]


def walks(balance: BodyBalance) -> bool:
    """Whether feet are lifted in it."""
    return bool(balance.counted[:, BODY_ROWS:].any())


@dataclass(frozen=True, eq=False)
class Tolerated:
    """A number by which a sound machine differs from its drawing.

    With the number x = mean + sd w, w ~ N(0, 1), the balances miss x `change`, and the machine has
    drawn + per x where it is said to have `drawn`.
    """

    change: Change
    sd: float
    name: str = ""
    """As `truth_machine.yaml` has it; "": it is none of the machine's numbers."""
    mean: float = 0.0
    drawn: float = 0.0
    per: float = 1.0
    passing: bool = False
    """Of one recording alone: in another one of the machine the number is another."""


def tolerated(seen: RobotSeen, machine: Machine, biased: bool = True) -> Iterator[Tolerated]:
    """All that a sound machine may differ by in its forces; `biased`: its accelerometers too."""
    for effect in ALL:
        for place in effect.places_on_robot:
            star = place if place == BODY else "*"
            for number, change in effect.signature(seen, place).items():
                parts = number.split(" ")  # a first moment is a mass times a place
                names = [f"{effect.kind}@{star}.{part}" for part in parts]
                sds = [standard_deviation(name, scale=machine.scale) for name in names]
                sd = float(np.prod(sds))
                yield Tolerated(change, sd, f"{effect.kind}@{place}.{number}")
    for i, axis in enumerate(machine.axes.values()):
        yield from _friction(seen, i, axis, machine.seal)
        yield _bored(seen, i, axis)
    for k in range(3) if biased else ():  # the accelerometers' biases weigh the whole machine
        bias = seen.weighs(seen.asked_by_gravity[:, :, k])
        yield Tolerated(bias, standard_deviation(ACCELEROMETER, scale=machine.scale))
    yield from _held_back(seen)
    warm = float(np.mean(seen.oil_degc)) - machine.sensor.calibration_temperature_degc
    s = machine.sensor
    thermal = s.thermal_zero_share * s.pressure_range_pa / s.thermal_range_k / np.sqrt(3.0)
    for i in range(len(AXES)):
        for area in (seen.area_a_m2[i], seen.area_b_m2[i]):
            yield Tolerated(
                Change(force={i: np.ones(seen.bins)}),
                abs(float(thermal * warm * area)),
                passing=True,
            )


def _held_back(seen: RobotSeen) -> Iterator[Tolerated]:
    """What stuck seals take up of changing loads before they break away: as springs beside the
    oil's, of all alike and of each.
    """
    piston = piston_n(seen)
    at_rest = 1.0 - slides_surely(seen.direction)
    stuck = at_rest * (piston - piston.mean(axis=0))
    yield Tolerated(
        Change(force={i: stuck[:, i] for i in range(len(AXES))}), HELD_ALIKE, passing=True
    )
    for i in range(len(AXES)):
        yield Tolerated(Change(force={i: stuck[:, i]}), HELD_EACH, passing=True)
    pushed = {i: at_rest[:, i] * seen.thrust_n / len(VERTICAL) for i in VERTICAL}
    yield Tolerated(Change(force=pushed), HELD_THRUST, passing=True)


def _bored(seen: RobotSeen, i: int, axis: Axis) -> Tolerated:
    """A bore that is wider by a share has twice that share more of piston on either side."""
    number, bore_m = "cylinder.bore_m", axis.cylinder.bore_m
    sd = standard_deviation(f"axes.*.{number}", bore_m) / bore_m
    mean = middle(f"axes.*.{number}", bore_m) / bore_m - 1.0
    push = 2.0 * seen.area_a_m2[i] * (seen.pressure_a_pa - seen.pressure_b_pa)[:, i]
    change = Change(force={i: -push})
    return Tolerated(change, sd, f"axes.{axis.name}.{number}", mean, bore_m, bore_m)


def _friction(seen: RobotSeen, i: int, axis: Axis, drawing: Seal) -> Iterator[Tolerated]:
    """What seals scatter by; these tolerances are shares of the drawing's numbers, about what was
    told of this seal.
    """
    c, seal, own = axis.cylinder, axis.seal, f"axes.{axis.name}"
    for sense, way in (("out", 1.0), ("in", -1.0)):
        now = np.maximum(way * seen.direction[:, i], 0.0) * way
        speed = np.abs(seen.speed_m_s[:, i])
        fading = friction_terms(speed, getattr(c, f"stribeck_{sense}_m_s"))[..., 2]
        for kind, course in (("coulomb", now), ("static", now * fading)):
            size, number = getattr(c, f"{kind}_{sense}_n"), f"cylinder.{kind}_{sense}_n"
            sd = standard_deviation(f"axes.*.{number}", size)
            yield Tolerated(Change(force={i: course}), sd, f"{own}.{number}", drawn=size)
        number = f"cylinder.viscous_{sense}_n_s_m"
        viscous = getattr(c, f"viscous_{sense}_n_s_m")
        share = standard_deviation(f"axes.*.{number}", viscous) / viscous
        flows = np.where(way * seen.speed_m_s[:, i] > 0, seen.viscous_n[:, i], 0)
        change = Change(force={i: flows})
        yield Tolerated(change, share, f"{own}.{number}", drawn=viscous, per=viscous)
    if seen.line_n[i] > SHAKEN_SHARE * np.median(seen.coulomb_n[:, i]):
        shaken = Change(force={i: seen.direction[:, i] * seen.coulomb_n[:, i]})
        yield Tolerated(shaken, 1.0, passing=True)
    number, drawn = "seal.side_load_coefficient", seal.side_load_coefficient
    centre = side_coefficient(axis, drawing)
    side = float(np.hypot(standard_deviation(f"axes.*.{number}", drawn), 0.3 * (centre - drawn)))
    grown = side_growth(axis, seen.extension_m[:, i], seen.stroke_m[i])
    change = Change(force={i: seen.direction[:, i] * seen.side_load_n[:, i] * grown})
    yield Tolerated(change, side, f"{own}.{number}", drawn=centre)
    yield Tolerated(Delay().made(seen, axis.name, {"delay": LATE_S}), 1.0)
    (change,) = LineB().signature(seen, axis.name).values()
    yield Tolerated(change, LATE_S)
    for effect, name in (
        (PositionFriction(), "position_slope"),
        (PressureFriction(), "pressure_coefficient_m2"),
    ):
        number, declared = f"axes.*.seal.{name}", getattr(seal, name)
        (change,) = effect.signature(seen, axis.name).values()
        mean = expected(number, declared, getattr(drawing, name)) - declared
        sd = standard_deviation(number, declared)
        yield Tolerated(change, sd, f"{own}.seal.{name}", mean, declared)


def group_of(balance: BodyBalance, machine: Machine) -> RawGroup:
    """The group of a measured robot."""
    bins, _ = np.nonzero(balance.counted)
    known = OF_A_SOUND_MACHINE.of_size(machine.scale)
    tolerances, passing = tolerance_columns(balance, machine)
    lasting = lasting_of(balance, known) + passing @ passing.T
    missing = balance.missing[balance.counted]
    if walks(balance) and hangs(balance.seen, balance.foot_force):
        missing = missing - rows_of(balance, lighter(balance.seen, machine.scale))
    return RawGroup(
        missing=missing,
        time_s=balance.seen.time_s[bins],
        noise=noise_of(balance, replace(known, rest_share=0.0, alike_share=0.0)) + lasting,
        lasting=lasting,
        tolerated=tolerances,
        rows_of=lambda change: rows_of(balance, change),
    )


def lasting_of(balance: BodyBalance, known: ForceNoise) -> Array:
    """The part of the noise that stuck seals hold: see noise_of."""
    seen, (bins, rows) = balance.seen, np.nonzero(balance.counted)
    share = slides_surely(seen.direction)
    dry = seen.coulomb_n + SIDE * seen.side_load_n
    age = friction_age(seen, share, dry, known)[bins]
    stuck = balance.by_force[bins, rows] * ((1.0 - share) * dry)[bins]
    out = np.zeros((len(rows), len(rows)))
    each = list(zip(age.T, known.rest_share * stuck.T, strict=True))
    alike = (age[:, VERTICAL].mean(axis=1), LEFT_ALIKE * stuck[:, VERTICAL].sum(axis=1))
    for since, held in [*each, alike]:
        out += np.exp(-np.abs(since[:, None] - since[None, :])) * np.outer(held, held)
    return out + _held_alike(seen, bins, known.alike_share * stuck, known.alike_s)


def _held_alike(seen: RobotSeen, bins: npt.NDArray[np.intp], stuck: Array, for_s: float) -> Array:
    """Covariance (rows, rows) of friction at rest that the body's last motions left at all feet;
    `stuck`: (rows, 12) what a row misses by it.
    """
    left = np.einsum("ri,rim->rm", stuck, left_by_motions(seen)[bins])
    time = seen.time_s[bins]
    return np.asarray(np.exp(-np.abs(time[:, None] - time[None, :]) / for_s) * (left @ left.T))


def noise_of(balance: BodyBalance, known: ForceNoise) -> Array:
    """Covariance of the group's rows (rows, rows) beside what tolerances make."""
    seen, counted = balance.seen, balance.counted
    bins, rows = np.nonzero(counted)
    apart = np.abs(seen.time_s[bins][:, None] - seen.time_s[bins][None, :])
    white = np.where(
        rows < 3, known.white_n, np.where(rows < 6, known.white_n_m, known.white_foot_n)
    )
    same_row = rows[:, None] == rows[None, :]
    out = np.diag(white**2)
    out += np.where(same_row, np.exp(-apart / known.memory_s), 0.0) * np.outer(white, white)
    blows = HAMMER_SHARE * np.abs(seen.thrust_n)[bins] * (rows == 2)
    out += np.diag(blows**2)
    share = slides_surely(seen.direction)
    dry = seen.coulomb_n + SIDE * seen.side_load_n
    spread = (known.sliding_share * share + known.rest_share * (1.0 - share)) * dry
    shaken = seen.line_n > SHAKEN_SHARE * dry  # a piston that is shaken has friction of both senses
    spread = np.hypot(spread, seen.line_n + dry * shaken)
    alone = known.turning_share * np.sqrt(1.0 - known.turning_alike)
    anew = np.hypot(alone * turns(seen.direction), known.quick_share) * dry
    anew = np.hypot(anew, known.switched_share * switched_n(seen))
    if known.shaken_share > 0.0:
        to_and_fro = known.shaken_share * swings(piston_n(seen))
        held = (1.0 - share) * shaken_n(seen)  # a stuck seal takes up what shakes
        anew = np.hypot(anew, np.minimum(np.hypot(to_and_fro, held), dry))
    anew = np.hypot(anew, taken_by_stops(seen))
    age = friction_age(seen, share, dry, known)
    by_axis = balance.by_force[bins, rows]
    for axis in range(len(AXES)):
        by = by_axis[:, axis]
        lasting, fresh = by * spread[bins, axis], by * anew[bins, axis]
        since = age[bins, axis]
        out += np.exp(-np.abs(since[:, None] - since[None, :])) * np.outer(lasting, lasting)
        out += (apart == 0.0) * np.outer(fresh, fresh)
        if seen.line_n[axis] > 0.0:
            out += swung(seen, axis, by, apart)
    behind = known.turning_share * turning_from(seen.direction) * dry
    alike = np.sqrt(known.turning_alike) * np.einsum("ra,ra->r", by_axis, behind[bins])
    out += np.exp(-apart / known.turning_s) * np.outer(alike, alike)
    if known.alike_share > 0.0:
        held = by_axis * (known.alike_share * (1.0 - share) * dry)[bins]
        out += _held_alike(seen, bins, held, known.alike_s)
    return np.asarray(out)


def swung(seen: RobotSeen, axis: int, by: Array, apart: Array) -> Array:
    """Covariance (rows, rows) of what a line of a piston's force leaves in bins that are not long
    beside its period; `by` (rows,) by that force, `apart` (rows, rows) s.
    """
    frequency = seen.line_hz[axis]
    left = by * seen.line_n[axis] * np.sinc(frequency * (seen.time_s[1] - seen.time_s[0]))
    turned = np.cos(2.0 * np.pi * frequency * apart) * np.exp(-apart / PHASE_HOLDS_S)
    return np.asarray(0.5 * turned * np.outer(left, left))


def friction_age(seen: RobotSeen, share: Array, dry: Array, known: ForceNoise) -> Array:
    """(n, 12) how much friction's deviation has been renewed, in memories: by time, and at rest by
    changing loads, of which a stuck seal takes up its part.
    """
    piston = piston_n(seen)
    step = float(seen.time_s[1] - seen.time_s[0])
    changed = np.abs(np.diff(piston, axis=0, prepend=piston[:1]))
    outside = np.column_stack([seen.thrust_n, seen.tension_n])
    changed = changed + 0.25 * np.abs(np.diff(outside, axis=0, prepend=outside[:1])).sum(
        axis=1, keepdims=True
    )
    news = np.maximum(changed - known.news_n, 0.0) / (known.news_share * dry)
    resting = (1.0 - share) * (step / known.rest_memory_s + news)
    return np.asarray(np.cumsum(share * step / known.memory_s + resting, axis=0))
