"""The power unit: what its supply pressure is believed to be less what is measured, over bins.

The pressure that the pump works towards is followed sample by sample: of a load-sensing one the
highest load behind an open port and its margin. What is measured comes after it, up as fast as the
pump, down as fast as oil is drawn and leaks.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import product

import numpy as np
import numpy.typing as npt

from testbed.compiled import njit
from testbed.diagnosis.robot.bins import Bins, Frame
from testbed.diagnosis.robot.evidence import RawGroup
from testbed.diagnosis.robot.hauling import Hauling
from testbed.diagnosis.robot.motion_noise import swings
from testbed.diagnosis.robot.oil import Oil
from testbed.effects.supply_droop import TIMES_S, late
from testbed.laws.supply import LOAD_SENSING
from testbed.machine.model import Machine

Array = npt.NDArray[np.float64]
SUPPLY_WHITE_PA, SUPPLY_SLOW_PA, SUPPLY_S = 2.0e4, 6.0e4, 1.0
"""What the supply pressure of a sound unit misses: noise, and slowly, by its pump and accumulator
(E).
"""
READ_SHARE = 0.05
"""The load that a pump senses is read to this share where a transducer errs (E)."""
FLOW_SHARE = 0.08
"""... and by a pump that gives less by this share (E)."""
SURGE_PA, SURGE_S, SURGE_BINS = 2.0e6, 0.2, 2
"""What the supply pressure surges by where all flow is shut off at once; for how long, and over how
many bins about a change (E).
"""
SWITCH_SHARE, SHAKEN_SHARE = 0.1, 0.7
"""By which share of what is asked of it, where that changes, the pressure differs; and by which of
what it leaves straight lines from bin to bin: a pump that gives little is hardly damped (E).
"""
HAULED_SHARE = 0.4
"""Traction devices that haul draw as well, and nobody measures it: the pressure is known to that
share where one changes its grip (E).
"""
NEAR_ALL, SHORT_SHARE, SHORT_S = 0.85, 0.2, 0.7
"""To this share it is known, with errors that last so long, where nearly all that the pump gives is
asked of it, or may be by devices that go back for their next stroke (E).
"""
RETURNED, RETURNED_SD = 0.45, 0.2
"""Devices go back for this share of the time in which their ropes let them (E): 24 sways of six
sound machines fit 0.3 to 0.6, walks less.
"""
RETURNED_OF_WEAK = (0.0, 0.25, RETURNED)
"""... and of these the share that fits best where a pump gives less or gives way: devices haul
slowly, too.
"""
PUMP_S, FALL_SHARE = 0.01, 0.6
"""A pump fills a stiff line in this time; air makes the line softer than its oil by this (E)."""
SET_SHARE = 0.01
"""A set pressure is set to this share (E)."""
CAPS = (0.95, 0.9, 0.85, 0.8, 0.75, 0.7, 0.6)
FLOWS = (0.95, 0.9, 0.85, 0.8, 0.75, 0.7, 0.65, 0.6, 0.55, 0.5)
"""Shares of the set pressure and of the full flow, of which the one that fits best is what a weak
pump is sought at.
"""
DROOPS_PA_S_M3 = (0.5e9, 1.0e9, 2.0e9, 3.0e9, 4.5e9, 6.0e9, 8.0e9)
"""Of these the one that fits best is what a supply that gives way is sought at."""
LEAST_DROP_PA, ROUNDS = 2.0e5, 16
"""A smaller drop across an open edge is none that its flow is told by; halvings of a sought
pressure.
"""


@dataclass(frozen=True, eq=False)
class Supply:
    """The supply's pressure in n bins: believed less measured, and by the pump's factors, Pa."""

    missing: Array
    by_pressure: Array
    by_flow: Array
    by_droop: Array
    """(n, lags) by 1 Pa s/m3 of a droop that follows the flow with each lag of supply.droop, Pa."""
    by_giving: Array
    """What the pump's own scatter makes of it."""
    by_returning: Array
    """What devices make of it that go back more often for their next stroke than is taken."""
    drawn_m3_s: Array
    """Flow that all cylinders draw together."""
    noise: Array

    def group(self, time_s: Array) -> RawGroup:
        """The group."""
        nothing = np.zeros(len(time_s))
        return RawGroup(
            missing=self.missing,
            time_s=time_s,
            noise=self.noise,
            tolerated=np.column_stack(
                [self.by_giving, SET_SHARE * self.by_pressure, self.by_returning]
            ),
            rows_of=lambda change: nothing if change.supply is None else change.supply,
        )


