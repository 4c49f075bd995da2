"""What the machine's sensors make of the truth: gain, zero, drift, noise, counts, range, delay."""

from __future__ import annotations

import math
import zlib
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from testbed.compiled import njit
from testbed.formats.arrays import Array
from testbed.formats.records import Record, quantity
from testbed.laws.oil import ATMOSPHERE_PA
from testbed.machine.groups import NARROWEST_LOOP, Sensor
from testbed.machine.model import Machine
from testbed.machine.names import AXES, GRAVITY_M_S2, ROTATION, SIDES
from testbed.recording.rows import XYZ, DataRow
from testbed.scenario.parts import Sensors

if TYPE_CHECKING:
    from testbed.world.board import Board


CHAMBERS = ("a", "b")
"""Transducers stand in an array (2, 12): chamber by axis."""
DELAY_LENGTH = 256
"""Samples that a transducer can hold back."""


class Transducer(Record):
    """One pressure transducer with its faults."""

    gain = quantity("1", "reading by true pressure")
    zero = quantity("Pa", "reading at no pressure")
    drift = quantity("Pa/s", "of the zero by time")
    thermal = quantity("Pa/K", "of the zero by the oil's temperature")
    thermal_gain = quantity("1/K", "of the gain by the oil's temperature")
    ripple = quantity("Pa", "of pump and PWM, behind the amplifier's filter")
    ripple_rate = quantity("rad/s", "of it")
    ripple_phase = quantity("rad", "of it at the start")
    hysteresis = quantity("Pa", "the true pressure goes so far before the reading follows")
    shown = quantity("Pa", "pressure behind the reading, held back by hysteresis")
    bow = quantity("Pa", "error in the middle of the range, which a line through its ends leaves")
    noise = quantity("Pa", "standard deviation")
    resolution = quantity("Pa", "step of the converter; 0: none")
    range = quantity("Pa", "highest reading")
    delay_steps = quantity("1", "samples by which it is late", kind="i8")
    late = quantity("Pa", "the last true pressures, gauge, by sample", per=DELAY_LENGTH)


class OtherSensors(Record):
    """Encoders, load pins, the inertial unit, supply and oil."""

    count_m = quantity("m", "one count of a linear encoder; 0: none")
    count_rad = quantity("rad", "one count of a rotary encoder; 0: none")
    rope_noise = quantity("N", "standard deviation of a rope's load pin")
    attitude_noise = quantity("rad", "standard deviation of roll, pitch and yaw")
    rate_noise = quantity("rad/s", "standard deviation of the angular rates")
    force_noise = quantity("m/s2", "standard deviation of the specific forces")
    supply_noise = quantity("Pa", "standard deviation of the supply pressure")
    temperature_step = quantity("K", "step of the oil thermometer; 0: none")
    calibrated_at = quantity("degC", "oil temperature at which the transducers' zeros hold")
    joint_offset = quantity("m or rad", "what an encoder reads too much", per=AXES)
    play = quantity("m or rad", "way of a joint before its encoder follows", per=AXES)
    followed = quantity("m or rad", "where the encoder has followed to", per=AXES)
    rope_gain = quantity("1", "reading of a load pin by true tension", per=SIDES)
    rope_zero = quantity("N", "reading of a slack rope's load pin", per=SIDES)
    mounted_roll = quantity("rad", "how the inertial unit is turned against the body")
    mounted_pitch = quantity("rad", "the same, about its y axis before x")
    rate_bias = quantity("rad/s", "what its gyroscopes read too much", per=XYZ)
    force_bias = quantity("m/s2", "what its accelerometers read too much", per=XYZ)


class SampleNoise(Record):
    """Normal numbers (deviation 1) that one sample takes. A new one goes to the end: streams stay
    as they are.
    """

    pressure = quantity("1", "of the transducers", per=(CHAMBERS, AXES))
    rope_tension = quantity("1", "of the load pins", per=SIDES)
    attitude = quantity("1", "of roll, pitch, yaw", per=("roll", "pitch", "yaw"))
    angular_rate = quantity("1", "of the body's turning", per=XYZ)
    supply_pressure = quantity("1", "of the supply pressure")


