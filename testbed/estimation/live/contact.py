"""Foot on the ground or not, from a detector's score or a load: the contact state of one foot."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
from numpy.typing import NDArray

from testbed.compiled import njit
from testbed.estimation.detectors.base import DROP, Hold
from testbed.formats.records import SET, Record, quantity


class ContactLimits(Record):
    """Hysteresis with dwell; `on` above `off`, `sure` above `on`."""

    on = quantity("N", "load from which a foot counts as loaded")
    off = quantity("N", "load down to which it is lost")
    dwell_on = quantity("s", "for how long the load must be at least `on`")
    dwell_off = quantity("s", "for how long it must be at most `off`")
    sure = quantity("N", "load from which it counts as loaded sooner")
    dwell_sure = quantity("s", "for how long the load must be at least `sure`")
    settled = quantity("N", "mean load since the loss from which it counts as loaded")
    settling = quantity("s", "time constant of that mean")


def limits_at(threshold: float, hold: Hold = DROP) -> NDArray[Any]:
    """The hysteresis, ContactLimits (1,), of minus a detector's score: lost from this threshold on,
    loaded again as `hold` says.
    """
    off = -threshold
    return ContactLimits.one(
        off=off,
        dwell_off=0.0,
        on=np.nextafter(off + hold.margin, np.inf),
        dwell_on=hold.dwell_s,
        sure=off + hold.sure_margin,
        dwell_sure=hold.sure_s,
        settled=off + hold.slow_margin,
        settling=hold.slow_s,
    )


class ContactState(Record):
    """Of one foot."""

    contact = quantity("1", "1 loaded, 0 contact lost")
    since = quantity("s", "for how long the load has contradicted it")
    surely = quantity("s", "for how long it has been at least `sure` since the loss")
    mean = quantity("N", "running mean of the load since the loss")


@njit
def step(state: ContactState, load: float, dt: float, limits: ContactLimits) -> float:
    """The contact state after one sample of dt (s) with this load (N, or minus a detector's score).

    Loaded once load >= on has lasted its dwell, load >= sure has lasted its own, or the mean load
    since the loss is at least `settled`; lost once load <= off has lasted its dwell; in between it
    stays, also with a load that is no number.
    """
    loaded = state.contact > SET
    contradicts = load <= limits.off if loaded else load >= limits.on
    surely = not loaded and load >= limits.sure
    state.since = state.since + dt if contradicts else 0.0
    state.surely = state.surely + dt if surely else 0.0
    dwell = limits.dwell_off if loaded else limits.dwell_on
    long = contradicts and state.since >= dwell - 0.5 * dt
    if not loaded and math.isfinite(load):
        state.mean += dt / (limits.settling + dt) * (load - state.mean)
    settled = not loaded and state.mean >= limits.settled
    if long or settled or (surely and state.surely >= limits.dwell_sure - 0.5 * dt):
        state.contact, state.since, state.surely = 1.0 - state.contact, 0.0, 0.0
        state.mean = load
    return state.contact
