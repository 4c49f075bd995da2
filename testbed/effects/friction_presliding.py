"""friction.presliding: bristles that bend before the seal slips."""

from __future__ import annotations

from testbed.effects.base import Effect, ForceTerms, ParameterSpec, Signals, Values


def bristle_rate_m_s(
    velocity_m_s: float, bristle_m: float, stiffness_n_m: float, level_n: float, shape: float = 1.0
) -> float:
    """dz/dt = v - stiffness |v| z / g(v) for shape 1; level_n = g(v), the friction of equation (5) without sigma.

    A larger shape holds the bristle stiff for longer and lets it slip more suddenly.
    """
    bend = stiffness_n_m * bristle_m / level_n
    if shape == 1.0:
        return velocity_m_s - abs(velocity_m_s) * bend
    size = float(abs(bend) ** shape)
    return velocity_m_s - abs(velocity_m_s) * (size if bend >= 0.0 else -size)


def _force(signals: Signals, terms: ForceTerms, p: Values) -> None:
    terms.presliding = (p["stiffness"], p["damping"], p["shape"])


EFFECT = Effect(
    name="friction.presliding",
    equation="dz/dt = v - stiffness |v| z / g(v), F = stiffness z + damping dz/dt + sigma v",
    text="friction builds up over a distance after each reversal: soft seals",
    parameters=(
        ParameterSpec("stiffness", "N/m", 1e3, 1e9, (1e5, 3e6), "force per bend of the bristle"),
        ParameterSpec("damping", "N s/m", 0.0, 1e6, (1e2, 3e3), "force per rate of the bend"),
        ParameterSpec("shape", "1", 0.2, 8.0, (0.5, 3.0), "suddenness of the slip", 1.0),
    ),
    force=_force,
    law=bristle_rate_m_s,
)
