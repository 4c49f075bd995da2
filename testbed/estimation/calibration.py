"""Calibration (2), p = k (a V + b): a and b of both pressure sensors from recordings with a known
external force.

Where the piston slides, the balance of forces is linear in everything unknown:
    F_ref - m g cos(inclination) + m a
        = A_A k (a_A V_A + b_A) - A_B k (a_B V_B + b_B) - sigma v
          - sign(v) [F_c + F_s exp(-|v| / c_s) + c_load F_ref + c_p (pA + pB)] - delta
with m a further unknown where nobody declares it.
Both zeros and the asymmetry 2 delta of Coulomb friction are constants that no motion tells apart:
what is expected of them enters as a prior, and the covariance keeps what the data leave open.
Where the piston hardly slides (a leg pressed on the load cell, the paper's figure 4) friction
cannot be fitted: then it counts as an error, and the covariance grows accordingly.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from testbed.errors import InputError
from testbed.estimation.cylinder import friction_terms, piston_force_n
from testbed.estimation.friction.declared_numbers import ASYMMETRY
from testbed.estimation.friction.evidence import ROW_S, check_alive, check_rod, seen_in
from testbed.estimation.friction.posterior import (
    C_HIGH,
    C_LOW,
    correlation_inflation,
    huber_weights,
    scatter,
)
from testbed.formats.arrays import Array
from testbed.machine.names import GRAVITY_M_S2
from testbed.recording.axis import Recording, check_same_machine

A_SD, B_SD_V = 0.05, 0.0625
"""Amplifiers are trimmed to a = 1 within 5 %; b within 1.25 % of 5 V, the transducers' thermal
zero.
"""
LOAD_SD, PRESSURE_SD_M2 = 0.05, 5e-5
"""Friction that grows with the load or the pressures looks like a gain where the piston slides one
way only.
"""
COULOMB = 4
"""Place of F_c among friction's columns."""
OUTLIER_SIGMAS = 6.0
MINIMUM_ROWS = 60
MINIMUM_SPAN = 0.02
"""A sensor that has seen less than this share of its range says next to nothing about a."""


@dataclass(frozen=True)
class Sensor:
    """A calibrated sensor: a (1), b (V), their covariance (2, 2), and what it is based on."""

    k_pa_per_v: float
    a: float
    b: float
    covariance: Array
    span_v: tuple[float, float]
    saturated: int
    declared: tuple[float, float]
    warning: str = ""

    def tree(self) -> dict[str, object]:
        """As JSON carries it."""
        return {
            "a": self.a,
            "b": self.b,
            "covariance": self.covariance.tolist(),
            "k_pa_per_v": self.k_pa_per_v,
            "span_v": list(self.span_v),
            "saturated_samples": self.saturated,
            "declared": {"a": self.declared[0], "b": self.declared[1]},
        } | ({"warning": self.warning} if self.warning else {})


@dataclass(frozen=True)
class Calibrated:
    """All sensors by channel name, residual N, rows and outliers among them, and whether friction
    was fitted.
    """

    sensors: Mapping[str, Sensor]
    residual_n: float
    rows: int
    outliers: int
    friction_fitted: bool

    def tree(self) -> dict[str, object]:
        """As JSON carries it: one entry per sensor."""
        return {name: sensor.tree() for name, sensor in self.sensors.items()}


@dataclass(frozen=True)
class _Rows:
    """Volts (m, sensors), what the sensors must add up to N, speed m/s, load N, pA + pB Pa, and the
    force by a kilogram of a mass that nobody declares, m/s2.
    """

    volts: Array
    target_n: Array
    velocity_m_s: Array
    load_n: Array
    pressure_sum_pa: Array
    undeclared_m_s2: Array


