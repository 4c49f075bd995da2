"""A traction device: a cylinder whose clamp pulls the rope in strokes, and a second clamp that
holds it meanwhile.

    GRIPPED    the moving clamp holds the rope and goes with the piston: haul (place grows) or pay
               out (place falls)
    CLOSING    end of the stroke: the fixed clamp closes, takes the load over and gives by its seat
               while it does
    RETURNING  the fixed clamp holds, the piston goes back to where the next stroke begins
    OPENING    the moving clamp closes again and takes the load over, with its seat; the fixed one
               opens

What is wanted meanwhile is owed and made up for at full speed, up to OWED_MOST_M. A device that is
not needed for a while goes back by itself, so that a whole stroke is ready. The pull ends where
pressure on the piston or the rating ends: the rate falls to zero over the last tenth of that
strength. Oil: the piston's area while hauling, the annulus going back.
"""

from __future__ import annotations

from testbed.compiled import njit
from testbed.formats.records import Record, quantity

GRIPPED, CLOSING, RETURNING, OPENING = 0.0, 1.0, 2.0, 3.0
"""Modes of a device."""
STILL_M_S = 2.0e-3
IDLE_S = 0.4
READY_SHARE = 0.9
"""A device idle for IDLE_S goes back if less than this share of a stroke from its beginning is left
in its way.
"""
OWED_MOST_M = 0.05
RESERVE_M = 0.03
"""Where a stroke begins, from the piston's end: room for corrections of the tension the other
way.
"""


class TractionParameters(Record):
    """A traction device."""

    area = quantity("m2", "piston, while it hauls")
    annulus = quantity("m2", "piston's other side, while it goes back")
    rating = quantity("N", "strongest pull")
    stroke = quantity("m", "of the piston; 0: hauls without end, as a winch")
    speed = quantity("m/s", "fastest hauling and paying out")
    return_speed = quantity("m/s", "fastest way back without rope")
    hold = quantity("N", "tension above which the rope slips through its clamps")
    clamp_time = quantity("s", "for a clamp to close")
    seat = quantity("m", "what a clamp gives when it takes the load over")


class TractionState(Record):
    """Where a traction device is in its cycle."""

    mode = quantity("1", "GRIPPED, CLOSING, RETURNING or OPENING")
    clock = quantity("s", "time in this mode")
    place = quantity("m", "part of the stroke that is used")
    owed = quantity("m", "what was wanted and is not yet done")
    idle = quantity("s", "time without need")
    way = quantity("1", "of the last whole stroke: -1 haul, 1 pay out")
    regrips = quantity("1", "count of regrips")
    slipped = quantity("m", "rope that has slipped through the clamps")


@njit
def pull_share(tension_n: float, supply_gauge_pa: float, n: TractionParameters) -> float:
    """Share of the wanted hauling rate that the device can do against a tension."""
    strength = supply_gauge_pa * n.area
    strength = min(max(strength, 0.0), n.rating)
    return min(1.0, max(0.0, (strength - tension_n) / (0.1 * strength + 1.0)))


@njit
def goes_back_at_rest(s: TractionState, n: TractionParameters) -> bool:
    """Whether a device that holds the rope would go back if it were idle: one whose last whole
    stroke was the other way counts from the other end.
    """
    left = n.stroke - s.place if s.way < 0.0 else s.place
    return left < READY_SHARE * (n.stroke - RESERVE_M)


@njit
def _owed_rate(s: TractionState, n: TractionParameters, dt: float) -> float:
    """Rate that makes up for what is owed within a step, as far as the device is quick enough."""
    rate = s.owed / dt
    return min(max(rate, -n.speed), n.speed)


@njit
def traction_step(
    s: TractionState,
    n: TractionParameters,
    wanted_m_s: float,
    tension_n: float,
    supply_gauge_pa: float,
    dt: float,
) -> float:
    """One step of a device; returns the rate of the rope's paid-out length, m/s (- hauls in)."""
    share = pull_share(tension_n, supply_gauge_pa, n)
    if n.stroke <= 0.0:
        return wanted_m_s * share if wanted_m_s < 0.0 else wanted_m_s
    s.owed = min(max(s.owed + wanted_m_s * dt, -OWED_MOST_M), OWED_MOST_M)
    s.clock += dt
    if s.mode == GRIPPED:
        return _gripped(s, n, wanted_m_s, share, dt)
    if s.mode == RETURNING:
        goal = RESERVE_M if s.way < 0.0 else n.stroke - RESERVE_M
        step = n.return_speed * dt * min(1.0, max(supply_gauge_pa, 0.0) / 2.0e6)
        s.place = max(s.place - step, goal) if goal < s.place else min(s.place + step, goal)
        if s.place == goal:
            s.mode, s.clock = OPENING, 0.0
        return 0.0
    if s.clock >= n.clamp_time:
        s.mode = RETURNING if s.mode == CLOSING else GRIPPED
        s.clock = 0.0
    return float(n.seat / n.clamp_time) if tension_n > 0.0 else 0.0


@njit
def _gripped(
    s: TractionState, n: TractionParameters, wanted_m_s: float, share: float, dt: float
) -> float:
    """The moving clamp holds the rope: go, and begin to regrip at the stroke's end or when there is
    time for it.
    """
    rate = _owed_rate(s, n, dt)
    if rate < 0.0:
        rate *= share
    if abs(wanted_m_s) > STILL_M_S:
        s.idle = 0.0
    else:
        s.idle += dt
    place = s.place - rate * dt
    if place > n.stroke or place < 0.0 or (s.idle > IDLE_S and goes_back_at_rest(s, n)):
        if place > n.stroke or place < 0.0:
            s.way = -1.0 if rate < 0.0 else 1.0
        s.mode, s.clock, s.idle = CLOSING, 0.0, 0.0
        s.regrips += 1.0
        return 0.0
    s.place = place
    s.owed -= rate * dt
    return rate


@njit
def oil_taken(
    s: TractionState, n: TractionParameters, rate_m_s: float, place_before_m: float, dt: float
) -> float:
    """Flow from the supply, m3/s: the piston's side while it hauls, the annulus while it goes
    back.
    """
    if s.mode == GRIPPED or n.stroke <= 0.0:
        return float(-rate_m_s * n.area) if rate_m_s < 0.0 else 0.0
    return abs(s.place - place_before_m) / dt * n.annulus
