"""A steel rope: elastic, damped, tension-only; with or without the sag of its own weight.

Without sag: T = max(0, EA / L0 (L - L0) + c d(L - L0)/dt) where L > L0, else exactly 0: L the
distance of its ends, L0 the unstrained length paid out. The damper acts on the rope's own
stretching, only in a taut rope, and the sum never pushes, so a rope gives back at most what was put
into its spring.

With sag (weight w N/m across the chord, a parabola; Irvine): the arc is longer than the chord by
w^2 L0^3 / (24 T^2),

    L / L0 - 1 = T / EA - w^2 L0^2 / (24 T^2)        (one tension for each distance, a cubic)

so the stiffness is EA / L0 / (1 + w^2 L0^2 EA / (12 T^3)): Ernst's modulus. Where the belly would
hang lower than the rock, h below the chord, the rope rests on it and only its ends hang free: T = w
(2 h)^3 / (9 X^2) with X the length that arc and chord differ by, until at X = 2 h both ends hang
straight down and the rope is slack: exactly 0. Tension is a function of the distance alone, so that
sagging gives no energy either.

What sag changes, for 30 m of 16 mm rope on 45 degrees (6.8 N/m across, EA 9.8 MN): it is softer by
3 % at 10 kN, by 21 % at 5 kN and by 81 % at 2 kN; below 1.3 kN its belly rests on the rock. The
start's tensions are as declared.
"""

from __future__ import annotations

from testbed.compiled import njit
from testbed.formats.arrays import Array
from testbed.formats.records import Record, quantity

XYZ = ("x", "y", "z")


class Rope(Record):
    """A rope from its anchor to the body, and what its traction device does with it."""

    anchor = quantity("m", "place of the anchor, world frame", per=XYZ)
    attachment = quantity("m", "place of its attachment, body frame", per=XYZ)
    unstrained = quantity("m", "unstrained length paid out")
    stiffness_ea = quantity("N", "stiffness by strain")
    damping = quantity("N s/m", "of a taut rope")
    weight = quantity("N/m", "weight by length; 0: no sag")
    clearance = quantity("m", "how far its belly may hang before it rests on the rock")
    breaking_load = quantity("N", "tension at which it breaks")
    whole = quantity("1", "1: whole, 0: broken, cut or not there")
    wanted_rate = quantity("m/s", "of the unstrained length, as control wants it; - hauls in")
    rate = quantity("m/s", "as the device does it")
    tension = quantity("N", "tension")
    force = quantity("N", "on the body, world frame", per=XYZ)


@njit
def rope_tension(
    length_m: float,
    rate_m_s: float,
    unstrained_m: float,
    stiffness_ea_n: float,
    damping_n_s_m: float,
) -> float:
    """Tension in N, never negative; exactly zero where the rope is slack."""
    stretch = length_m - unstrained_m
    if stretch <= 0.0:
        return 0.0
    tension = stiffness_ea_n / unstrained_m * stretch + damping_n_s_m * rate_m_s
    return tension if tension > 0.0 else 0.0


@njit
def sagging_tension(
    length_m: float,
    unstrained_m: float,
    stiffness_ea_n: float,
    weight_n_m: float,
    clearance_m: float,
) -> float:
    """Tension at rest of a rope that sags, N; never negative, and exactly zero where it is
    slack.
    """
    q = (weight_n_m * unstrained_m) ** 2 / 24.0
    touching = weight_n_m * unstrained_m**2 / (8.0 * clearance_m)
    strain = length_m / unstrained_m - 1.0
    strain_touching = touching / stiffness_ea_n - q / touching**2
    if strain < strain_touching:
        excess_touching = q * unstrained_m / touching**2
        excess = excess_touching + (strain_touching - strain) * unstrained_m
        if excess >= 2.0 * clearance_m:
            return 0.0
        rest = (0.5 * excess_touching / clearance_m) ** 2
        return touching * ((excess_touching / excess) ** 2 - rest) / (1.0 - rest)
    a, b = stiffness_ea_n * strain, stiffness_ea_n * q
    tension: float = max(a, 0.0) + b ** (1.0 / 3.0)
    # Newton from above on a convex branch: it comes down to the root and never past it.
    for _ in range(30):
        step = (tension**2 * (tension - a) - b) / (tension * (3.0 * tension - 2.0 * a))
        tension -= step
        if step < 1e-10 * tension:
            break
    return tension


@njit
def unstrained_length(length_m: float, tension_n: float, stiffness_ea_n: float) -> float:
    """Paid-out length that gives `tension_n` at the distance `length_m` at rest without sag: L / (1
    + T / EA).
    """
    return length_m / (1.0 + tension_n / stiffness_ea_n)


def unstrained_sagging(
    length_m: float, tension_n: float, stiffness_ea_n: float, weight_n_m: float, clearance_m: float
) -> float:
    """Paid-out length of a rope that sags: unstrained_length under its own weight. A tension of 0
    gives the shortest rope that is slack.
    """
    from scipy.optimize import brentq

    def error(unstrained_m: float) -> float:
        tension: float = sagging_tension(
            length_m, unstrained_m, stiffness_ea_n, weight_n_m, clearance_m
        )
        return tension - tension_n if tension > 0.0 else -tension_n - 1e-9

    found = float(brentq(error, 0.5 * length_m, length_m + 3.0 * clearance_m, xtol=1e-12))
    return found if tension_n > 0.0 else found + 1e-6


@njit
def slip_through(rope: Rope, hold_n: float) -> float:
    """Let a rope's tension fall to what its clamps hold, N, by paying out; returns the length that
    slipped, m.
    """
    if rope.tension <= hold_n:
        return 0.0
    slipped = (rope.tension - hold_n) * rope.unstrained / rope.stiffness_ea
    share = hold_n / rope.tension
    for index in range(3):
        rope.force[index] *= share
    rope.tension = hold_n
    rope.unstrained += slipped
    return slipped


@njit
def rope_pull(rope: Rope, attachment: Array, velocity: Array) -> float:
    """Force of a rope on the body in the world frame into rope.force, N; returns the tension, N.

    attachment (3): world position, m; velocity (3): of the attachment, m/s. The damper
    acts on what the ends' distance grows by beyond the length paid out; of a sagging rope by the
    share of it that stretches the rope.
    """
    anchor = rope.anchor
    dx, dy, dz = anchor[0] - attachment[0], anchor[1] - attachment[1], anchor[2] - attachment[2]
    length = (dx * dx + dy * dy + dz * dz) ** 0.5
    rate = -(dx * velocity[0] + dy * velocity[1] + dz * velocity[2]) / length - rope.rate
    unstrained, ea = rope.unstrained, rope.stiffness_ea
    tension = 0.0
    if rope.weight <= 0.0:
        tension = rope_tension(length, rate, unstrained, ea, rope.damping)
    else:
        across = rope.weight * (dx * dx + dy * dy) ** 0.5 / length
        tension = sagging_tension(length, unstrained, ea, max(across, 1e-3), rope.clearance)
        if tension > 0.0:
            share = 1.0 / (1.0 + (across * unstrained) ** 2 * ea / (12.0 * tension**3))
            tension = max(tension + share * rope.damping * rate, 0.0)
    scale = tension / length
    rope.force[0], rope.force[1], rope.force[2] = scale * dx, scale * dy, scale * dz
    return tension