def supply_of(
    oils: Sequence[Oil], bins: Bins, frame: Frame, machine: Machine, hauling: Hauling
) -> Supply:
    """The group of the power unit; `hauling`: what the ropes' devices ask beside the cylinders."""
    unit = machine.power_unit
    asked, unsure, by_pressure = _believed(oils, bins, frame, machine, hauling)

    def given(flow_factor: float, returned: float, sag_pa: Array | float = 0.0) -> Array:
        """(n,) with a pump that gives this share, and devices that go back for this share of the
        time in which they may; `sag_pa` (n,): by how much it gives way.
        """
        most = flow_factor * unit.full_flow_m3_s - returned * hauling.returning_m3_s
        return _given(np.maximum(asked - sag_pa, 0.0), most, oils, bins, hauling)

    believed, scattered = given(1.0, RETURNED), given(1.0 - FLOW_SHARE, RETURNED)
    missing = believed - bins.supply_pa
    drawn = np.sum([one.from_supply.sum(axis=1) for one in oils], axis=0)
    share = np.clip(drawn / unit.full_flow_m3_s, 0.0, 1.5)
    giving = unit.compensator_band_pa * share
    weak = list(product(FLOWS, RETURNED_OF_WEAK))
    by_flow = _best(
        [np.maximum(giving, (believed - given(f, r)) / (1.0 - f)) for f, r in weak],
        [1.0 - f for f, _ in weak],
        missing,
    )

    sagging = list(product(DROOPS_PA_S_M3, RETURNED_OF_WEAK))

    def by_droop(lag_s: float) -> Array:
        """(n,) of what is missing by 1 Pa s/m3 of a droop that follows the flow so late; it leaves
        no more than is believed, however seldom devices go back.
        """
        sag = late(drawn, bins.time_s, lag_s)
        lacks = [np.maximum(believed - given(1.0, r, d * sag), 0.0) / d for d, r in sagging]
        return _best(lacks, [d for d, _ in sagging], missing)

    seldom, often = (given(1.0, RETURNED + spread) for spread in (-RETURNED_SD, RETURNED_SD))
    return Supply(
        missing=missing,
        by_pressure=by_pressure,
        by_flow=by_flow,
        by_droop=np.column_stack([by_droop(lag_s) for lag_s in TIMES_S]),
        by_giving=np.maximum(FLOW_SHARE * giving, believed - scattered),
        by_returning=0.5 * (seldom - often),
        drawn_m3_s=drawn,
        noise=_noise(believed, share, unsure, bins, machine, hauling),
    )


def _noise(
    believed: Array, share: Array, unsure: Array, bins: Bins, machine: Machine, hauling: Hauling
) -> Array:
    """(n, n) Pa2: what a sound unit misses of the pressure that is believed (n,), Pa, while it
    gives a share (n,) of its full flow; `unsure` (n,) Pa by overlaps and ropes.
    """
    unit = machine.power_unit
    apart = np.abs(bins.time_s[:, None] - bins.time_s[None, :])
    noise = SUPPLY_WHITE_PA**2 * np.eye(bins.count)
    slow = np.hypot(SUPPLY_SLOW_PA, READ_SHARE * (believed - unit.standby_pressure_pa))
    noise += np.exp(-apart / SUPPLY_S) * np.outer(slow, slow)
    surges = (
        SURGE_PA * _swing(share, SURGE_BINS),
        SWITCH_SHARE * _swing(believed, SURGE_BINS),
        SHAKEN_SHARE * swings(bins.supply_pa[:, None])[:, 0],
        HAULED_SHARE * believed * hauling.held,
        unsure,
    )
    surge = np.linalg.norm(surges, axis=0)
    noise += 0.5 * np.diag(surge**2)
    noise += 0.5 * np.exp(-apart / SURGE_S) * np.outer(surge, surge)
    may_go_back = hauling.returning_m3_s / unit.full_flow_m3_s
    whole = share + hauling.drawn_m3_s / unit.full_flow_m3_s + may_go_back
    near_all = np.clip((whole - NEAR_ALL) / (1.0 - NEAR_ALL), 0.0, 1.0)
    short = SHORT_SHARE * believed * near_all
    return np.asarray(noise + np.exp(-apart / SHORT_S) * np.outer(short, short))


