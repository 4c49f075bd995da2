"""force.periodic: a narrow-band force on the piston."""

from __future__ import annotations

import math

import numpy as np

from testbed.effects.base import Effect
from testbed.effects.parameter_spec import ParameterSpec
from testbed.effects.signature import Change, RobotSeen, Signature
from testbed.effects.terms import ForceTerms, Observed, Signals, Values
from testbed.formats.arrays import Array
from testbed.recording.known import Known

PHASE_HOLDS_S = 3.5
"""Time in which the phase of the narrow band counts as one number."""
LOWEST_HZ, HIGHEST_HZ, GRID_HZ = 1.5, 35.0, 0.02
"""Where lines are looked for, and how finely."""
FEWEST_BINS = 100
CLIPPED_AT = 4.0
"""What is farther out, in robust standard deviations, is no vibration."""
SPECTRUM_SIZE = 1 << 17
NEIGHBOURS = 151
"""Points of the grid among which a line has to stand out: 3 Hz."""
RINGING = 0.8, 1.15
"""Shares of the oil's natural frequencies between which a leg rings by itself: air makes its oil
softer, a mass that hangs on elastically lighter (E).
"""
POSITIONS = 9
"""Extensions at which the natural frequency is asked for."""


def force_n(time_s: float, amplitude: float, frequency: float, phase_rad: float = 0.0) -> float:
    """Force on the piston along extension, N; the phase is the machine's own affair."""
    return amplitude * math.sin(2.0 * math.pi * frequency * time_s + phase_rad)


class Periodic(Effect):
    """A narrow-band force on the piston."""

    kind = "force.periodic"
    equation = "F = amplitude sin(2 pi frequency t + phase) on the piston"
    text = "an undeclared vibration: a pump, a motor, an unbalanced shaft"
    parameters = (
        ParameterSpec("amplitude", "N", 0.0, 1e5, (20.0, 300.0), "half of peak to peak"),
        ParameterSpec("frequency", "Hz", 0.2, 200.0, (3.0, 20.0), "of the vibration", log=True),
        ParameterSpec(
            "harmonics",
            "1",
            1.0,
            5.0,
            (1.0, 3.0),
            "how many multiples of the frequency it holds",
            1.0,
        ),
    )
    band_amplitude = "amplitude"
    telling_motion = (
        "a long, slow stroke with nothing else running, then with each auxiliary switched on"
    )
    hides = {"amplitude": "extra.periodic_force", "frequency": "extra.periodic_frequency"}
    lowest = -math.inf
    usual = 500.0

    def force(self, signals: Signals, terms: ForceTerms, values: Values) -> None:
        """A band whose phase only the recording knows."""
        terms.narrow_bands.append(
            (values["frequency"], values["amplitude"], round(values["harmonics"]))
        )

    def starts(self, observed: Observed) -> list[dict[str, float]]:
        """At the strongest line of what is left of the force."""
        frequency, amplitude = strongest_line(observed)
        return [{"frequency": frequency, "amplitude": amplitude}]

    def promise(self, observed: Observed) -> float:
        """Its strength is not fitted: the line's own power says what it could explain."""
        _, amplitude = strongest_line(observed)
        noise = np.concatenate(
            [residual.noise_n[residual.counted] for residual in observed.residual]
        )
        return float(np.sum(np.minimum(0.25 * amplitude**2 / noise**2, 1.0)))

    def price(self, values: Values, observed: Observed) -> float:
        """What a narrow band fits of mere noise: two numbers for each time in which its phase may
        change.
        """
        return observed.seconds / PHASE_HOLDS_S

    def signature(self, seen: RobotSeen, place: str) -> Signature:
        """The two amplitudes of the strongest line of the piston's force."""
        axis = seen.axis(place)
        parts = np.eye(2)
        return {
            name: Change(line={axis: parts[index]}) for index, name in enumerate(("cosine", "sine"))
        }

    def from_linear(self, linear: Values, seen: RobotSeen, place: str) -> dict[str, float]:
        """The line's amplitude and frequency."""
        amplitude = float(np.hypot(linear["cosine"], linear["sine"]))
        return {"amplitude": amplitude, "frequency": float(seen.line_hz[seen.axis(place)])}

    looked_for = 300.0


