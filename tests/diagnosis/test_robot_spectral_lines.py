"""Narrow lines in the forces of pistons: a tone is found with its frequency, size and phase, noise
is none.
"""

from __future__ import annotations

import numpy as np
import pytest
from shipped import MACHINE

from testbed.diagnosis.robot.spectral_lines import (
    GRID_HZ,
    HUNTING_N,
    LEARNT_SHARE,
    LEAST_N,
    lines_of,
)
from testbed.machine.names import AXES
from testbed.machine.scale import ROBOCLIMBER

RATE_HZ, SECONDS = 200.0, 40.0
TIME_S = np.arange(round(RATE_HZ * SECONDS)) / RATE_HZ
SHAKEN = AXES.index("fr_radial")


def pressures(force_n: np.ndarray) -> dict[str, np.ndarray]:
    """Noise in every chamber, and a further force on one piston."""
    rng = np.random.default_rng(3)
    data = {"t": TIME_S}
    for axis in AXES:
        data[f"pressure_a_{axis}"] = 5e6 + rng.normal(0.0, 2e4, len(TIME_S))
        data[f"pressure_b_{axis}"] = 3e6 + rng.normal(0.0, 2e4, len(TIME_S))
    area = np.pi / 4.0 * MACHINE.axes[AXES[SHAKEN]].cylinder.bore_m ** 2
    data[f"pressure_a_{AXES[SHAKEN]}"] += force_n / area
    return data


@pytest.mark.parametrize("frequency_hz", [2.3, 6.7, 14.1])
def test_a_tone_is_found_at_its_frequency_with_its_amplitude(frequency_hz: float) -> None:
    tone = 900.0 * np.sin(2.0 * np.pi * frequency_hz * TIME_S)
    line = lines_of(pressures(tone), MACHINE)[SHAKEN]
    assert line.frequency_hz == pytest.approx(frequency_hz, abs=GRID_HZ)
    assert line.amplitude_n == pytest.approx(900.0, rel=0.05)


def test_the_pistons_that_nothing_shakes_have_no_line_worth_the_name() -> None:
    tone = 900.0 * np.sin(2.0 * np.pi * 6.7 * TIME_S)
    lines = lines_of(pressures(tone), MACHINE)
    assert [k for k, line in enumerate(lines) if line.amplitude_n > 0.1 * LEAST_N] == [SHAKEN]


def test_both_parts_of_the_run_see_the_tone_with_its_size() -> None:
    tone = 900.0 * np.cos(2.0 * np.pi * 5.0 * TIME_S)
    line = lines_of(pressures(tone), MACHINE)[SHAKEN]
    assert np.hypot(*line.parts.T) == pytest.approx([900.0, 900.0], rel=0.05)


def test_a_tone_that_begins_late_is_in_the_second_part_alone() -> None:
    late = LEARNT_SHARE * SECONDS
    tone = np.where(late < TIME_S, 900.0 * np.sin(2.0 * np.pi * 5.0 * TIME_S), 0.0)
    first, second = np.hypot(*lines_of(pressures(tone), MACHINE)[SHAKEN].parts.T)
    assert second == pytest.approx(900.0, rel=0.1) and first < 0.1 * second


def test_a_line_is_weighed_by_what_sound_machines_shake_with() -> None:
    """Rotation joints hunt: a line of theirs must be larger before it counts."""
    lines = lines_of(pressures(np.zeros(len(TIME_S))), MACHINE)
    radial, rotation = (AXES.index(f"fl_{joint}") for joint in ("radial", "rotation"))
    noise = [np.diag(lines[k].group(k, ROBOCLIMBER).noise) for k in (radial, rotation)]
    assert (noise[1] > HUNTING_N**2).all() and (noise[0] > LEAST_N**2).all()
    assert noise[0].max() < HUNTING_N**2