class AddedNoise(Record):
    """Normal numbers (deviation 1) that came later, from a stream of their own."""

    specific_force = quantity("1", "of the accelerometers", per=XYZ)


class Noise(SampleNoise, AddedNoise):
    """All normal numbers of one sample."""


def draw_noise(
    samples: int, first: np.random.Generator, added: np.random.Generator
) -> NDArray[Any]:
    """Noise (samples,), the parts of either stream by its generator."""
    noise = Noise.zeros(samples)
    streams = (
        (SampleNoise, first.standard_normal((samples, len(SampleNoise.column_names())))),
        (AddedNoise, added.standard_normal((samples, len(AddedNoise.column_names())))),
    )
    for record, numbers in streams:
        drawn = numbers.view(record.dtype)[:, 0]
        for name in record.fields:
            noise[name] = drawn[name]
    return noise


def sensor_records(
    machine: Machine, chosen: Sensors, rng: np.random.Generator, built: int = 0
) -> tuple[NDArray[Any], Any]:
    """Transducer (2, 12) and OtherSensors; each transducer draws its own thermal zero and span, the
    unit its biases.

    built: seed of the machine, whose transducers keep their bow and their hysteresis whatever is
    run.
    """
    s = machine.sensor
    t = Transducer.zeros(len(CHAMBERS), len(AXES))
    t["gain"] = 1.0
    draws = rng.uniform(-1.0, 1.0, t.size).reshape(t.shape)
    spans = rng.uniform(-1.0, 1.0, t.shape)
    t["ripple_phase"] = rng.uniform(0.0, 2.0 * math.pi, t.shape)
    for index, axis in enumerate(machine.axes.values()):
        _fit_transducers(t[:, index], axis.sensor, chosen, draws[:, index])
        span = axis.sensor.thermal_span_share / axis.sensor.thermal_range_k
        with_span = chosen.thermal_drift and "pressure" not in chosen.without
        t["thermal_gain"][:, index] = span * spans[:, index] if with_span else 0.0
        if chosen.characteristic and "pressure" not in chosen.without:
            bend_transducers(t[:, index], axis.sensor, axis.name, built)
    other = OtherSensors.zeros()[0]
    other["rope_gain"] = 1.0
    noise = float(chosen.noise)
    if chosen.quantisation and "encoder" not in chosen.without:
        other["count_m"] = s.encoder_linear_m
        other["count_rad"] = 2 * math.pi / s.encoder_counts_per_turn
    inertial = noise * ("inertial" not in chosen.without)
    other["attitude_noise"] = inertial * s.attitude_noise_rad
    other["rate_noise"] = inertial * s.rate_noise_rad_s
    other["force_noise"] = inertial * s.specific_force_noise_m_s2
    biased = float("inertial" not in chosen.without)
    other["rate_bias"] = biased * s.rate_bias_rad_s * rng.uniform(-1.0, 1.0, len(XYZ))
    other["force_bias"] = biased * s.specific_force_bias_m_s2 * rng.uniform(-1.0, 1.0, len(XYZ))
    other["rope_noise"] = noise * s.rope_tension_noise_n * ("rope_tension" not in chosen.without)
    other["supply_noise"] = noise * s.supply_noise_pa * ("supply_pressure" not in chosen.without)
    if chosen.quantisation and "oil_temperature" not in chosen.without:
        other["temperature_step"] = s.temperature_resolution_k
    other["calibrated_at"] = s.calibration_temperature_degc
    return t, other


