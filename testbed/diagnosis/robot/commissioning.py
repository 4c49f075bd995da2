"""The robot weighs and calibrates itself from what its commissioning programme recorded.

The balances are those of the diagnosis (`balance.py`): six of the body, three of every foot in the
air. All that a machine may differ by within its workshop's tolerances (`forces.tolerated`) is a
number x = mean + sd w with w ~ N(0, 1), and the balances y miss sum x c. What several recordings
say of the same numbers adds up:

    H = 1 + sum C' N^-1 C,   g = sum C' N^-1 y,   w ~ N(H^-1 g, H^-1),   C = columns c times sd

N is the noise of `force_noise.noise_of`, in which a seal at rest may hold any force: only what
slides teaches. On level ground the feet's own plane shows besides how the inertial unit is mounted.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import chain

import numpy as np
import numpy.typing as npt
from scipy.linalg import solve_triangular

from testbed.diagnosis.robot.balance import BodyBalance, OtherSigns, balance_of, hanging
from testbed.diagnosis.robot.bins import Bins, Frame, bins_of, lift_of
from testbed.diagnosis.robot.force_noise import ForceNoise, noise_of
from testbed.diagnosis.robot.forces import Tolerated, rows_of, tolerated
from testbed.diagnosis.robot.hauling import Hauling
from testbed.diagnosis.robot.oil import oil_of
from testbed.diagnosis.robot.supply import supply_of
from testbed.diagnosis.robot.tolerances import chance, standard_deviation
from testbed.effects import by_name
from testbed.effects.friction_load import LoadFriction
from testbed.effects.inertia_mass import AddedMass
from testbed.effects.robot_attitude import Attitude
from testbed.effects.robot_centre_of_mass import CentreOfMass
from testbed.effects.robot_payload import HiddenPayload
from testbed.effects.rope_tension_gain import TensionGain
from testbed.effects.sensor_gain import GainA, GainB
from testbed.effects.sensor_hysteresis import TURNED_PA, Hysteresis, sense_of_reading
from testbed.effects.sensor_linearity import Linearity, bowed
from testbed.effects.sensor_zero import ZeroA, ZeroB
from testbed.effects.signature import Change, RobotSeen
from testbed.estimation.commissioning import Number, Weighed, zero_name
from testbed.machine.groups import Sensor
from testbed.machine.model import Machine
from testbed.machine.names import AXES
from testbed.robot.model import RobotModel
from testbed.robot.robot import Robot

Array = npt.NDArray[np.float64]
BLOCK_S, EVERY = 60.0, 2
"""Noise is taken as independent from block to block; one bin of so many is looked at."""
NOISE = ForceNoise(
    white_n=60.0,
    white_n_m=60.0,
    white_foot_n=60.0,
    sliding_share=0.08,
    memory_s=1.0,
    rest_share=40.0,
    rest_memory_s=1000.0,
    news_share=0.3,
    news_n=20.0,
    alike_share=0.0,
    alike_s=1000.0,
    quick_share=0.02,
    turning_share=0.5,
    turning_alike=0.0,
    turning_s=0.2,
    switched_share=0.0,
)
"""At rest friction is anything, for as long as the rest lasts, and teaches nothing: it is not
without preference, as noise is, but has the sign of the last motion, which the programme repeats at
every leg (E). With a tenth of it the centre of mass comes out 5 mm too low.
"""
LEVEL_SD_RAD = 3.0e-4
"""The ground's own level, and the feet's by their encoders' zeros (E)."""
STILL, CARRIES = 0.1, 0.99
"""A piston stands still below this share of sliding; a foot carries above this share of a bin."""
CHAMBER_PA = 4.0e6
"""About what stands in a chamber under load (E): what gains and bows make of it counts with the
zeros in what is believed."""
UNTOLD = (
    *(HiddenPayload.kind, CentreOfMass.kind, AddedMass.kind, ZeroA.kind, ZeroB.kind),
    *(LoadFriction.kind, Linearity.kind, Hysteresis.kind),
)
"""Effects of which only sums show: the machine's weight, both zeros of a cylinder, what its sensors
bow by and stay behind; friction by the load, which friction by the load across the rod resembles.
"""
CHAMBERS = ("a", "b")
EMPTY_ALIKE_PA, EMPTY_EACH_PA = 0.2e5, 0.15e5
"""Standard deviations of how far below the atmosphere a chamber is whose reading has ended at 0, of
all alike and of each: about what is anywhere between there and a void (E).
"""
GROWING_PA = -0.3e5
"""So much emptier than half a piston sucks it that goes on to slide: gas at a fifth of an
atmosphere (E).
"""
PINS_WIDER = 1.4
"""A load pin is so much less sure than the linear model has it: what feet hold of a rope's pull,
cylinders that stand still hide alike at every pull (E)."""
WEIGHT_WIDER = 1.25
"""So is the weight: the seals of cylinders across the ropes hold some of every push, and hide how
much alike at every load. Of 24 machines it came out 9 kg too light in the mean, for which no cause
is known (E).
"""
TURNS = tuple(f"{Attitude.kind}@body.{name}" for name in ("roll", "pitch"))


