"""Figure 4 and Table II: each leg pressed on the load cell, a and b of its sensors."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from testbed.benchmarks.estimators.identification_trials import KNOWN, inside, recording_of
from testbed.benchmarks.paper.experiment import Line, Result
from testbed.benchmarks.paper.leg import MASS_KG, RATE_HZ, Trace, chosen, run
from testbed.estimation.calibration import A_SD, B_SD_V, Calibrated, calibrate
from testbed.formats.arrays import Array
from testbed.machine.names import GRAVITY_M_S2, LEGS

K_PA_PER_V = 2.0e6
CELL_AT_M = 0.2
PRESS_M, PRESS_M_S, PRESSES = 0.013, 2.5e-3, 3
STAIR_M, STAIR_S = 1.0e-3, 12.0
"""Before that, loads held one after the other, 1 kN apart and rising: what the regression is made
on. They are held as long as figure 5's heights, so that figures 5 and 6 stand under the same
calibration (assumed: not published)."""
LEVELS = round(PRESS_M / STAIR_M) + 1


@dataclass(frozen=True)
class Regression:
    """The paper's regression (2) on one leg: load cell pressure F / A_A against V_A; a (1), b (V),
    R2 (1).
    """

    a: float
    b: float
    r2: float


def press() -> Array:
    """Set points (n), m: a staircase into the cell, then three even presses."""
    one = np.arange(0.0, PRESS_M, PRESS_M_S / RATE_HZ)
    held = np.repeat(STAIR_M * np.arange(LEVELS), round(STAIR_S * RATE_HZ))
    soft = np.convolve(np.pad(held, 100, "edge"), np.ones(201) / 201, "valid")
    soft = np.r_[soft, soft[-1] * np.linspace(1.0, 0.0, round(PRESS_M / PRESS_M_S * RATE_HZ))]
    return CELL_AT_M - 0.001 + np.concatenate([soft, *[np.r_[one, one[::-1]]] * PRESSES])


def held_samples(trace: Trace) -> NDArray[np.intp]:
    """Samples in the last half second of every held load above 200 N."""
    in_step = trace.time_s % STAIR_S
    return np.flatnonzero(
        (trace.time_s < LEVELS * STAIR_S) & (in_step > STAIR_S - 0.5) & (trace.load_n > 200.0)
    )


def explained_n(trace: Trace, held: NDArray[np.intp]) -> float:
    """The largest b that a frame and a back pressure explain, N: m g and the mean of pB A_B over
    the held loads.
    """
    back = float(np.mean(trace.pressure_b_pa[held])) * trace.area_b_m2
    return MASS_KG * GRAVITY_M_S2 + back


def straight_line(volts: Array, load_n: Array, area_m2: float) -> Regression:
    """Least squares of F / (k A_A) = a V + b. For load_n = k A_A (a V + b) it returns a and b, R2 =
    1.
    """
    y = load_n / (K_PA_PER_V * area_m2)
    a, b = np.polyfit(volts, y, 1)
    rest = y - a * volts - b
    return Regression(float(a), float(b), float(1.0 - rest.var() / y.var()))


def through(read_pa: Array, ab: Array) -> Array:
    """Voltage of a sensor with a, b that stands at the pressure `read_pa`: (2) solved for V."""
    return np.asarray((read_pa / K_PA_PER_V - ab[1]) / ab[0])


def own_calibration(trace: Trace, ab: Array, name: str) -> Calibrated:
    """A and b of both sensors by the balance of both chambers, friction and weight included."""
    volts = [through(p, s) for p, s in zip((trace.read_a_pa, trace.read_b_pa), ab, strict=True)]
    noise = np.random.default_rng(5).normal(0.0, 1.7, trace.load_n.size)
    cell = 10.0 * np.round((trace.load_n + noise) / 10.0)
    recording = recording_of(
        trace.time_s,
        trace.position_m,
        K_PA_PER_V * volts[0],
        K_PA_PER_V * volts[1],
        cell,
        KNOWN,
        "load-cell",
    )
    return calibrate(
        [replace(recording, name=name)], chosen().machine().sensor.pressure_accuracy_pa
    )


def experiment() -> Result:
    """Press every leg, each with its own friction and sensors, and calibrate it."""
    rng = np.random.default_rng([2009, 4])
    lines, rows, held, r2, a_errors, shares = [], [], 0, [], [], []
    for index, leg in enumerate(LEGS):
        ab = np.column_stack([1.0 + A_SD * rng.standard_normal(2), B_SD_V * rng.standard_normal(2)])
        friction = {
            f"vertical_cylinder.coulomb_{way}_n": value * rng.uniform(0.8, 1.2)
            for way, value in (("out", 620.0), ("in", 540.0))
        }
        trace = run(press(), friction, cell_at_m=CELL_AT_M, seed=index)
        loaded = held_samples(trace)
        volts = through(trace.read_a_pa, ab[0])
        line = straight_line(volts[loaded], trace.load_n[loaded], trace.area_a_m2)
        found = own_calibration(trace, ab, leg)
        held += sum(inside(found, ab))
        r2.append(line.r2)
        a_errors.append(abs(line.a / ab[0, 0] - 1.0))
        b_n = abs(line.b - ab[0, 1]) * K_PA_PER_V * trace.area_a_m2
        shares.append(b_n / explained_n(trace, loaded))
        own = [
            f"{sensor.a:.4f} ± {sensor.covariance[0, 0] ** 0.5:.4f}; {sensor.b:+.4f} ± {sensor.covariance[1, 1] ** 0.5:.4f}"
            for sensor in found.sensors.values()
        ]
        rows.append(
            [
                leg,
                f"{line.a:.4f}; {line.b:+.4f}",
                f"{ab[0, 0]:.4f}; {ab[0, 1]:+.4f}",
                own[0],
                f"{ab[1, 0]:.4f}; {ab[1, 1]:+.4f}",
                own[1],
                f"{line.r2:.4f}",
            ]
        )
        lines.append(
            Line(
                volts[loaded][::10],
                trace.load_n[loaded][::10] / trace.area_a_m2 / 1e5,
                leg,
                index,
                ".",
            )
        )
    return Result(
        {
            "straight": min(r2),
            "gain": max(a_errors),
            "offset": max(shares),
            "regions": held,
        },
        {"legs": lines},
        {"legs": rows},
        {"presses": PRESSES, "speed_mm_s": PRESS_M_S * 1e3},
    )