def calibrate(recordings: Sequence[Recording], accuracy_pa: float = 0.0) -> Calibrated:
    """Calibrate from one or more recordings of one rig.

    accuracy_pa: standard deviation of what each sensor errs by that no averaging removes (bow,
    hysteresis); the covariances grow by it. Raises InputError naming what cannot serve, and why.
    """
    first = recordings[0]
    _check_same(recordings)
    names: list[str] = [n for n in ("pressure_a", "pressure_b") if n in first.header.channels]
    gains, factors = _gains(first, names)
    sliding = [_rows(recording, names, True) for recording in recordings]
    fitted = sum(len(r.target_n) for r in sliding) >= MINIMUM_ROWS
    parts = sliding if fitted else [_rows(recording, names, False) for recording in recordings]
    rows = _Rows(
        *(
            np.concatenate([getattr(part, field) for part in parts])
            for field in _Rows.__dataclass_fields__
        )
    )
    if len(rows.target_n) < MINIMUM_ROWS:
        raise InputError(
            f"too few usable samples: {len(rows.target_n)} rows of {ROW_S:g} s",
            file=first.folder,
            allowed=f"at least {MINIMUM_ROWS}",
        )
    theta, covariance, residual, outliers = _fit(rows, gains, factors, fitted)
    sensors: dict[str, Sensor] = {
        str(name): _sensor(
            name,
            index,
            recordings,
            theta[2 * index : 2 * index + 2],
            covariance[2 * index : 2 * index + 2, 2 * index : 2 * index + 2],
        )
        for index, name in enumerate(names)
    }
    for name in sensors:  # an error of either sensor is shared out between both
        both = math.hypot(*(_area_m2(first, other) for other in sensors))
        sensors[name] = _bent(sensors[name], accuracy_pa * both / _area_m2(first, name))
    return Calibrated(sensors, residual, len(rows.target_n), outliers, fitted)


def _area_m2(recording: Recording, channel: str) -> float:
    known = recording.known
    return known.area_a_m2 if channel == "pressure_a" else known.area_b_m2


def _bent(sensor: Sensor, accuracy_pa: float) -> Sensor:
    """The sensor with the covariance of a line that a smooth error shifts by `accuracy_pa` (Pa) in
    the middle of what the sensor has seen, and tilts by as much at the ends.
    """
    low, high = sensor.span_v
    shift, middle = accuracy_pa / sensor.k_pa_per_v, 0.5 * (low + high)
    tilt = shift / max(0.5 * (high - low), 1e-9)
    line = np.array([tilt, -middle * tilt])
    more = np.outer(line, line) + np.diag([0.0, shift**2])
    return replace(sensor, covariance=sensor.covariance + more)


def volts(recording: Recording, channel: str) -> Array:
    """The voltage that a pressure channel was recorded from, V, shape (n,). InputError where it was
    not in volts.
    """
    values = recording.pressure_a_pa if channel == "pressure_a" else recording.pressure_b_pa
    c = (
        recording.header.channels[channel].calibration
        if channel in recording.header.channels
        else None
    )
    if values is None or c is None:
        raise InputError(
            "is not recorded in V with a factor k_pa_per_v: there is nothing to calibrate",
            file=recording.folder,
            field=f"channels.{channel}",
            allowed="unit: V and calibration: {k_pa_per_v, a, b}",
        )
    return c.volts(values)


def _check_same(recordings: Sequence[Recording]) -> None:
    first = recordings[0]
    for recording in recordings:
        if recording.rig == "drive":
            raise InputError(
                "a drive has no pressure sensors",
                file=recording.folder,
                field="rig",
                value=recording.rig,
                allowed="vertical-leg, cylinder",
            )
        check_same_machine(first, recording, ("bore_m", "rod_m"))
        check_rod(recording, recording.known)
        check_alive(recording, moving=False)
    if not any(np.ptp(recording.known_force_n()) > 0.0 for recording in recordings):
        raise InputError(
            "no recording has a load cell with a changing load",
            file=first.folder,
            field="reference_force.kind",
            allowed="at least one load-cell recording",
        )