@dataclass(frozen=True, eq=False)
class Evidence:
    """What recordings say of a machine's numbers: `precision` (k, k) and `gradient` (k,) of their
    w, in the order of `numbers`.
    """

    numbers: tuple[Tolerated, ...]
    precision: Array
    gradient: Array

    @property
    def names(self) -> tuple[str, ...]:
        """Of the numbers; "" for what is none of the machine's."""
        return tuple(number.name for number in self.numbers)


def evidence_of(data: Mapping[str, Array], robot: Robot, ropes_in_world: Array) -> Evidence:
    """Hold a recording's columns against the drawn robot; `ropes_in_world` (2, 3) as surveyed."""
    bins, balance = _balance(data, robot, ropes_in_world)
    seen, machine = balance.seen, robot.machine
    every = chain(
        tolerated(seen, machine, biased=False),
        _bent(seen, machine),
        _behind(seen, machine),
        _empty(seen, _ended(data)),
    )
    numbers = [one for one in every if one.sd > 0.0]
    columns = np.column_stack([rows_of(balance, one.change) for one in numbers])
    visible = np.any(columns, axis=0)
    numbers = [one for one, seen in zip(numbers, visible, strict=True) if seen]
    columns = columns[:, visible]
    missing = balance.missing[balance.counted] - columns @ np.array([one.mean for one in numbers])
    columns = columns * np.array([one.sd for one in numbers])
    at, _ = np.nonzero(balance.counted)
    precision, gradient = np.zeros((len(numbers),) * 2), np.zeros(len(numbers))
    for block in _blocks(bins):
        noise = noise_of(balance.part(block), NOISE.of_size(robot.machine.scale))
        rows = np.isin(at, block)
        both = np.column_stack([missing[rows], columns[rows]])
        white = solve_triangular(np.linalg.cholesky(noise), both, lower=True)
        precision += white[:, 1:].T @ white[:, 1:]
        gradient += white[:, 1:].T @ white[:, 0]
    return Evidence(tuple(numbers), precision, gradient)


def _bent(seen: RobotSeen, machine: Machine) -> Iterator[Tolerated]:
    """What each transducer's characteristic bows by, each in its own way: nothing in the air, where
    zeros show, and four feet's worth under load, where the weight does.
    """
    for i, k, sensor, pressure_pa in _transducers(seen, machine):
        change = seen.reads(i, k, bowed(pressure_pa, sensor.pressure_range_pa))
        name = _of_transducer(Linearity.kind, AXES[i], "bow", k)
        yield Tolerated(Change(force=change.force), sensor.bow_sd_pa, name)


