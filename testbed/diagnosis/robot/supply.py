"""The power unit: what its supply pressure is believed to be less what is measured, over bins."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from testbed.diagnosis.robot.bins import Bins
from testbed.diagnosis.robot.evidence import RawGroup
from testbed.diagnosis.robot.oil import Oil
from testbed.laws.supply import LOAD_SENSING
from testbed.machine.model import Machine

Array = npt.NDArray[np.float64]
SUPPLY_WHITE_PA, SUPPLY_SLOW_PA, SUPPLY_S = 5.0e4, 1.0e5, 1.0
"""What the supply pressure of a sound unit misses: noise, and slowly, by its pump and accumulator
(E).
"""
DRAWN_SHARE = 0.05
"""... and by this share of itself while all its flow is drawn."""
SURGE_PA, SWITCH_SHARE, SURGE_S, SURGE_BINS = 2.0e7, 0.5, 0.2, 4
"""What the supply pressure surges by where all flow is shut off at once, and by which share of what
is asked of it it lags behind; for how long, and over how many bins about a change (E).
"""
SET_SHARE, SENSING_SHARE, OPEN_M3_S = 0.01, 0.3, 1.0e-7
"""A set pressure is set to this share; a load-sensing margin holds to that share from bin to bin
(E).
"""


@dataclass(frozen=True, eq=False)
class Supply:
    """The supply's pressure in n bins: believed less measured, and by the pump's factors, Pa."""

    missing: Array
    by_pressure: Array
    by_flow: Array
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
            tolerated=np.column_stack([DRAWN_SHARE * self.by_flow, SET_SHARE * self.by_pressure]),
            rows_of=lambda change: nothing if change.supply is None else change.supply,
        )


def supply_of(oils: Sequence[Oil], bins: Bins, machine: Machine) -> Supply:
    """The group of the power unit. A load-sensing one stands its margin above the highest load of
    the open ports.
    """
    unit = machine.power_unit
    top = unit.supply_pressure_pa
    believed, by_pressure = np.full(bins.count, top), np.full(bins.count, top)
    if unit.supply_kind == LOAD_SENSING:
        ports = (bins.pressure_a_pa, bins.pressure_b_pa)
        fed = (
            np.stack([one.from_supply for one in oils], axis=1)
            > machine.scale.times("m3/s") * OPEN_M3_S
        )
        loads = np.stack(ports, axis=2) * fed
        asked = loads.max(axis=(1, 2)) + unit.load_sensing_margin_pa
        believed = np.where(fed.any(axis=(1, 2)), np.minimum(asked, top), unit.standby_pressure_pa)
        by_pressure = np.where(asked > top, top, 0.0)
    drawn = np.sum([one.from_supply.sum(axis=1) for one in oils], axis=0)
    share = np.clip(drawn / unit.full_flow_m3_s, 0.0, 1.5)
    by_flow = believed * share**2
    apart = np.abs(bins.time_s[:, None] - bins.time_s[None, :])
    noise = SUPPLY_WHITE_PA**2 * np.eye(bins.count)
    noise += SUPPLY_SLOW_PA**2 * np.exp(-apart / SUPPLY_S)
    surge = SURGE_PA * _swing(share) + SWITCH_SHARE * _swing(believed)
    noise += np.diag(surge**2) + np.exp(-apart / SURGE_S) * np.outer(surge, surge)
    if unit.supply_kind == LOAD_SENSING:
        noise += (SENSING_SHARE * unit.load_sensing_margin_pa) ** 2 * (
            np.exp(-apart / SUPPLY_S) + np.eye(bins.count)
        )
    return Supply(believed - bins.supply_pa, by_pressure, by_flow, drawn, noise)


def _swing(values: Array) -> Array:
    """(n,) how far values (n,) swing about each bin."""
    bins = np.arange(len(values))
    reach = range(-SURGE_BINS, SURGE_BINS + 1)
    near = np.array([values[np.clip(bins + k, 0, len(values) - 1)] for k in reach])
    return np.asarray(near.max(axis=0) - near.min(axis=0))
