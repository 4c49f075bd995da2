"""friction.presliding: bristles that bend before the seal slips."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from testbed.compiled import njit
from testbed.effects.base import Effect
from testbed.effects.parameter_spec import ParameterSpec
from testbed.effects.signature import Change, RobotSeen, Signature
from testbed.effects.terms import Coordinate, ForceTerms, Hidden, Observed, Signals, Values
from testbed.formats.arrays import Array
from testbed.recording.leg_model import Friction

MOST_DAMPED_N_S_M = 1e4
"""Several times what lip seals show."""
SOUND_COST, SOUND_BEND_M = 1000.0, 1.2e-4
"""Log-likelihood that a bristle costs which does not bend at all; friction builds up over tens of
micrometres after a reversal in every sound seal, less than an encoder of 0.1 mm shows."""
SLIDES_M_S = 1e-3
"""Faster than this a piston slides."""
BEND_A_STEP, MOST_STEPS = 0.1, 200.0
"""Of the numerical solution where the bristle slips suddenly."""
BENT_M = 1e-3
"""Bristles that bend less than this before they slip are slipping most of the time."""


@njit
def bristle_force_n(
    position_m: Array,
    velocity_m_s: Array,
    level_n: Array,
    stiffness: float,
    damping: float,
    shape: float,
    early: int,
) -> Array:
    """Force of the bristle over a recording, (n,), N: stiffness z + damping dz/dt.

    dz = dx - |dx| (stiffness z / level)^shape, exact for a constant level and shape 1. `bend` is
    stiffness z / level: 1 where the seal slips forwards, -1 backwards. Before the start it slid as
    it will slide first; or, where nothing may be foreseen, it is taken to have slid so once it
    slides within the `early` first samples (-1: all is foreseen).
    """
    out = np.empty_like(velocity_m_s)
    bend, last = 0.0, position_m[0]
    for index in range(len(velocity_m_s) if early < 0 else 0):
        if abs(velocity_m_s[index]) > SLIDES_M_S:
            bend = 1.0 if velocity_m_s[index] > 0 else -1.0
            break
    for index in range(len(velocity_m_s)):
        moved = position_m[index] - last
        last = position_m[index]
        if index < early and abs(velocity_m_s[index]) > SLIDES_M_S:
            bend, early = 1.0 if velocity_m_s[index] > 0 else -1.0, 0
        per_metre = stiffness / level_n[index]
        if shape == 1.0:
            aim = 1.0 if moved > 0.0 else -1.0
            bend = aim + (bend - aim) * np.exp(-per_metre * abs(moved))
        else:
            count = int(min(MOST_STEPS, np.ceil(per_metre * abs(moved) / BEND_A_STEP))) + 1
            for _ in range(count):
                size = abs(bend) ** shape
                slip = abs(moved) * (size if bend >= 0.0 else -size)
                bend += per_metre * (moved - slip) / count
                bend = min(1.0, max(-1.0, bend))
        size = abs(bend) ** shape
        slip_m_s = abs(velocity_m_s[index]) * (size if bend >= 0.0 else -size)
        out[index] = level_n[index] * bend + damping * (velocity_m_s[index] - slip_m_s)
    return out


class Presliding(Effect):
    """Bristles that bend before the seal slips."""

    kind = "friction.presliding"
    equation = "dz/dt = v - stiffness |v| z / g(v), F = stiffness z + damping dz/dt + sigma v"
    text = "friction builds up over a distance after each reversal: soft seals"
    parameters = (
        ParameterSpec(
            "stiffness", "N/m", 1e3, 1e9, (1e5, 3e6), "force per bend of the bristle", log=True
        ),
        ParameterSpec(
            "damping", "N s/m", 0.0, 1e6, (1e2, 3e3), "force per rate of the bend", log=True
        ),
        ParameterSpec("shape", "1", 0.2, 8.0, (0.5, 3.0), "suddenness of the slip", 1.0),
    )
    shapes = ("shape",)
    far_from_linear = True
    replaces_friction = True
    telling_motion = "small sinusoids of 0.2 to 2 mm about several places"
    alike = {
        "sensor.delay": "a delay grows with the speed of a reversal, a bristle with its distance",
        "sensor.line_b": "a line lags at rest too",
    }
    lowest = 0.0
    usual = 0.5

    def force(self, signals: Signals, terms: ForceTerms, values: Values) -> None:
        """The bristle takes the place of (5)."""
        terms.presliding = (values["stiffness"], values["damping"], values["shape"])

    def starts(self, observed: Observed) -> list[dict[str, float]]:
        """Bristles that slip after 4, 0.5 and 0.1 mm."""
        reach = max(observed.friction.coulomb_plus_n, observed.friction.coulomb_minus_n, 1.0)
        return [
            {"stiffness": reach / d, "damping": 0.05 * reach / d / 50.0} for d in (4e-3, 5e-4, 1e-4)
        ]

    def narrowed(self, coordinate: Coordinate, observed: Observed) -> Coordinate:
        """On a leg of known seals a bristle with more damping is a lag and no seal."""
        if coordinate.name == "damping" and observed.kind == "vertical-leg":
            return replace(coordinate, high=MOST_DAMPED_N_S_M)
        return coordinate

    def price(self, values: Values, observed: Observed) -> float:
        """Every seal bends by some hundredths of a millimetre before it slips, and on a leg whose
        friction at rest counts as a set that is no finding: what one costs that bends by less than
        SOUND_BEND_M.
        """
        if observed.kind != "vertical-leg":
            return 0.0
        slips_at_n = max(observed.friction.breakaway_n)
        return SOUND_COST * max(1.0 - slips_at_n / (values["stiffness"] * SOUND_BEND_M), 0.0)

    def floor_n(self, values: Values, friction: Friction, encoder_m: float) -> float:
        """A bristle turns the encoder's rounding into force, until it slips."""
        slips_at_n = max(friction.coulomb_plus_n, friction.coulomb_minus_n)
        return encoder_m * min(values["stiffness"], slips_at_n / BENT_M)

    def hide(self, world: Hidden, place: str, values: Values) -> None:
        """Another seal's plain bristles, as the equation has them."""
        world.cylinders[place].replaced |= {
            "seal.bristle_stiffness": values["stiffness"],
            "seal.bristle_damping": values["damping"],
            "seal.elastic_share": 0.0,
        }

    def signature(self, seen: RobotSeen, place: str) -> Signature:
        """Friction that turns round over a distance instead of at once, for several distances."""
        i = seen.axis(place)
        return {
            f"share {index}": Change(force={i: _behind_n(seen, i, bend)})
            for index, bend in enumerate(BENDS_M)
        }

    def from_linear(self, linear: Values, seen: RobotSeen, place: str) -> dict[str, float]:
        """The stiffness of a bristle that slips after the mean distance; its damping is not
        seen.
        """
        parts = np.maximum([linear[f"share {index}"] for index in range(len(BENDS_M))], 0.0)
        whole = float(parts.sum())
        bend = float(parts @ np.array(BENDS_M)) / whole if whole else BENDS_M[0]
        usual_n = float(np.median(seen.dry_n[:, seen.axis(place)]))
        return {"stiffness": usual_n / bend, "damping": USUAL_DAMPING_N_S_M}