def _behind(seen: RobotSeen, machine: Machine) -> Iterator[Tolerated]:
    """What each transducer's reading stays behind its pressure: too little of one that has risen,
    too much of one that has fallen. A foot that takes over a load raises chamber A and empties
    chamber B, so all four read too little of the weight, by some 120 N together (B).
    """
    for i, k, sensor, pressure_pa in _transducers(seen, machine):
        change = seen.reads(i, k, -sense_of_reading(pressure_pa, TURNED_PA))
        name = _of_transducer(Hysteresis.kind, AXES[i], "width", k)
        yield Tolerated(
            Change(force=change.force), sensor.loop_sd_pa, name, mean=sensor.loop_mean_pa
        )


def _empty(seen: RobotSeen, ended: Array) -> Iterator[Tolerated]:
    """What the pressures of chambers that are sucked empty are off by. A gauge reads nothing below
    the atmosphere; such a chamber counts as half empty (`replace_clipped`). How empty it is is a
    matter of oil, air and valves, which all have alike, and of its own. One that still grows is
    nearly a void.

    ended: (n, 12, 2) share of the bin in which a reading had ended at 0.
    """
    alike, growing = ({i: np.zeros(seen.bins) for i in range(len(AXES))} for _ in range(2))
    for i in range(len(AXES)):
        for k, way in enumerate((1.0, -1.0)):
            force = seen.reads(i, k, -ended[:, i, k]).force[i]
            alike[i] += force
            growing[i] += np.maximum(way * seen.direction[:, i], 0.0) * force
            yield Tolerated(Change(force={i: force}), EMPTY_EACH_PA, passing=True)
    yield Tolerated(Change(force=alike), EMPTY_ALIKE_PA, passing=True)
    yield Tolerated(Change(force=growing), EMPTY_ALIKE_PA, mean=GROWING_PA, passing=True)


def _ended(data: Mapping[str, Array]) -> Array:
    """(n, 12, 2) share of a bin in which the readings A and B of a cylinder had ended at 0."""
    frame = Frame.of(np.asarray(data["t"], dtype=float))
    shares = [
        [frame.mean((data[f"pressure_{c}_{axis}"] <= 0.0).astype(float)) for c in CHAMBERS]
        for axis in AXES
    ]
    return np.moveaxis(np.array(shares), 2, 0)


def _transducers(seen: RobotSeen, machine: Machine) -> Iterator[tuple[int, int, Sensor, Array]]:
    """Index of the axis and of the chamber (A 0, B 1), its sensor, and what it read (n,), Pa."""
    for i, axis in enumerate(machine.axes.values()):
        for k, pressure_pa in enumerate(seen.pressures_pa(i).T):
            yield i, k, axis.sensor, np.ascontiguousarray(pressure_pa)


def _of_transducer(effect: str, axis: str, number: str, chamber: int) -> str:
    """Name of a number that each of a cylinder's two transducers has for itself."""
    return f"{effect}@{axis}.{number} {CHAMBERS[chamber]}"


def _balance(
    data: Mapping[str, Array], robot: Robot, ropes_in_world: Array
) -> tuple[Bins, BodyBalance]:
    """The balances of a recording."""
    frame = Frame.of(np.asarray(data["t"], dtype=float))
    bins = unbiased(bins_of(data, robot, parted=False))
    oils = oil_of(data, bins, frame, robot)
    none = np.zeros(len(AXES))
    other = OtherSigns(
        oils, supply_of(oils, bins, frame, robot.machine, Hauling.none(bins.count)), none, none
    )
    return bins, balance_of(bins, other, robot, ropes_in_world)


def unbiased(bins: Bins) -> Bins:
    """The same less the accelerometers' biases, which the unit's own attitude shows: however it is
    turned on the body, both of its readings are turned alike.
    """
    off = bins.specific_force - lift_of(bins.attitude_rad)
    still = (np.abs(bins.direction) < STILL).all(axis=1)
    bias = off[still].mean(axis=0) if still.any() else off.mean(axis=0)
    return replace(bins, specific_force=bins.specific_force - bias)