def _gains(recording: Recording, names: Sequence[str]) -> tuple[Array, Array]:
    """N per (a V + b) of each sensor, A_A k and -A_B k; and k, Pa/V."""
    gains, factors = [], []
    for name in names:
        volts(recording, name)
        calibration = recording.header.channels[name].calibration
        assert calibration is not None
        k, known = calibration.k_pa_per_v, recording.known
        chambers = (k, 0.0) if name == "pressure_a" else (0.0, k)
        gains.append(piston_force_n(*chambers, known.area_a_m2, known.area_b_m2))
        factors.append(k)
    return np.array(gains), np.array(factors)


def _rows(recording: Recording, names: Sequence[str], sliding: bool) -> _Rows:
    """Rows of one recording, ROW_S apart: while it slides, or all of them."""
    seen = seen_in(recording, recording.known)
    signals, pick = seen.signals, seen.rows(recording, sliding)
    smooth = {"pressure_a": signals.pressure_a_pa, "pressure_b": signals.pressure_b_pa}
    columns, total = [], np.zeros(pick.size)
    for name in names:
        calibration, pressure = recording.header.channels[name].calibration, smooth[name]
        assert calibration is not None and pressure is not None
        columns.append(calibration.volts(pressure[pick]))
        total += calibration.k_pa_per_v * columns[-1]
    target = seen.reference_n - seen.inertia_n
    undeclared = np.zeros(pick.size)
    if recording.known.moving_mass_kg is None:
        gravity = recording.known.gravity_along_axis_m_s2
        undeclared = gravity - seen.acceleration_m_s2[pick]
    return _Rows(
        np.column_stack(columns),
        target[pick],
        seen.velocity_m_s[pick],
        seen.reference_n[pick],
        total,
        undeclared,
    )


def _fit(
    rows: _Rows, gains: Array, factors: Array, friction: bool
) -> tuple[Array, Array, float, int]:
    """(parameters, covariance, residual N, outliers): a, b per sensor first, then friction's where
    it is fitted.
    """
    if not friction:
        return _robust(*_design(rows, gains, 1.0, 0.0))[1:]
    level = _friction_level(rows, gains)
    # The second time with the pressures, and the Coulomb friction that scales a prior, as found.
    for _ in range(2):
        tried = [_robust(*_design(rows, gains, c, level)) for c in np.geomspace(C_LOW, C_HIGH, 6)]
        best = min(tried, key=lambda result: result[0])
        level = max(float(best[1][2 * len(gains) + COULOMB]), 0.1 * level)
        a, b = best[1][0 : 2 * len(gains) : 2], best[1][1 : 2 * len(gains) : 2]
        rows = replace(rows, pressure_sum_pa=(rows.volts * a + b) @ factors)
    return best[1:]


def _design(rows: _Rows, gains: Array, c: float, level: float) -> tuple[Array, Array, Array, Array]:
    """Columns (m, p), target (m,), prior means (p,), prior standard deviations (p,); level 0 leaves
    friction out.
    """
    columns: list[Array] = []
    for index, gain in enumerate(gains):
        columns += [gain * rows.volts[:, index], np.full(len(rows.target_n), gain)]
    mean, sd = [1.0, 0.0] * len(gains), [A_SD, B_SD_V] * len(gains)
    if level > 0.0:
        v, sign = rows.velocity_m_s, np.sign(rows.velocity_m_s)
        terms, plus = -sign[:, None] * friction_terms(np.abs(v), c), v > 0.0
        viscous_part, dry, bump = terms.T
        columns += [viscous_part * plus, viscous_part * ~plus, bump * plus, bump * ~plus]
        columns += [dry, -np.ones_like(v)]
        columns += [dry * np.maximum(rows.load_n, 0.0), dry * rows.pressure_sum_pa]
        # the change of the Stribeck part with log c_s, so that its uncertainty reaches a and b
        slope = np.abs(v) / c * bump
        columns += [slope * plus, slope * ~plus]
        wide, viscous = 3.0 * level, 3.0 * level / max(float(np.abs(v).max()), 1e-3)
        mean += [0.0] * 10
        sd += [
            viscous,
            viscous,
            wide,
            wide,
            wide,
            ASYMMETRY * level,
            LOAD_SD,
            PRESSURE_SD_M2,
            level,
            level,
        ]
    if rows.undeclared_m_s2.any():  # a mass of any size up to what the load cell could lift
        columns.append(rows.undeclared_m_s2)
        mean.append(0.0)
        sd.append(max(float(np.abs(rows.load_n).max()), 1.0) / GRAVITY_M_S2)
    return np.column_stack(columns), rows.target_n, np.array(mean), np.array(sd)


