"""How fast a percussive bit eats rock, and when the feed finds nothing to push on.

    v = efficiency * E_blow * f / (A specific_energy) * thrust(F / F_best),
    thrust(x) = x (2 - x) for 0 <= x <= 2

The energy that a volume of rock takes is the handbook's measure of drillability; the thrust factor
falls on both sides of the best feed (bouncing bit, stalling bit) and is 1 there. It is a parabola
by assumption, not by measurement.
"""

from __future__ import annotations

import math


def thrust_factor(feed_n: float, best_n: float) -> float:
    """Share of the best rate of penetration at a feed force: 0 without feed and at twice the best
    one, 1 at it.
    """
    x = feed_n / best_n
    return max(0.0, x * (2.0 - x))


def best_feed(best_n: float, energy_ratio: float, exponent: float) -> float:
    """Best feed, N, in rock that takes `energy_ratio` times the energy of that in which it is
    `best_n`.

    Hard rock throws the bit back and wants more feed, soft rock stalls it with less.
    """
    return best_n * float(energy_ratio**exponent)


def penetration_rate(
    blow_energy_j: float,
    blow_hz: float,
    efficiency: float,
    hole_m: float,
    specific_energy_j_m3: float,
    thrust: float,
) -> float:
    """Rate of penetration, m/s, of a hole of diameter `hole_m` (m) with the thrust factor `thrust`
    (0 to 1).
    """
    area = math.pi / 4.0 * hole_m**2
    return thrust * efficiency * blow_energy_j * blow_hz / (area * specific_energy_j_m3)


def wandering(value: float, share: float, time_s: float, dt: float, normal: float) -> float:
    """Next value of a deviation: standard deviation `share`, forgets in `time_s`; `normal` is drawn
    from N(0, 1).
    """
    keep = math.exp(-dt / time_s)
    return keep * value + share * math.sqrt(1.0 - keep * keep) * normal
