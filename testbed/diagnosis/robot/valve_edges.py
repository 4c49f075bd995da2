"""What a cylinder's valve lets through, as believed, from what its sensors read."""

from __future__ import annotations

import numpy as np

from testbed.compiled import njit
from testbed.formats.arrays import Array
from testbed.laws.holding import NO_HOLDING, outlet_share
from testbed.laws.orifice import LAMINAR_DROP_PA
from testbed.machine.model import Axis


def through_edges(
    axis: Axis,
    chamber: int,
    place: Array,
    deadband: float,
    pressures: tuple[Array, ...],
    tank: float,
) -> tuple[Array, Array]:
    """Flow into a chamber (0: A, 1: B) from the supply and to the tank (negative), m3/s, sample by
    sample.
    """
    valve, joint = axis.valve, axis.joint
    own, supply = pressures[chamber], pressures[2]
    way = 1.0 if chamber == 0 else -1.0
    open_ = way * np.sign(place) * np.maximum(np.abs(place) - deadband, 0.0) / (1.0 - deadband)
    unit = valve.rated_flow_m3_s(joint) / np.sqrt(valve.rated_drop_per_edge_pa)
    names = ("edge_pa", "edge_at") if chamber == 0 else ("edge_pb", "edge_bt")
    fed = unit * getattr(valve, names[0]) * np.maximum(open_, 0.0) * root(supply - own)
    drained = unit * getattr(valve, names[1]) * np.minimum(open_, 0.0) * root(own - tank)
    held = valve.holding_a if chamber == 0 else valve.holding_b
    if held != NO_HOLDING:
        fed = np.maximum(fed, 0.0)
        opening = valve.counterbalance_setting_pa, valve.counterbalance_pilot_ratio
        drained = drained * _let_out(held, own - tank, pressures[1 - chamber] - tank, *opening)
    return fed, drained


@njit
def _let_out(
    kind: float, load_pa: Array, pilot_pa: Array, setting_pa: float, pilot_ratio: float
) -> Array:
    """(n,) shares of what the spool would let out that a load-holding valve lets through."""
    shares = np.empty_like(load_pa)
    for index in range(len(load_pa)):
        shares[index] = outlet_share(kind, load_pa[index], pilot_pa[index], setting_pa, pilot_ratio)
    return shares


@njit
def root(drop: Array) -> Array:
    """Sqrt of a pressure drop with its sign, smooth through zero as the orifice is
    (laws/orifice.py).
    """
    return drop / np.sqrt(np.sqrt(drop * drop + LAMINAR_DROP_PA * LAMINAR_DROP_PA))
