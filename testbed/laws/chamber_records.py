"""The oil of a chamber and of an axis: named records of what is given, kept and worked with."""

from __future__ import annotations

from testbed.formats.records import Record, part, quantity
from testbed.laws.oil import (
    OilNear,
)


class HoldingParameters(Record):
    """The load-holding valve at a port."""

    kind = quantity("1", "0: none, 1: pilot-operated check valve, 2: counterbalance valve")
    setting = quantity("Pa", "counterbalance: load pressure at which it opens without a pilot")
    pilot_ratio = quantity("1", "counterbalance: how much the other chamber's pressure helps")


class ChamberParameters(Record):
    """One chamber with its hose, its two valve edges and its load-holding valve."""

    area = quantity("m2", "piston area")
    dead_volume = quantity("m3", "volume at the end of the stroke, with its line")
    hose_elasticity = quantity("m3/Pa", "by how much the hose widens at once; 0: stiff")
    hose_capacity = quantity("m3/Pa", "oil that the hose takes up slowly; 0: none")
    from_supply = quantity("m3/(s sqrt(Pa))", "flow of the edge from the supply, fully open")
    to_tank = quantity("m3/(s sqrt(Pa))", "flow of the edge to the tank, fully open")
    leak_from_supply = quantity("m3/(s Pa)", "laminar leakage of the edge from the supply")
    leak_to_tank = quantity("m3/(s Pa)", "laminar leakage of the edge to the tank")
    holding = part(HoldingParameters, "its load-holding valve")


class Chamber(Record):
    """The oil in one chamber."""

    oil = quantity("m3", "standard volume")
    pressure = quantity("Pa", "absolute")
    hose_pressure = quantity("Pa", "in the hose's wall, absolute")


class ChamberWork(Record):
    """Working numbers of a chamber within one call. k1, k2: rates of oil in the two stages."""

    volume = quantity("m3", "now")
    growth = quantity("m3/s", "of the volume")
    leak_from_supply = quantity("m3/(s Pa)", "of its valve edge; 0 for a locked valve")
    leak_to_tank = quantity("m3/(s Pa)", "of its valve edge; 0 for a locked valve")
    hose_conductance = quantity("m3/(s Pa)", "capacity over time of the hose")
    hose_start = quantity("Pa", "pressure of the hose when the call began")
    near = part(OilNear, "the oil at the last pressure")
    elasticity = quantity("m3/Pa", "of the hose")
    stiffness = quantity("Pa/m3", "dp/d oil")
    ramp = quantity("Pa/s", "dp/dt at constant oil")
    enthalpy = quantity("J/m3", "of the oil")
    from_supply = quantity("1", "g h times the slope of the flow from the supply")
    own_share = quantity("1", "how the chamber's rate answers its own balance")
    other_share = quantity("1", "how it answers the other chamber's")
    answer = quantity("m3/Pa", "u of the rate y + u q")
    rate = quantity("m3/s", "y of the rate y + u q")
    change = quantity("m3/s", "g h times how the flow changes in time at constant oil")
    hose_in = quantity("m3/s", "flow into the hose, without what the rate adds")
    guess = quantity("Pa", "pressure that the first stage predicts for the end")
    first_rate = quantity("m3/s", "k1")
    first_hose_rate = quantity("m3/s", "flow into the hose in the first stage")


class AxisWork(Record):
    """Working numbers of an axis within one call."""

    a = part(ChamberWork, "piston side")
    b = part(ChamberWork, "rod side")
    inner_leakage = quantity("m3/(s Pa)", "across the piston")
    outer_leakage = quantity("m3/(s Pa)", "of each chamber to the tank")
    vapour_volume = quantity("1", "specific volume beyond which the oil leaves a void")
    inverse_bulk = quantity("1/Pa", "1 / bulk modulus")
    holding = quantity("1", "1: there is a load-holding valve at A or B")
    hose_share = quantity("1", "what is left of the hose's flow by its own filling, implicitly")
    drawn = quantity("m3/s", "flow from the supply, without what the rate q adds")
    rise = quantity("m3/(s Pa) s", "how that flow answers q")
    first_drawn = quantity("m3/s", "first its change in time, then the first stage's flow")
