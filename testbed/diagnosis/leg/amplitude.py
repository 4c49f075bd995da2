"""The amplitude of a narrow-band force: measured from its band, as its phase is known to the
recording alone.
"""

from __future__ import annotations

import numpy as np

from testbed.diagnosis.leg.points import Point
from testbed.diagnosis.leg.problem import Problem
from testbed.estimation.leg.balance import corrected, force_terms, friction_n, without_friction_n
from testbed.estimation.leg.force import narrow_band
from testbed.formats.intervals import Z90
from testbed.recording.leg_model import EffectEntry

FORM = 0.035
"""Half of the interval of an amplitude, as a share of it, at least: smoothing damps it not exactly
as reckoned.
"""
FEWEST_SAMPLES = 200


def with_amplitudes(
    problem: Problem, entries: tuple[EffectEntry, ...], at: Point
) -> tuple[EffectEntry, ...]:
    """A model's entries with the amplitudes that nothing fitted, as measured."""
    parameters = {
        effect.effect.name: name
        for effect in at.effects
        if (name := effect.effect.band_amplitude) is not None
    }
    return tuple(
        _measured(problem, entry, parameters[entry.name], at) if entry.name in parameters else entry
        for entry in entries
    )


def _measured(problem: Problem, entry: EffectEntry, parameter: str, at: Point) -> EffectEntry:
    value, half = _amplitude_n(problem, at)
    interval = (value - half, value + half)
    measured = entry.parameters[parameter].model_copy(
        update={"value": value, "interval90": interval}
    )
    return entry.model_copy(update={"parameters": {**entry.parameters, parameter: measured}})


def _amplitude_n(problem: Problem, at: Point) -> tuple[float, float]:
    """(amplitude, half of its 90 % interval), N: root mean square of the band in each recording,
    times sqrt 2.
    """
    found, weight = [], []
    for series in problem.series:
        signals = corrected(series.signals, at.effects)
        terms = force_terms(problem.base, signals, at.effects)
        force = without_friction_n(signals, terms) - friction_n(at.friction, signals, terms)
        force = force - (series.reference_n if series.reference_n is not None else 0.0)
        frequency, _, _ = terms.narrow_bands[0]
        band = narrow_band(force, series.trusted, signals, frequency)
        # Every channel went through the same smoothing: the band was damped by it.
        damped = float(np.exp(-0.5 * (2.0 * np.pi * frequency * series.width_s) ** 2))
        if series.trusted.sum() > FEWEST_SAMPLES:
            found.append(float(np.sqrt(2.0 * np.mean(band[series.trusted] ** 2))) / damped)
            weight.append(float(series.trusted.sum()))
    mean = float(np.average(found, weights=weight))
    variance = np.average((np.array(found) - mean) ** 2, weights=weight)
    return mean, max(Z90 * float(np.sqrt(variance / len(found))), FORM * mean)