BENDS_M, USUAL_DAMPING_N_S_M = (2.0e-3, 6.0e-3, 1.5e-2), 550.0
"""Distances over which a bristle of the robot's seals is tried to bend before it slips."""
LEAST_DRY_N = 1.0
"""A bristle of no friction has no length."""


def _behind_n(seen: RobotSeen, i: int, bend_m: float) -> Array:
    """(n,) N by which the friction of cylinder i is behind what is believed, were its seal a
    bristle that bends by `bend_m` before it slips at its usual dry friction: dz/dt = v - |v| z /
    longest, friction stiffness z. It bends further where a force across the rod presses it on.
    """
    way = seen.speed_m_s[:, i] * float(seen.time_s[1] - seen.time_s[0])
    dry = np.maximum(seen.dry_n[:, i], LEAST_DRY_N)
    stiffness = float(np.median(dry)) / bend_m
    longest = dry / stiffness
    keep = np.exp(-np.abs(way) / longest)
    out = np.empty(seen.bins)
    bent = float(seen.sense[0, i] * longest[0])
    for index in range(seen.bins):
        settled = float(np.sign(way[index]) * longest[index])
        bent = settled + (bent - settled) * float(keep[index])
        out[index] = stiffness * bent
    return out - seen.sense[:, i] * dry


EFFECTS = (Presliding(),)
