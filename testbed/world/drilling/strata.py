"""Rock in layers along the hole."""

from __future__ import annotations

from bisect import bisect_right
from dataclasses import dataclass

import numpy as np

from testbed.scenario.drilling import Rock

VOID = "void"
SOLID = ("hard", "medium", "soft", "fractured")


@dataclass(frozen=True)
class Strata:
    """Layers from the surface down: `bottoms_m` grow, `kinds` name the layer above each; the last
    one has no end.
    """

    bottoms_m: tuple[float, ...]
    kinds: tuple[str, ...]
    strengths: tuple[float, ...]
    """Specific energy of each layer over that of its kind."""

    def strength_at(self, depth_m: float) -> float:
        """Specific energy at a depth (m) over that of the layer's kind."""
        return self.strengths[self._layer(depth_m)]

    def at(self, depth_m: float) -> tuple[str, float]:
        """Kind of the layer at a depth and the depth of its bottom, m; a bottom belongs to the
        layer under it.
        """
        k = self._layer(depth_m)
        return self.kinds[k], self.bottoms_m[k]

    def _layer(self, depth_m: float) -> int:
        return min(bisect_right(self.bottoms_m, depth_m), len(self.kinds) - 1)


def strata_of(
    rock: Rock, depth_m: float, rng: np.random.Generator, strength_rng: np.random.Generator
) -> Strata:
    """The given layers, and below them drawn ones down to `depth_m` and on; two voids never meet,
    the first is solid.

    Thicknesses are exponentially distributed about their mean, but for a least one of a tenth of
    it. Strengths have a random stream of their own: without spread, and with any, the layers are
    the same.
    """
    bottoms: list[float] = []
    kinds: list[str] = []
    for layer in rock.layers:
        bottoms.append((bottoms[-1] if bottoms else 0.0) + layer.thickness_m)
        kinds.append(layer.kind)
    while not bottoms or bottoms[-1] <= depth_m or kinds[-1] == VOID:
        may_gape = bool(kinds) and kinds[-1] != VOID
        kind = VOID if rng.random() < rock.void_share and may_gape else str(rng.choice(SOLID))
        mean = rock.void_m if kind == VOID else rock.mean_thickness_m
        bottoms.append(
            (bottoms[-1] if bottoms else 0.0) + max(float(rng.exponential(mean)), 0.1 * mean)
        )
        kinds.append(kind)
    strengths = np.exp(rock.strength_spread * strength_rng.standard_normal(len(kinds)))
    return Strata(tuple(bottoms), tuple(kinds), tuple(strengths.tolist()))


def sticking_places(
    rock: Rock, depth_m: float, rod_length_m: float, feed_n: float, rng: np.random.Generator
) -> list[tuple[float, float]]:
    """(depth of the bit m, holding force N) where the string sticks on its way out, deepest first.

    As given, and for each rod with the rock's probability one more, held by two to four times the
    feed.
    """
    places = [(s.depth_m, s.hold_n) for s in rock.stuck]
    for index in range(int(np.ceil(depth_m / rod_length_m))):
        draw, where, hold = rng.random(3)
        if draw < rock.stick_probability:
            places.append(
                (min((index + where) * rod_length_m, depth_m), (2.0 + 2.0 * hold) * feed_n)
            )
    return sorted(places, reverse=True)