def strongest_line(observed: Observed) -> tuple[float, float]:
    """(frequency Hz, amplitude N) of the strongest line in what is left of the force, all
    recordings summed.
    """
    grid = np.arange(LOWEST_HZ, HIGHEST_HZ, GRID_HZ)
    power, weight = np.zeros_like(grid), 0.0
    for residual in observed.residual:
        good = residual.counted
        if good.sum() < FEWEST_BINS:
            continue
        force = np.where(good, residual.values_n, 0.0)
        limit = CLIPPED_AT * 1.48 * float(np.median(np.abs(force[good])))
        force = np.clip(force - np.mean(force[good]), -limit, limit) * good
        spectrum = np.abs(np.fft.rfft(force, SPECTRUM_SIZE)) ** 2
        frequency = np.fft.rfftfreq(SPECTRUM_SIZE, residual.bin_s)
        share = 4.0 * np.interp(grid, frequency, spectrum) / float(good.sum()) ** 2
        power += np.where(grid < 0.45 / residual.bin_s, share, 0.0) * good.sum()
        weight += float(good.sum())
    # A line stands out of its own neighbourhood, not out of a spectrum that falls with frequency.
    standing_out = power / np.maximum(_neighbourhood(power), 1e-30)
    low, high = _ringing_hz(observed)
    at = int(np.argmax(np.where((grid > low) & (grid < high), 0.0, standing_out)))
    amplitude = float(np.sqrt(power[at] / max(weight, 1.0)))
    first = observed.residual[0]
    damped = np.exp(-0.5 * (2.0 * np.pi * grid[at] * first.smoothing_s) ** 2)
    attenuation = float(np.sinc(grid[at] * first.bin_s) * damped)
    return float(grid[at]), max(amplitude / max(attenuation, 0.2), 1.0)


def _ringing_hz(observed: Observed) -> tuple[float, float]:
    """Frequencies between which the mass swings on its own oil, Hz; (0, 0) where the oil is not
    declared.

    What is left of the force there is the mass' inertia: it swings by less than its encoder counts,
    so that nobody can tell a force on the piston from it.
    """
    known = observed.known
    if not (known.declares_flow and known.moving_mass_kg) or observed.kind == "robot":
        return 0.0, 0.0
    stroke = known.stroke_m or 0.0
    moved = np.clip(observed.position_m, 0.02 * stroke, 0.98 * stroke)
    first, last = np.percentile(moved, [2.0, 98.0])
    natural = [
        natural_frequency_hz(known, float(position))
        for position in np.linspace(first, last, POSITIONS)
    ]
    return RINGING[0] * min(natural), RINGING[1] * max(natural)


def natural_frequency_hz(known: Known, position_m: float) -> float:
    """Frequency of the mass on the oil of both closed chambers, sqrt(k / m) / (2 pi), Hz:
    k = bulk modulus (A_A^2 / V_A + A_B^2 / V_B) at an extension within the stroke.
    """
    oil_a = (known.dead_volume_a_m3 or 0.0) + known.area_a_m2 * position_m
    oil_b = (known.dead_volume_b_m3 or 0.0) + known.area_b_m2 * (
        (known.stroke_m or 0.0) - position_m
    )
    per_modulus = known.area_a_m2**2 / oil_a + known.area_b_m2**2 / oil_b
    stiffness = (known.bulk_modulus_pa or 0.0) * per_modulus
    return math.sqrt(stiffness / (known.moving_mass_kg or math.inf)) / (2.0 * math.pi)


def _neighbourhood(power: Array) -> Array:
    from scipy.ndimage import median_filter

    floor = 1e-3 * float(np.mean(power))
    return np.asarray(median_filter(power, NEIGHBOURS, mode="nearest") + floor, dtype=np.float64)


EFFECTS = (Periodic(),)
