"""A recording of the whole robot in bins of a tenth of a second: what its sensors read, and how its
pistons moved.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from testbed.diagnosis.robot.body_vibration import of_lifted_feet, over_standing_feet, quick
from testbed.estimation.cylinder import replace_clipped
from testbed.machine.names import AXES, LEGS, SIDES
from testbed.recording.rows import XYZ
from testbed.robot.model import attitude_gravity
from testbed.robot.robot import Robot

Array = npt.NDArray[np.float64]
BIN_S = 0.1
EDGE_S = 0.02
"""An encoder's reading at the edge of a bin is the mean of this long: a tenth of a count is left of
its steps.
"""
BESIDE_S = 0.025
"""Speed at an edge is the way from so long before it to so long after it: of a leg that rocks at
5 Hz on its oil nine tenths (B).
"""
PART_S = 0.02
"""In so long a part of a bin a piston slides or stands."""
SLIDES_ON_S = 0.08
"""A piston whose encoder goes on the same way within so long has not come to rest."""
SETTLING_S = 0.6
"""The start's transients are left out."""
SLIDE_S = 0.25
"""A slide goes at least as far as a piston that hardly rests goes in so long (E)."""
REST_M_S, SLIDE_M_S = 0.0012, 0.004
"""Slower than the first a piston stands still, faster than the second it surely slides."""


@dataclass(frozen=True, eq=False)
class Bins:
    """Means over n bins, AXES order, SI; `joint_*` of the encoders (m, rad), the others of the
    pistons (m).
    """

    time_s: Array
    joint: Array
    joint_rate: Array
    joint_acceleration: Array
    extension_m: Array
    speed_m_s: Array
    acceleration_m_s2: Array
    arm_m: Array
    """(n, 12) way of the piston by that of its joint: m/rad for rotation joints; 1 where it stands
    straight.
    """
    direction: Array
    pressure_a_pa: Array
    pressure_b_pa: Array
    pressure_a_rate: Array
    """(n, 12) change over the bin, Pa/s."""
    pressure_b_rate: Array
    command: Array
    supply_pa: Array
    oil_degc: Array
    tension_n: Array
    attitude_rad: Array
    specific_force: Array
    turning: Array
    """(n, 3) angular acceleration of the body, rad/s2."""
    carrying: Array
    """(n, 4) share of the bin in which the foot is meant to carry."""
    drill: Mapping[str, Array]
    """What the drill's controls know, (n,) each."""

    @property
    def count(self) -> int:
        """How many bins there are."""
        return len(self.time_s)