def _friction_level(rows: _Rows, gains: Array) -> float:
    """A first size of friction, N: half the mean gap between extension and retraction at nominal
    calibration.
    """
    gap = rows.volts @ gains - rows.target_n
    plus = rows.velocity_m_s > 0.0
    if plus.all() or not plus.any():
        return max(float(np.abs(gap).mean()), 1.0)
    # the two directions meet different loads: compare at equal load by taking a line out first
    line = np.polyfit(rows.target_n, gap, 1)
    rest = gap - np.polyval(line, rows.target_n)
    return max(0.5 * abs(float(rest[plus].mean() - rest[~plus].mean())), 1.0)


def _robust(x: Array, y: Array, mean: Array, sd: Array) -> tuple[float, Array, Array, float, int]:
    """Bayesian linear regression with Huber weights; rows beyond OUTLIER_SIGMAS are left out.

    The covariance is that of independent rows times the residual's correlation inflation.
    """
    weight = np.ones_like(y)
    variance, inflation = float(np.var(y)) * 1e-4 + 1e-9, 1.0
    prior = np.diag(1.0 / sd**2)
    theta, spread = mean, 1.0
    for _ in range(8):
        precision: Array = x.T @ (x * weight[:, None]) / (variance * inflation) + prior
        theta = np.asarray(
            np.linalg.solve(precision, x.T @ (weight * y) / (variance * inflation) + prior @ mean)
        )
        residual = y - x @ theta
        spread = scatter(residual - np.median(residual))
        far = np.abs(residual) > OUTLIER_SIGMAS * spread
        weight = np.where(far, 0.0, huber_weights(residual, spread))
        used = weight > 0.0
        freedom = max(float(weight.sum()) - len(theta), 1.0)
        variance = float(np.sum(weight * residual**2)) / freedom
        inflation = correlation_inflation((residual * weight)[used])
    covariance = np.asarray(np.linalg.inv(precision), dtype=np.float64)
    score = (
        float(np.sum(weight * residual**2))
        + float(np.sum(weight == 0.0)) * (OUTLIER_SIGMAS * spread) ** 2
    )
    return score, theta, covariance, float(np.sqrt(variance)), int((weight == 0.0).sum())


def _sensor(
    name: str, index: int, recordings: Sequence[Recording], theta: Array, covariance: Array
) -> Sensor:
    all_volts = [volts(recording, name) for recording in recordings]
    low, high = (
        min(float(volt.min()) for volt in all_volts),
        max(float(volt.max()) for volt in all_volts),
    )
    channel = recordings[0].header.channels[name]
    calibration = channel.calibration
    assert calibration is not None
    saturated = sum(
        int((recording.saturated_a if index == 0 else recording.saturated_b).sum())
        for recording in recordings
    )
    full = (
        (channel.range_pa[1] - channel.range_pa[0]) / calibration.k_pa_per_v
        if channel.range_pa
        else 5.0
    )
    warning = ""
    if high - low < MINIMUM_SPAN * full:
        warning = f"has seen {low:.3f} to {high:.3f} V only: a is what was expected before"
    elif saturated:
        warning = f"{saturated} samples at the end of the range were left out"
    return Sensor(
        calibration.k_pa_per_v,
        float(theta[0]),
        float(theta[1]),
        covariance,
        (low, high),
        saturated,
        (calibration.a, calibration.b),
        warning,
    )
