"""A line along the stroke: found at its wavelength, and believed where motions share it."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from testbed.diagnosis.leg import stroke_line as module
from testbed.diagnosis.leg.stroke_line import StrokeLine, stroke_line

BINS, NOISE_N, WAVES_1_M = 2000, 10.0, 41.0
AMPLITUDE_N = 6.0
Force = Any


def _found(monkeypatch: pytest.MonkeyPatch, forces: list[Force], free: int = 3) -> Any:
    """The line in motions that each leave `forces(position_m)` and white noise; the first `free` of
    them in the air.
    """
    rng = np.random.default_rng(7)
    series, left = [], []
    for number, force in enumerate(forces):
        position_m = 0.25 + 0.2 * np.sin(np.linspace(0.0, 9.0 + number, BINS))
        left.append(force(position_m) + rng.normal(0.0, NOISE_N, BINS))
        signals = SimpleNamespace(position_m=position_m)
        series.append(
            SimpleNamespace(
                name=f"motion {number}",
                bins=BINS,
                free=number < free,
                signals=signals,
                binned=lambda values, mask: (values, mask),
            )
        )
    names = tuple(("force", one.name) for one in series)
    layout = SimpleNamespace(
        group=np.repeat(np.arange(len(series)), BINS),
        count=np.ones(BINS * len(series)),
        relative=np.ones(BINS * len(series)),
        names=names,
    )
    evidence = SimpleNamespace(
        scale=dict.fromkeys(names, NOISE_N), memory=dict.fromkeys(names, 1.0)
    )
    monkeypatch.setattr(module, "judged", lambda problem, fit: {"force": np.concatenate(left)})
    problem: Any = SimpleNamespace(layout={"force": layout}, series=series)
    candidate: Any = SimpleNamespace(evidence=evidence, fit=None)
    return stroke_line(problem, candidate)


def _wave(shift: float = 0.0) -> Force:
    return lambda position_m: AMPLITUDE_N * np.sin(2.0 * np.pi * WAVES_1_M * position_m + shift)


def _nothing(position_m: np.ndarray) -> np.ndarray:
    return 0.0 * position_m


def test_a_shared_line_is_found_and_gains_what_its_amplitude_says(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """Of n bins of noise s a wave of amplitude a takes n a^2 / (4 s^2) of log-likelihood."""
    line: StrokeLine = _found(monkeypatch, [_wave()] * 3)
    assert line.waves_1_m == WAVES_1_M
    assert line.gain == pytest.approx(3 * BINS * AMPLITUDE_N**2 / (4.0 * NOISE_N**2), rel=0.15)
    assert sum(line.carried.values()) == pytest.approx(line.gain, rel=0.05)
    assert line.is_shared


def test_a_wave_whose_phase_is_each_motions_own_is_not_carried(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    line = _found(monkeypatch, [_wave(), _wave(2.0), _wave(4.0)])
    assert max(line.carried.values()) < 0.0
    assert not line.is_shared


def test_noise_has_no_line_and_a_press_is_not_asked(monkeypatch: pytest.MonkeyPatch) -> None:
    sound = _found(monkeypatch, [_nothing] * 3)
    assert sound.gain < 20.0 and not sound.is_shared
    pressed = _found(monkeypatch, [_nothing, _nothing, _wave(), _wave()], free=2)
    assert not pressed.is_shared and set(pressed.carried) == {"motion 0", "motion 1"}
    assert _found(monkeypatch, [_wave(), _wave()], free=1) is None
