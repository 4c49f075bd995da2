"""A steel rope: elastic, damped, tension-only.

T = max(0, EA / L0 (L - L0) + c dL/dt) where L > L0, else exactly 0: L the distance of its ends, L0 the unstrained
length paid out. The damper acts only in a taut rope and the sum never pushes, so a rope gives back at most what was
put into its spring.

Own weight: a rope of w N/m at tension T over L sags by about w L^2 / (8 T) and is shortened by w^2 L^3 / (24 T^2).
For 30 m of 16 mm rope (9.6 N/m) at 10 kN that is 0.11 m of sag and 1 mm of length, which changes the tension by
EA / L * 1 mm = 0.3 kN (3 %); below 2 kN the rope is markedly softer than EA / L (see `sag_shortening_m`).
"""

from __future__ import annotations

from typing import Any

from testbed.compiled import njit


@njit
def rope_tension(
    length_m: float, rate_m_s: float, unstrained_m: float, stiffness_ea_n: float, damping_n_s_m: float
) -> float:
    """Tension in N, never negative; exactly zero where the rope is slack."""
    stretch = length_m - unstrained_m
    if stretch <= 0.0:
        return 0.0
    tension = stiffness_ea_n / unstrained_m * stretch + damping_n_s_m * rate_m_s
    return tension if tension > 0.0 else 0.0


@njit
def unstrained_length(length_m: float, tension_n: float, stiffness_ea_n: float) -> float:
    """Paid-out length that gives `tension_n` at the distance `length_m` at rest: L / (1 + T / EA)."""
    return length_m / (1.0 + tension_n / stiffness_ea_n)


def sag_shortening_m(length_m: float, tension_n: float, weight_n_m: float) -> float:
    """How much its own weight shortens a rope of tension T: w^2 L^3 / (24 T^2), m (parabola, small sag)."""
    return float(weight_n_m**2 * length_m**3 / (24.0 * tension_n**2))


@njit
def rope_wrench(
    attachment: Any, anchor: Any, velocity: Any, unstrained_m: float, ea_n: float, damping: float, out: Any
) -> float:
    """Force on the body in the world frame into out[0:3], N; returns the tension, N.

    attachment, anchor (3): world positions, m; velocity (3): of the attachment, m/s.
    """
    dx, dy, dz = anchor[0] - attachment[0], anchor[1] - attachment[1], anchor[2] - attachment[2]
    length = (dx * dx + dy * dy + dz * dz) ** 0.5
    rate = -(dx * velocity[0] + dy * velocity[1] + dz * velocity[2]) / length
    tension: float = rope_tension(length, rate, unstrained_m, ea_n, damping)
    scale = tension / length
    out[0], out[1], out[2] = scale * dx, scale * dy, scale * dz
    return tension
