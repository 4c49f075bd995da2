"""Dead band, hysteresis, amplifier and spool against their closed forms and an independent
integrator.
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from scipy.linalg import expm

from testbed.laws.second_order import lag_weights, second_order
from testbed.laws.valve import ValveParameters, ValveState, opening, play, spool_weights, valve_path

WN, ZETA, TAU = 2 * math.pi * 18.0, 0.95, 0.002


def _valve(width: float = 0.0, deadband: float = 0.0, tau: float = TAU) -> tuple[Any, Any]:
    p = ValveParameters.of(
        frequency=WN, damping=ZETA, amplifier_lag=tau, hysteresis=width, dead_band=deadband
    )
    return ValveState.zeros()[0], p


def _run(s: Any, p: Any, commands: np.ndarray, dt: float = 1e-3, n: int = 2) -> np.ndarray:
    """Spool after each step."""
    weights = spool_weights(p.frequency, p.damping, p.amplifier_lag, dt / n)
    out, spool = np.empty(n + 1), []
    for u in commands:
        valve_path(s, p, float(u), dt / n, weights, out)
        spool.append(s.spool)
    return np.array(spool)


def test_dead_band_by_hand() -> None:
    assert opening(0.03, 0.03) == 0.0
    assert opening(-0.02, 0.03) == 0.0
    assert opening(0.515, 0.03) == pytest.approx(0.5)
    assert opening(-1.0, 0.03) == -1.0


def test_play_follows_its_band_behind_in_either_direction() -> None:
    assert play(0.0, 0.1, 0.004) == pytest.approx(0.096)
    assert play(0.096, 0.094, 0.004) == pytest.approx(0.096)
    assert play(0.096, 0.05, 0.004) == pytest.approx(0.054)


@pytest.mark.parametrize("zeta", [0.0, 0.3, 0.95, 1.0, 1.7])
def test_second_order_step_is_the_matrix_exponential(zeta: float) -> None:
    expected = expm(np.array([[0.0, 1.0], [-WN * WN, -2 * zeta * WN]]) * 7e-3)
    assert np.reshape(second_order(WN, zeta, 7e-3), (2, 2)) == pytest.approx(
        expected, rel=1e-6, abs=1e-9
    )


def test_first_order_lag_follows_a_ramp_by_tau() -> None:
    old, rise = lag_weights(0.01, 1e-3)
    value, slope = -0.01 * 3.0, 3.0  # on its ramp already: tau behind
    for k in range(50):
        value = old * value + (1 - old) * slope * k * 1e-3 + rise * slope * 1e-3
    assert value == pytest.approx(slope * (0.05 - 0.01), rel=1e-9)


def test_spool_without_amplifier_lag_is_the_analytic_step_response() -> None:
    s, p = _valve(tau=1e-9)
    spool = _run(s, p, np.full(60, 0.8))
    t = 1e-3 * np.arange(1, 61)
    wd = WN * math.sqrt(1 - ZETA**2)
    analytic = 0.8 * (
        1 - np.exp(-ZETA * WN * t) * (np.cos(wd * t) + ZETA * WN / wd * np.sin(wd * t))
    )
    assert spool == pytest.approx(analytic, abs=1e-7)


def test_amplifier_play_and_spool_agree_with_an_integrator() -> None:
    width = 0.01
    s, p = _valve(width=width)
    commands = np.repeat([0.3, 0.31, -0.2, -0.195, 0.5, 0.1], 15)
    spool = _run(s, p, commands)
    a = r = 0.0
    y, expected = np.zeros(2), []
    for u in commands:

        def rate(t: float, y: np.ndarray, u: float = u, a: float = a, r: float = r) -> list[float]:
            level = u + (a - u) * math.exp(-t / TAU)
            target = min(max(r, level - width), level + width)
            return [y[1], WN * WN * (target - y[0]) - 2 * ZETA * WN * y[1]]

        y = solve_ivp(rate, (0, 1e-3), y, rtol=1e-9, atol=1e-12, max_step=5e-5).y[:, -1]
        a = u + (a - u) * math.exp(-1e-3 / TAU)
        r = min(max(r, a - width), a + width)
        expected.append(y[0])
    assert spool == pytest.approx(np.array(expected), abs=3e-6)
    assert s.play == pytest.approx(r, abs=1e-12)


def test_the_step_does_not_matter() -> None:
    commands = np.repeat([0.4, -0.3, 0.2], 20)
    coarse, fine = _valve(0.004, 0.03), _valve(0.004, 0.03)
    assert _run(*coarse, commands, n=1)[-1] == pytest.approx(
        _run(*fine, commands, n=8)[-1], abs=1e-12
    )


def test_small_commands_within_the_hysteresis_do_not_move_the_spool() -> None:
    s, p = _valve(width=0.004)
    assert np.all(_run(s, p, 0.0039 * np.sin(np.arange(200))) == 0.0)


def test_an_undamped_spool_stops_at_its_ends() -> None:
    s, p = _valve()
    p.damping = 0.1
    spool = _run(s, p, np.full(200, 1.0))
    assert spool.max() == 1.0
    assert spool[-1] == pytest.approx(1.0, abs=0.2)