def _believed(
    oils: Sequence[Oil], bins: Bins, frame: Frame, machine: Machine, hauling: Hauling
) -> tuple[Array, Array, Array]:
    """The pressure that is believed, by how much overlaps and ropes make it unsure, and by how much
    more it is for a set pressure that is higher by one of itself, (n,) each, Pa.
    """
    unit = machine.power_unit
    top = unit.supply_pressure_pa
    if unit.supply_kind != LOAD_SENSING:
        whole = np.full(bins.count, top)
        return whole, np.zeros(bins.count), whole
    loads = np.stack([one.asks.load_pa for one in oils]).max(axis=0)
    drawn = np.sum([one.asks.drawn_m3_s for one in oils], axis=0)
    bin_of = np.clip((np.arange(frame.samples) - frame.first) // frame.width, 0, bins.count - 1)
    hauled = np.maximum(loads, hauling.load_pa[bin_of])
    perhaps = np.maximum(loads[0], hauling.perhaps_pa[bin_of])

    def followed(load: Array, cap: float) -> Array:
        asked = np.clip(load + unit.load_sensing_margin_pa, unit.standby_pressure_pa, top * cap)
        wanted = np.where(load > 0.0, asked, unit.standby_pressure_pa)
        lags = unit.load_sensing_lag_s, PUMP_S
        fall = FALL_SHARE * machine.oil.bulk_modulus_pa / unit.line_volume_m3
        leak = unit.case_leakage_m3_s_pa
        given = _follows(wanted, drawn, lags, (leak, fall), frame.period_s)
        return frame.mean(given - unit.compensator_band_pa * drawn / unit.full_flow_m3_s)

    believed, least, most = (followed(load, 1.0) for load in hauled)
    unsure = np.maximum(np.abs(least - believed), np.abs(most - believed))
    unsure = np.hypot(unsure, hauling.unsure * (followed(perhaps, 1.0) - believed))
    capped = [(believed - followed(hauled[0], cap)) / (1.0 - cap) for cap in CAPS]
    return believed, unsure, _best(capped, [1.0 - cap for cap in CAPS], believed - bins.supply_pa)


def _given(
    believed_pa: Array, most_m3_s: Array, oils: Sequence[Oil], bins: Bins, hauling: Hauling
) -> Array:
    """(n,) pressure, at most the believed one, at which valves that are as far open as they are
    take no more than a pump gives (n,): each edge by the root of its drop.
    """
    taken = np.hstack([one.from_supply.clip(0.0) for one in oils])
    behind = np.hstack([one.pressure_pa for one in oils])
    measured = np.maximum(bins.supply_pa[:, None] - behind, LEAST_DROP_PA)
    low, high = np.zeros(bins.count), believed_pa.copy()
    for tried in range(ROUNDS):
        at = 0.5 * (low + high) if tried else high
        drops = np.maximum(at[:, None] - behind, 0.0) / measured
        enough = np.sum(taken * np.sqrt(drops), axis=1) + hauling.drawn_m3_s <= most_m3_s
        low, high = np.where(enough, at, low), np.where(enough, high, at)
    return np.asarray(0.5 * (low + high))


def _best(lacks: Sequence[Array], sizes: Sequence[float], missing: Array) -> Array:
    """Of what the pressure lacks (n,) by one unit of an effect, were it of each of these sizes,
    that which leaves least of what is missing (n,).
    """
    left = [np.sum(np.abs(missing - size * by)) for size, by in zip(sizes, lacks, strict=True)]
    return lacks[int(np.argmin(left))]


@njit
def _follows(
    wanted_pa: Array,
    drawn_m3_s: Array,
    lags_s: tuple[float, float],
    falls: tuple[float, float],
    period_s: float,
) -> Array:
    """(samples,) pressure of a line whose pump is asked for `wanted_pa`; `lags_s`: of sensing and
    of the pump; `falls`: leakage of the line, m3/(s Pa), and its stiffness, Pa/m3.
    """
    out = np.empty_like(wanted_pa)
    sensing = 1.0 - np.exp(-period_s / lags_s[0])
    pumping = 1.0 - np.exp(-period_s / lags_s[1])
    demand = pressure = wanted_pa[0]
    for index in range(len(wanted_pa)):
        demand += (wanted_pa[index] - demand) * sensing
        change = (demand - pressure) * pumping
        falling = period_s * falls[1] * (falls[0] * pressure + drawn_m3_s[index])
        pressure += max(change, -falling)
        out[index] = pressure
    return out


def _swing(values: Array, reach: int) -> Array:
    """(n, ...) how far values (n, ...) swing within so many bins to either side of each."""
    bins = np.arange(len(values))
    near = np.array(
        [values[np.clip(bins + k, 0, len(values) - 1)] for k in range(-reach, reach + 1)]
    )
    return np.asarray(near.max(axis=0) - near.min(axis=0))
