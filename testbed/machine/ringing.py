"""How fast the sliding masses of a machine ring on oil and seals, and what clock that takes."""

from __future__ import annotations

import math

from testbed.machine.model import Machine

RINGING, MOST_RINGING = 1.4, 2.0
"""Largest angle of a ringing mass in a step: advised (E), and where leapfrog steps end. The quarter
model's seals chattered from step to step at 2.1.
"""


def fastest_rad_s(machine: Machine) -> float:
    """Angular frequency of the fastest vertical cylinder's oil and seal, half out, with the mass
    that slides.
    """
    fastest = 0.0
    for leg, numbers in machine.each_leg.items():
        axis = machine.axes[f"{leg}_vertical"]
        cylinder, half_m = axis.cylinder, 0.5 * axis.travel_m
        whole = math.pi / 4.0 * cylinder.bore_m**2
        ring = whole - math.pi / 4.0 * cylinder.rod_m**2
        columns = whole**2 / (cylinder.dead_volume_a_m3 + whole * half_m)
        columns += ring**2 / (cylinder.dead_volume_b_m3 + ring * half_m)
        stiffness = axis.oil.bulk_modulus_pa * columns + axis.seal.bristle_stiffness_n_m
        fastest = max(fastest, math.sqrt(stiffness / numbers.sliding_mass_kg))
    return fastest


def least_rate_hz(machine: Machine) -> int:
    """Rate of the physics, in whole thousands, at which engine and hydraulics take turns often
    enough.
    """
    return max(1000 * math.ceil(fastest_rad_s(machine) / RINGING / 1000.0), 1000)
