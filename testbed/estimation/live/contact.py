"""Foot on the ground or not, from a detector's score or a load: the contact state of one foot."""

from __future__ import annotations

from typing import Any

from testbed.compiled import njit
from testbed.formats.records import SET, Record, quantity


class ContactLimits(Record):
    """Hysteresis with dwell; `on` above `off`."""

    on = quantity("N", "load from which a foot counts as loaded")
    off = quantity("N", "load down to which it is lost")
    dwell_on = quantity("s", "for how long the load must be at least `on`")
    dwell_off = quantity("s", "for how long it must be at most `off`")


class ContactState(Record):
    """Of one foot."""

    contact = quantity("1", "1 loaded, 0 contact lost")
    since = quantity("s", "for how long the load has contradicted it")


@njit
def step(state: Any, load: float, dt: float, limits: Any) -> float:
    """The contact state after one sample of dt (s) with this load (N, or minus a detector's score).

    Loaded once load >= on has lasted its dwell, lost once load <= off has; in between it stays,
    also with a load that is no number.
    """
    loaded = state.contact > SET
    contradicts = load <= limits.off if loaded else load >= limits.on
    state.since = state.since + dt if contradicts else 0.0
    dwell = limits.dwell_off if loaded else limits.dwell_on
    if contradicts and state.since >= dwell - 0.5 * dt:
        state.contact, state.since = 1.0 - state.contact, 0.0
    return float(state.contact)