def _fit_transducers(pair: NDArray[Any], sensor: Sensor, chosen: Sensors, draws: Any) -> None:
    """Give an axis' two transducers their range and errors; `draws` (2,): thermal zeros by the
    largest.
    """
    pair["range"] = sensor.pressure_range_pa
    if "pressure" in chosen.without:
        return
    pair["noise"] = sensor.pressure_noise_pa if chosen.noise else 0.0
    filtered = math.hypot(1.0, sensor.pressure_ripple_hz / sensor.transducer_bandwidth_hz)
    pair["ripple"] = sensor.pressure_ripple_pa / filtered if chosen.noise else 0.0
    pair["ripple_rate"] = 2.0 * math.pi * sensor.pressure_ripple_hz
    pair["resolution"] = sensor.pressure_resolution_pa if chosen.quantisation else 0.0
    per_kelvin = sensor.thermal_zero_share * sensor.pressure_range_pa / sensor.thermal_range_k
    pair["thermal"] = per_kelvin * draws if chosen.thermal_drift else 0.0


def bend_transducers(pair: NDArray[Any], sensor: Sensor, axis: str, built: int) -> None:
    """Give an axis' two Transducers the bow and the hysteresis that they have in the machine of
    seed `built`: the part of a data sheet's accuracy that does not average out.
    """
    rng = np.random.default_rng([built, zlib.crc32(f"transducers of {axis}".encode())])
    pair["bow"] = sensor.pressure_linearity_pa * rng.uniform(-1.0, 1.0, 2)
    pair["hysteresis"] = sensor.pressure_hysteresis_pa * rng.uniform(NARROWEST_LOOP, 1.0, 2)


def fail(transducer: Any, reading_pa: float) -> None:
    """Let a Transducer show the same reading, Pa gauge, from now on."""
    for name in (
        "gain",
        "drift",
        "thermal",
        "thermal_gain",
        "ripple",
        "bow",
        "noise",
        "resolution",
    ):
        transducer[name] = 0.0
    transducer["zero"] = reading_pa


@njit
def counted(value: float, count: float) -> float:
    """A value as a counter of step `count` shows it; unchanged for count 0."""
    return math.floor(value / count + 0.5) * count if count > 0.0 else value


@njit
def transduce(true_pa: float, t: float, warm_k: float, noise: float, s: Transducer) -> float:
    """One reading of the Transducer s, Pa gauge, from the true gauge pressure."""
    s.shown = min(max(s.shown, true_pa - s.hysteresis), true_pa + s.hysteresis)
    gain = s.gain + s.thermal_gain * warm_k
    value = gain * s.shown + s.zero + s.drift * t + s.thermal * warm_k + s.noise * noise
    if s.ripple != 0.0:
        value += s.ripple * math.sin(s.ripple_rate * t + s.ripple_phase)
    if s.bow != 0.0:
        share = s.shown / s.range
        value += 4.0 * s.bow * share * (1.0 - share)
    value = counted(value, s.resolution)
    return min(max(value, 0.0), s.range)


@njit
def sense(row: DataRow, board: Board, noise: Noise, t: float, sample: int) -> None:
    """Fill the sensors' part of the row, and the board's gravity_in_body as the inertial unit has
    it.

    noise: of this sample; sample: how many samples were taken before, for transducers that are
    late.
    """
    row.t = t
    for index in range(len(AXES)):
        count = board.sensors.count_rad if index in ROTATION else board.sensors.count_m
        place = board.engine.joint[index]
        if board.sensors.play[index] > 0.0:
            followed = max(board.sensors.followed[index], place - board.sensors.play[index])
            place = board.sensors.followed[index] = min(followed, place + board.sensors.play[index])
        row.position[index] = counted(place + board.sensors.joint_offset[index], count)
        row.valve[index] = board.inputs[index].command
    sense_pressures(row, board, noise, t, sample)
    other, supply = board.sensors, board.supply
    row.supply_pressure = (
        supply.pressure + supply.droop - ATMOSPHERE_PA + other.supply_noise * noise.supply_pressure
    )
    row.oil_temperature = counted(supply.temperature, other.temperature_step)
    for k in range(len(SIDES)):
        pull = other.rope_gain[k] * board.ropes[k].tension + other.rope_zero[k]
        pull += other.rope_noise * noise.rope_tension[k]
        row.rope_tension[k] = max(pull, 0.0)
    sense_motion(row, board, noise)


