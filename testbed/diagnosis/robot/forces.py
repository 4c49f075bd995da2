"""The forces' group: the body's six balances and the swinging feet's, with all that a sound machine
leaves in them.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace

import numpy as np
import numpy.typing as npt

from testbed.diagnosis.robot.balance import BODY_ROWS, BodyBalance
from testbed.diagnosis.robot.end_cushions import end_cushions_n
from testbed.diagnosis.robot.evidence import RawGroup
from testbed.diagnosis.robot.force_noise import (
    OF_A_SOUND_MACHINE,
    SHAKEN_SHARE,
    VERTICAL,
    lasting_of,
    noise_of,
)
from testbed.diagnosis.robot.friction import side_coefficient, side_growth
from testbed.diagnosis.robot.motion_noise import oil_force_n, slides_surely
from testbed.diagnosis.robot.tolerances import LATE_S, expected, middle, standard_deviation
from testbed.diagnosis.robot.walking_bias import hangs, lighter, spread_of_walks
from testbed.effects import ALL
from testbed.effects.friction_position import PositionFriction
from testbed.effects.friction_presliding import Presliding
from testbed.effects.friction_pressure import PressureFriction
from testbed.effects.sensor_delay import Delay
from testbed.effects.sensor_line_b import LineB
from testbed.effects.signature import Change, RobotSeen
from testbed.estimation.cylinder import friction_terms
from testbed.machine.groups import Seal
from testbed.machine.model import Axis, Machine
from testbed.machine.names import AXES

Array = npt.NDArray[np.float64]
BODY = "body"
ACCELEROMETER = "sensor.specific_force_bias_m_s2"
HELD_THRUST = 0.8
"""Share of the thrust that stuck vertical cylinders may take up by friction, until they break away
(E).
"""
HELD_ALIKE, HELD_EACH = 2.0, 0.5
"""Stiffness of a stuck seal over that of its oil column, common and each one's own: up to three
(B).
"""
CUSHION_SHARE = 0.2
"""An end cushion brakes as declared to this share (E)."""
SHORT_BEND, TURNS_BEHIND = "share 0", 0.2
"""Share of its dry friction by which any seal turns round over the shortest distance that is tried,
standard deviation (B: seven walks and seven drillings of sound machines are likeliest by 0.2 to
0.4, sways by none).
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
    each += [Tolerated(change, TURNS_BEHIND) for change in turning_behind(balance.seen)]
    if walks(balance):
        spread = spread_of_walks(balance.seen, balance.foot_force, machine.scale)
        each += [Tolerated(change, 1.0, passing=True) for change in spread]
    columns = np.column_stack([rows_of(balance, one.change.times(one.sd)) for one in each])
    passing = np.array([one.passing for one in each])
    return columns[:, ~passing], columns[:, passing]


def turning_behind(seen: RobotSeen) -> Iterator[Change]:
    """By each cylinder, that its friction turns round over SHORT_BEND instead of at once."""
    for axis in AXES:
        yield Presliding().signature(seen, axis)[SHORT_BEND]


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
    yield from _braked(seen, machine)
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


def _braked(seen: RobotSeen, machine: Machine) -> Iterator[Tolerated]:
    """What end cushions brake more or less than is declared."""
    braked = end_cushions_n(seen.extension_m, seen.speed_m_s, seen.stroke_m, machine)
    for i in range(len(AXES)):
        yield Tolerated(Change(force={i: braked[:, i]}), CUSHION_SHARE)


def _held_back(seen: RobotSeen) -> Iterator[Tolerated]:
    """What stuck seals take up of changing loads before they break away: as springs beside the
    oil's, of all alike and of each.
    """
    piston = oil_force_n(seen)
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
