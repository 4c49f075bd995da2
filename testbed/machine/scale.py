"""How large a machine is beside ROBOCLIMBER: what tolerances of control and judgement are
multiplied with.

Bounds that were chosen on ROBOCLIMBER (a load that tells a touch, a margin in metres) are worth the
same share of another machine's weight and size. Both factors are rounded, so that machines of its
class have exactly 1.
"""

from __future__ import annotations

from dataclasses import dataclass

ROBOCLIMBER_NOMINAL_N = 10_000.0
"""Nominal load of a foot of the shipped machine, N: a quarter of its weight, rounded (B)."""


ROBOCLIMBER_KG = 4000.0
"""Mass of ROBOCLIMBER, the unit of the scale of forces."""


@dataclass(frozen=True)
class Scale:
    """Factors to ROBOCLIMBER's."""

    force: float
    length: float

    @classmethod
    def of(cls, total_mass_kg: float) -> Scale:
        """That of a machine of this mass: lengths go with its cube root. Both to two figures."""
        force = float(f"{total_mass_kg / ROBOCLIMBER_KG:.2g}")
        return cls(force, float(f"{force ** (1.0 / 3.0):.2g}"))

    @property
    def nominal_load_n(self) -> float:
        """Nominal load of a foot, N: about a quarter of the machine's weight."""
        return self.force * ROBOCLIMBER_NOMINAL_N

    @property
    def moment(self) -> float:
        """Of forces at lengths."""
        return self.force * self.length

    @property
    def speed(self) -> float:
        """By Froude's law: gravity is the same."""
        return float(self.length**0.5)

    def times(self, unit: str) -> float:
        """What a number of this unit grows by, exactly 1 for ROBOCLIMBER: `m3/s` by the length to
        the power of 2.5.
        """
        return float(self.length ** exponent(unit))


ROBOCLIMBER = Scale(1.0, 1.0)
EXPONENTS = {
    "m": 1.0,
    "kg": 3.0,
    "s": 0.5,
    "N": 3.0,
    "Pa": 1.0,
    "J": 4.0,
    "kJ": 4.0,
    "W": 3.5,
    "Hz": -0.5,
    "rad": 0.0,
    "K": 0.0,
    "degC": 0.0,
    "V": 0.0,
    "1": 0.0,
}
"""Unit -> power of the length with which a number grows where gravity and the density of the bodies
stay (Froude).
"""


def exponent(unit: str) -> float:
    """The power of the length with which a number of this unit grows: `m3/(s Pa)` gives 1.5."""
    above, _, below = unit.partition("/")
    return _sum(above) - _sum(below.strip("()"))


def _sum(product: str) -> float:
    total = 0.0
    for word in product.split():
        name = word.rstrip("0123456789") or word
        total += EXPONENTS[name] * float(word[len(name) :] or 1)
    return total