@njit
def sense_pressures(row: DataRow, board: Board, noise: Noise, t: float, sample: int) -> None:
    """The transducers' readings into the row."""
    warm = board.supply.temperature - board.sensors.calibrated_at
    slot = sample % DELAY_LENGTH
    for index in range(len(AXES)):
        shown = board.axes[index].transducers
        a, b = board.transducers[0, index], board.transducers[1, index]
        a.late[slot], b.late[slot] = shown.a - ATMOSPHERE_PA, shown.b - ATMOSPHERE_PA
        late_a = a.late[(sample - min(a.delay_steps, sample)) % DELAY_LENGTH]
        late_b = b.late[(sample - min(b.delay_steps, sample)) % DELAY_LENGTH]
        row.pressure_a[index] = transduce(late_a, t, warm, noise.pressure[0, index], a)
        row.pressure_b[index] = transduce(late_b, t, warm, noise.pressure[1, index], b)


@njit
def sense_motion(row: DataRow, board: Board, noise: Noise) -> None:
    """The inertial unit, which sits at the body's origin, into the row; gravity as it has it into
    the board.
    """
    other, rotation, com = board.sensors, board.rotation, board.base_centre
    a = other.attitude_noise
    roll = math.atan2(rotation[2, 1], rotation[2, 2]) + a * noise.attitude[0]
    pitch = -math.asin(min(1.0, max(-1.0, rotation[2, 0]))) + a * noise.attitude[1]
    roll += other.mounted_roll
    pitch += other.mounted_pitch
    row.attitude[0] = roll
    row.attitude[1] = pitch
    row.attitude[2] = math.atan2(rotation[1, 0], rotation[0, 0]) + a * noise.attitude[2]
    force, twist = np.zeros(3), np.zeros(3)
    for index in range(3):
        turn = 0.0
        for j in range(3):
            turn += rotation[j, index] * board.body.angular_velocity[j]
            force[index] += rotation[j, index] * board.motion.lift[j]
            twist[index] += rotation[j, index] * board.motion.angular_acceleration[j]
        row.angular_rate[index] = turn + other.rate_noise * noise.angular_rate[index]
    for index in range(3):
        i, j = (index + 1) % 3, (index + 2) % 3
        row.specific_force[index] = (
            force[index]
            - (twist[i] * com[j] - twist[j] * com[i])
            + other.force_noise * noise.specific_force[index]
        )
    turn_into_unit(row.angular_rate, other.mounted_roll, other.mounted_pitch)
    turn_into_unit(row.specific_force, other.mounted_roll, other.mounted_pitch)
    for index in range(3):
        row.angular_rate[index] += other.rate_bias[index]
        row.specific_force[index] += other.force_bias[index]
    gravity = board.gravity_in_body
    gravity[0] = GRAVITY_M_S2 * math.sin(pitch)
    gravity[1] = -GRAVITY_M_S2 * math.cos(pitch) * math.sin(roll)
    gravity[2] = -GRAVITY_M_S2 * math.cos(pitch) * math.cos(roll)


@njit
def turn_into_unit(vector: Array, roll: float, pitch: float) -> None:
    """A vector (3) of the body frame, in place, as an inertial unit has it that is mounted
    Ry(pitch) Rx(roll).
    """
    if roll == 0.0 and pitch == 0.0:
        return
    x, y, z = vector[0], vector[1], vector[2]
    x, z = math.cos(pitch) * x - math.sin(pitch) * z, math.sin(pitch) * x + math.cos(pitch) * z
    vector[0] = x
    vector[1] = math.cos(roll) * y + math.sin(roll) * z
    vector[2] = math.cos(roll) * z - math.sin(roll) * y