def _blocks(bins: Bins) -> Iterator[npt.NDArray[np.intp]]:
    """Indices of the bins that are looked at, block by block."""
    block = (bins.time_s // BLOCK_S).astype(int)
    looked = np.arange(bins.count) % EVERY == 0
    for one in np.unique(block):
        yield np.flatnonzero(looked & (block == one))


def lifts_every_foot(data: Mapping[str, Array], robot: Robot) -> bool:
    """Whether every foot hangs in the air at some time."""
    lifted = hanging(bins_of(data, robot), robot.machine.scale)
    return bool(lifted.any(axis=0).all())


def levelled(data: Mapping[str, Array], robot: Robot) -> Evidence:
    """How the inertial unit is turned, from the plane of four feet at rest on level ground."""
    bins = bins_of(data, robot, parted=False)
    rests = (np.abs(bins.direction) < STILL).all(axis=1) & (bins.carrying > CARRIES).all(axis=1)
    turned = [_off_level(robot.model, bins, k) for k in np.flatnonzero(rests).tolist()]
    if not turned:
        return Evidence((), np.zeros((0, 0)), np.zeros(0))
    numbers = tuple(Tolerated(Change(), standard_deviation(name), name) for name in TURNS)
    scale = np.array([number.sd for number in numbers]) / LEVEL_SD_RAD
    return Evidence(numbers, np.diag(scale**2), scale / LEVEL_SD_RAD * np.mean(turned, axis=0))


def _off_level(model: RobotModel, bins: Bins, k: int) -> tuple[float, float]:
    """Roll and pitch that the unit shows beyond those of the feet's plane, in bin k."""
    feet, _ = model.feet(bins.joint[k])
    plane = np.column_stack([feet[:, 0], feet[:, 1], np.ones(len(feet))])
    along, across, _ = np.linalg.lstsq(plane, feet[:, 2], rcond=None)[0]
    roll, pitch, _ = bins.attitude_rad[k]
    return roll + math.atan(across), pitch - math.atan(along)


@dataclass(frozen=True, eq=False)
class Posterior:
    """What is known of a machine's numbers after its commissioning: mean (k,) and covariance (k, k)
    of their w.
    """

    numbers: Mapping[str, Tolerated]
    """By name; what is none of the machine's is left out."""
    mean: Mapping[str, float]
    covariance: Array
    place: Mapping[str, int]

    @classmethod
    def of(cls, evidence: Sequence[Evidence]) -> Posterior:
        """What several recordings say together."""
        keys = [_keys(one, k) for k, one in enumerate(evidence)]
        place = {key: i for i, key in enumerate(dict.fromkeys(k for one in keys for k in one))}
        precision, gradient = np.eye(len(place)), np.zeros(len(place))
        for own, one in zip(keys, evidence, strict=True):
            at = np.array([place[key] for key in own], dtype=int)
            precision[np.ix_(at, at)] += one.precision
            gradient[at] += one.gradient
        covariance: Array = np.linalg.inv(precision).astype(np.float64)
        mean = covariance @ gradient
        numbers = {number.name: number for one in evidence for number in one.numbers if number.name}
        return cls(numbers, {n: float(mean[place[n]]) for n in numbers}, covariance, place)

    def of_sum(self, by: Mapping[str, float], unit: str, drawn: float = 0.0) -> Number:
        """The number drawn + sum of by[name] (x - drawn x); names that no recording shows add
        nothing.
        """
        seen = {name: slope for name, slope in by.items() if name in self.numbers}
        value = before = drawn
        weights = np.zeros(len(self.covariance))
        for name, slope in seen.items():
            number = self.numbers[name]
            before += slope * number.per * number.mean
            value += slope * number.per * (number.mean + number.sd * self.mean[name])
            weights[self.place[name]] = slope * number.per * number.sd
        sd = math.sqrt(float(weights @ self.covariance @ weights))
        return Number(value, unit, sd, (before, float(np.linalg.norm(weights))))


def _keys(evidence: Evidence, recording: int) -> list[str]:
    """Names of its numbers; what is none of the machine's is each recording's own."""
    return [number.name or f"{recording} {k}" for k, number in enumerate(evidence.numbers)]


def weighed(evidence: Sequence[Evidence], robot: Robot) -> Weighed:
    """What recordings found of a machine, by the names of `truth_machine.yaml`."""
    known = Posterior.of(evidence)
    numbers = {}
    for name, number in known.numbers.items():
        if name.partition("@")[0] not in UNTOLD and not _is_rare(name):
            numbers[name] = known.of_sum({name: 1.0}, _unit(name, robot.machine), number.drawn)
    for name in numbers:
        if name.startswith(TensionGain.kind):
            numbers[name] = numbers[name].wider(PINS_WIDER)
    zeros = {}
    for axis in AXES:
        numbers[zero_name(axis)] = known.of_sum(_zeros(robot.machine, axis, 0.0), "N")
        zeros[axis] = known.of_sum(_zeros(robot.machine, axis, CHAMBER_PA), "N")
    body = _body(known, robot)
    return Weighed(numbers | body.numbers, body.mass_kg, body.moment_kg_m, zeros)


def _is_rare(name: str) -> bool:
    """Whether most machines do not have it at all."""
    if name.startswith("axes."):
        return False
    effect, _, rest = name.partition("@")
    place, _, number = rest.partition(".")
    return chance(f"{effect}@{'body' if place == 'body' else '*'}.{number}") < 1.0


def _unit(name: str, machine: Machine) -> str:
    if name.startswith("axes."):
        return machine.quantity(name).unit
    effect, _, rest = name.partition("@")
    return by_name(effect).spec(rest.partition(".")[2]).unit


def _zeros(machine: Machine, axis: str, pressure_pa: float) -> dict[str, float]:
    """What the sensors of a cylinder add to its force, by their zeros, and by their gains and bows
    at a pressure.
    """
    area_a, area_b = machine.axes[axis].cylinder.areas_m2
    bent = float(bowed(pressure_pa, machine.axes[axis].sensor.pressure_range_pa))
    return {
        f"{ZeroA.kind}@{axis}.zero": area_a,
        f"{ZeroB.kind}@{axis}.zero": -area_b,
        f"{GainA.kind}@{axis}.gain_error": area_a * pressure_pa,
        f"{GainB.kind}@{axis}.gain_error": -area_b * pressure_pa,
        _of_transducer(Linearity.kind, axis, "bow", 0): area_a * bent,
        _of_transducer(Linearity.kind, axis, "bow", 1): -area_b * bent,
    }


def _body(known: Posterior, robot: Robot) -> Weighed:
    """Total mass and centre of mass, the joints in the middle of their ranges."""
    model, body_kg = robot.model, robot.machine.body.mass_kg
    joints = model.limits.mean(axis=1)
    links = dict(zip(AXES, model.link_centres_m(joints), strict=True))
    masses = {f"{HiddenPayload.kind}@body.mass": 1.0}
    masses |= {f"{AddedMass.kind}@{axis}.mass": 1.0 for axis in AXES}
    total = known.of_sum(masses, "kg", model.total_mass_kg).wider(WEIGHT_WIDER)
    drawn_m, moments, numbers = model.centre_of_mass_m(joints), [], {"total_mass_kg": total}
    for k, way in enumerate("xyz"):
        by = {
            f"{HiddenPayload.kind}@body.mass {way}": 1.0,
            f"{CentreOfMass.kind}@body.{way}": body_kg,
            **{f"{AddedMass.kind}@{axis}.mass": float(at[k]) for axis, at in links.items()},
        }
        moment = known.of_sum(by, "kg m").value
        centre = (model.total_mass_kg * float(drawn_m[k]) + moment) / total.value
        less = {name: centre for name in masses}
        slopes = {n: (by.get(n, 0.0) - less.get(n, 0.0)) / total.value for n in by | less}
        spread = known.of_sum(slopes, "m", float(drawn_m[k]))
        found = Number(centre, "m", spread.sd, spread.before)
        numbers[f"centre_of_mass_{way}_m"] = found
        moments.append(moment)
    return Weighed(numbers, total.value - model.total_mass_kg, np.array(moments), {})