@dataclass(frozen=True, eq=False)
class Frame:
    """Where the bins lie among the samples."""

    first: int
    width: int
    count: int
    samples: int
    period_s: float

    @classmethod
    def of(cls, time_s: Array) -> Frame:
        """Bins of about BIN_S, from SETTLING_S after the start."""
        period = float(np.median(np.diff(time_s)))
        width = max(round(BIN_S / period), 2)
        first = int(np.searchsorted(time_s, time_s[0] + SETTLING_S))
        return cls(first, width, (len(time_s) - first) // width - 1, len(time_s), period)

    def mean(self, values: Array) -> Array:
        """Means (count,) of samples."""
        inside = values[self.first : self.first + self.width * self.count]
        return np.asarray(inside.reshape(self.count, self.width).mean(axis=1))

    def at_edges(self, values: Array, later: int = 0) -> Array:
        """Values (count + 1,) at the bins' edges, or so many samples later."""
        half = max(round(0.5 * EDGE_S / self.period_s), 1)
        edges = self.first + self.width * np.arange(self.count + 1) + later
        sums = np.concatenate([[0.0], np.cumsum(values)])
        low, high = np.maximum(edges - half, 0), np.minimum(edges + half, self.samples)
        return np.asarray((sums[high] - sums[low]) / (high - low))

    def speeds_within(self, values: Array) -> Array:
        """Rates of change (count, parts) in equal parts of each bin, PART_S long or somewhat
        longer.
        """
        parts = max(round(self.width * self.period_s / PART_S), 1)
        while self.width % parts:
            parts -= 1
        part = self.width // parts
        half = max(part // 4, 1)
        edges = self.first + part * np.arange(self.count * parts + 1)
        sums = np.concatenate([[0.0], np.cumsum(values)])
        low, high = np.maximum(edges - half, 0), np.minimum(edges + half, self.samples)
        way = np.diff((sums[high] - sums[low]) / (high - low))
        return np.asarray(way.reshape(self.count, parts) / (part * self.period_s))

    def change_of_speed(self, values: Array) -> Array:
        """Mean second derivative (count,) within each bin, by the speeds at its two edges."""
        beside = max(round(BESIDE_S / self.period_s), 1)
        way = self.at_edges(values, beside) - self.at_edges(values, -beside)
        speed = way / (2.0 * beside * self.period_s)
        return np.asarray(np.diff(speed) / (self.width * self.period_s))

    def takes_for_slow(self, rate_hz: float) -> bool:
        """Whether samples come so rarely that what swings at this rate looks slow."""
        return 2.0 * rate_hz * self.period_s > 1.0

    def noise_at_edges(self, values: Array) -> float:
        """Standard deviation of `at_edges` by what comes and goes from sample to sample: by how
        much the means of every other sample differ from those of the rest.
        """
        half = max(round(0.5 * EDGE_S / self.period_s), 1)
        edges = self.first + self.width * np.arange(self.count + 1)
        edges = edges[(edges >= half) & (edges + half <= self.samples)]
        around = values[edges[:, None] + np.arange(-half, half)]
        apart = around[:, ::2].mean(axis=1) - around[:, 1::2].mean(axis=1)
        return float(0.5 * np.sqrt(np.mean(apart**2)))


def _sense(speed: Array, times: float) -> Array:
    """Sense of sliding, -1 to 1, of pistons at these speeds (m/s) on a machine whose speeds are so
    many times ROBOCLIMBER's.
    """
    slides = (np.abs(speed) / times - REST_M_S) / (SLIDE_M_S - REST_M_S)
    return np.asarray(np.sign(speed) * np.clip(slides, 0.0, 1.0))


def sense_in_time(within: Array, step_s: float, times: float) -> Array:
    """(n, k) sense of sliding in bins, -1 to 1, by speeds (n, parts, k) in the parts of each bin,
    m/s, each part `step_s` long; speeds of the machine are so many times ROBOCLIMBER's.

    A piston slides while its encoder goes on one way, wholly however slowly, and rests before and
    after: the share of the bin's time counts. A count or two that an encoder makes now and then
    are no slide.
    """
    n, parts, k = within.shape
    ways = within.reshape(n * parts, k) / times
    moves = np.where(np.abs(ways) > REST_M_S, np.sign(ways), 0.0)
    slides = slid_on(moves, round(SLIDES_ON_S / step_s))
    far = np.abs(way_of_runs(slides, ways * step_s)) >= REST_M_S * SLIDE_S
    return np.asarray(np.where(far, slides, 0.0).reshape(within.shape).mean(axis=1))


def way_of_runs(senses: Array, ways: Array) -> Array:
    """(m, k) how far a piston goes while its sense (m, k) lasts, of which each value is one; `ways`
    (m, k) by each part.
    """
    in_turn, way = senses.T.ravel(), ways.T.ravel()
    begins = np.append(True, np.diff(in_turn) != 0.0)
    begins[:: len(senses)] = True
    starts = np.nonzero(begins)[0]
    lengths = np.diff(np.append(starts, len(way)))
    whole = np.repeat(np.add.reduceat(way, starts), lengths)
    return np.asarray(whole.reshape(senses.shape[::-1]).T)


def slid_on(moves: Array, apart: int) -> Array:
    """Senses in which pistons slide (m, k) in short parts by those in which their encoders move:
    one that moves on the same way `apart` parts later or sooner has slid meanwhile.
    """
    index = np.arange(len(moves))[:, None]
    stands = moves == 0.0
    last = np.maximum.accumulate(np.where(stands, 0, index), axis=0)
    following = np.where(stands, len(moves) - 1, index)
    following = np.minimum.accumulate(following[::-1], axis=0)[::-1]
    before, after = (np.take_along_axis(moves, at, axis=0) for at in (last, following))
    alike = (before == after) & (following - last <= apart)
    return np.asarray(np.where(stands & alike, before, moves))


FORCES = tuple(f"specific_force_{k}" for k in XYZ)
DRILL = (
    "ordered_thrust",
    "ordered_torque",
    "rods_in_hole",
    "rods_in_mast",
    "rods_mast_height",
    "rods_stored",
)


def bins_of(data: Mapping[str, Array], robot: Robot, parted: bool = True) -> Bins:
    """The bins of a recording: `data` maps the columns' names to arrays (samples,); `parted`:
    whether a piston may slide in a part of a bin alone.
    """
    frame = Frame.of(np.asarray(data["t"], dtype=float))
    count, step = frame.count, frame.width * frame.period_s

    def column(name: str) -> Array:
        return np.asarray(data[name], dtype=float)

    def mean(name: str) -> Array:
        return frame.mean(column(name))

    def at_edges(name: str) -> Array:
        return frame.at_edges(column(name))

    def per_axis(stem: str) -> Array:
        return np.column_stack([mean(f"{stem}_{axis}") for axis in AXES])

    def rates(stem: str) -> Array:
        return np.column_stack([np.diff(at_edges(f"{stem}_{axis}")) for axis in AXES]) / step

    def pressures(stem: str) -> Array:
        columns = [np.asarray(data[f"{stem}_{axis}"], dtype=float) for axis in AXES]
        return np.column_stack([frame.mean(replace_clipped(column)) for column in columns])

    joint = per_axis("position")
    rate = rates("position")
    extension, arm = robot.linkages.rods(joint)
    speed, change = rate * arm, _slope(rate, step)
    absent = np.zeros(count)
    carrying = np.column_stack(
        [mean(n) if n in data else absent + 1.0 for n in (f"carrying_{leg}" for leg in LEGS)]
    )
    attitude = np.column_stack([mean(f"attitude_{angle}") for angle in ("roll", "pitch", "yaw")])
    specific_force = _lift(attitude, [mean(n) if n in data else None for n in FORCES])
    turning = np.column_stack([np.diff(at_edges(f"angular_rate_{k}")) for k in XYZ]) / step
    moves, turns = quick(specific_force - lift_of(attitude)), quick(turning)
    change = change + over_standing_feet(robot.model, joint, carrying, moves, turns)
    joints = [column(f"position_{axis}") for axis in AXES]
    within = np.column_stack([frame.change_of_speed(one) for one in joints])
    change = of_lifted_feet(within, change, carrying)
    times = robot.machine.scale.speed
    in_parts = np.stack([frame.speeds_within(one) for one in joints], axis=2) * arm[:, None]
    direction = (
        sense_in_time(in_parts, step / in_parts.shape[1], times) if parted else _sense(speed, times)
    )
    return Bins(
        time_s=mean("t") - float(data["t"][0]),
        joint=joint,
        joint_rate=rate,
        joint_acceleration=change,
        extension_m=extension,
        speed_m_s=speed,
        acceleration_m_s2=change * arm,
        arm_m=arm,
        direction=direction,
        pressure_a_pa=pressures("pressure_a"),
        pressure_b_pa=pressures("pressure_b"),
        pressure_a_rate=rates("pressure_a"),
        pressure_b_rate=rates("pressure_b"),
        command=per_axis("valve"),
        supply_pa=mean("supply_pressure"),
        oil_degc=mean("oil_temperature"),
        tension_n=np.column_stack([mean(f"rope_tension_{side}") for side in SIDES]),
        attitude_rad=attitude,
        specific_force=specific_force,
        turning=turning,
        carrying=carrying,
        drill={name: mean(name) if name in data else absent for name in DRILL},
    )


def _lift(attitude: Array, measured: Sequence[Array | None]) -> Array:
    """Specific force (n, 3) as measured; of a unit that measures none, what a body at rest has."""
    if any(one is None for one in measured):
        return lift_of(attitude)
    return np.column_stack([one for one in measured if one is not None])


def lift_of(attitude: Array) -> Array:
    """Specific force (n, 3) of a body at rest at an attitude (n, 3)."""
    return -np.array([attitude_gravity(roll, pitch) for roll, pitch, _ in attitude])


def _slope(rate: Array, step: float) -> Array:
    """Change of a rate (n, k) from the bin before to the bin after, per second."""
    padded = np.vstack([rate[:1], rate, rate[-1:]])
    return np.asarray((padded[2:] - padded[:-2]) / (2.0 * step))
