"""A traction device: a cylinder whose clamp pulls the rope in strokes, and a second clamp that holds it meanwhile.

    GRIPPED    the moving clamp holds the rope and goes with the piston: haul (place grows) or pay out (place falls)
    CLOSING    end of the stroke: the fixed clamp closes, takes the load over and gives by its seat; the other one opens
    RETURNING  the fixed clamp holds, the piston goes back to where the next stroke begins
    OPENING    the moving clamp closes again and takes the load over, with its seat; the fixed one opens

What is wanted meanwhile is owed and made up for at full speed, up to OWED_MOST_M. A device that is not needed for a
while goes back by itself, so that a whole stroke is ready. The pull ends where pressure on the piston or the rating
ends: the rate falls to zero over the last tenth of that strength. Oil: the piston's area while hauling, the annulus
going back.
"""

from __future__ import annotations

from typing import Any

from testbed.compiled import njit

# --- state (TRACTION_STATES) --------------------------------------------------------------------------------------
(MODE, CLOCK, PLACE, OWED, IDLE, WAY, REGRIPS, TRACTION_STATES) = range(8)
"""Mode, s in it, m of the stroke used, m owed, s without need, way of the last whole stroke (-1 haul, 1 pay out), count
of regrips."""
GRIPPED, CLOSING, RETURNING, OPENING = 0.0, 1.0, 2.0, 3.0
# --- numbers (TRACTION_NUMBERS) -----------------------------------------------------------------------------------
(AREA, RATING, STROKE, SPEED, CLAMP_S, RETURN_SPEED, SEAT, ANNULUS, TRACTION_NUMBERS) = range(9)
"""m2, N, m (0: hauls without end, as a winch), m/s, s for a clamp to close, m/s, m, m2."""
STILL_M_S = 2.0e-3
IDLE_S = 0.4
READY_SHARE = 0.9
"""A device idle for IDLE_S goes back if less than this share of a stroke from its beginning is left in its way."""
OWED_MOST_M = 0.05
RESERVE_M = 0.03
"""Where a stroke begins, from the piston's end: room for corrections of the tension the other way."""


@njit
def pull_share(tension_n: float, supply_gauge_pa: float, n: Any) -> float:
    """Share of the wanted hauling rate that the device can do against a tension."""
    strength = supply_gauge_pa * n[AREA]
    strength = min(max(strength, 0.0), n[RATING])
    return float(min(1.0, max(0.0, (strength - tension_n) / (0.1 * strength + 1.0))))


@njit
def _owed_rate(s: Any, n: Any, dt: float) -> float:
    """Rate that makes up for what is owed within a step, as far as the device is quick enough."""
    rate = s[OWED] / dt
    return float(min(max(rate, -n[SPEED]), n[SPEED]))


@njit
def traction_step(
    s: Any, n: Any, wanted_m_s: float, tension_n: float, supply_gauge_pa: float, dt: float
) -> float:
    """One step of a device (s: state, n: numbers); returns the rate of the rope's paid-out length, m/s (- hauls in)."""
    share: float = pull_share(tension_n, supply_gauge_pa, n)
    if n[STROKE] <= 0.0:
        return wanted_m_s * share if wanted_m_s < 0.0 else wanted_m_s
    s[OWED] = min(max(s[OWED] + wanted_m_s * dt, -OWED_MOST_M), OWED_MOST_M)
    s[CLOCK] += dt
    if s[MODE] == GRIPPED:
        return float(_gripped(s, n, wanted_m_s, share, dt))
    if s[MODE] == RETURNING:
        goal = RESERVE_M if s[WAY] < 0.0 else n[STROKE] - RESERVE_M
        step = n[RETURN_SPEED] * dt * min(1.0, max(supply_gauge_pa, 0.0) / 2.0e6)
        s[PLACE] = max(s[PLACE] - step, goal) if goal < s[PLACE] else min(s[PLACE] + step, goal)
        if s[PLACE] == goal:
            s[MODE], s[CLOCK] = OPENING, 0.0
        return 0.0
    if s[CLOCK] >= n[CLAMP_S]:
        s[MODE] = RETURNING if s[MODE] == CLOSING else GRIPPED
        s[CLOCK] = 0.0
        return float(n[SEAT] / dt) if tension_n > 0.0 else 0.0
    return 0.0


@njit
def _gripped(s: Any, n: Any, wanted_m_s: float, share: float, dt: float) -> float:
    """The moving clamp holds the rope: go, and begin to regrip at the stroke's end or when there is time for it."""
    rate: float = _owed_rate(s, n, dt)
    if rate < 0.0:
        rate *= share
    if abs(wanted_m_s) > STILL_M_S:
        s[IDLE] = 0.0
    else:
        s[IDLE] += dt
    place = s[PLACE] - rate * dt
    left = n[STROKE] - s[PLACE] if s[WAY] < 0.0 else s[PLACE]
    if (
        place > n[STROKE]
        or place < 0.0
        or (s[IDLE] > IDLE_S and left < READY_SHARE * (n[STROKE] - RESERVE_M))
    ):
        if place > n[STROKE] or place < 0.0:
            s[WAY] = -1.0 if rate < 0.0 else 1.0
        s[MODE], s[CLOCK], s[IDLE] = CLOSING, 0.0, 0.0
        s[REGRIPS] += 1.0
        return 0.0
    s[PLACE] = place
    s[OWED] -= rate * dt
    return rate


@njit
def oil_taken(s: Any, n: Any, rate_m_s: float, place_before_m: float, dt: float) -> float:
    """Flow from the supply, m3/s: the piston's side while it hauls, the annulus while it goes back."""
    if s[MODE] == GRIPPED or n[STROKE] <= 0.0:
        return float(-rate_m_s * n[AREA]) if rate_m_s < 0.0 else 0.0
    return float(abs(s[PLACE] - place_before_m) / dt * n[ANNULUS])
