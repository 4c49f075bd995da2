"""The records of the hydraulics: what is known of an axis (a cylinder with its valve, hoses, seals
and transducers), its state, its input, and the working numbers of one call of hydraulics.py.
"""

from __future__ import annotations

from testbed.formats.records import Record, part, quantity
from testbed.laws.end_stops import EndParameters, ExtraForces
from testbed.laws.friction import SealParameters, SealState
from testbed.laws.oil import OilNear, OilParameters
from testbed.laws.transducer import TransducerParameters, TransducerState
from testbed.laws.valve import ValveParameters, ValveState


class HoldingParameters(Record):
    """The load-holding valve at a port."""

    kind = quantity("1", "0: none, 1: pilot-operated check valve, 2: counterbalance valve")
    setting = quantity("Pa", "counterbalance: load pressure at which it opens without a pilot")
    pilot_ratio = quantity("1", "counterbalance: how much the other chamber's pressure helps")


class ChamberParameters(Record):
    """One chamber with its hose, its two valve edges and its load-holding valve."""

    area = quantity("m2", "piston area")
    dead_volume = quantity("m3", "volume at the end of the stroke, with its line")
    hose_elasticity = quantity("m3/Pa", "immediate expansion of the hose; 0: rigid")
    hose_capacity = quantity("m3/Pa", "slow expansion of the hose; 0: none")
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


class AxisParameters(Record):
    """A cylinder with its valve, hoses, seals, ends and transducers."""

    a = part(ChamberParameters, "piston side")
    b = part(ChamberParameters, "rod side")
    stroke = quantity("m", "of the piston")
    inner_leakage = quantity("m3/(s Pa)", "across the piston")
    outer_leakage = quantity("m3/(s Pa)", "of each chamber to the tank")
    hose_time = quantity("s", "in which a hose takes its oil up")
    oil = part(OilParameters, "in both chambers")
    valve = part(ValveParameters, "its valve")
    seal = part(SealParameters, "its friction")
    ends = part(EndParameters, "cushions and stops")
    extra = part(ExtraForces, "undeclared forces on the piston")
    transducers = part(TransducerParameters, "its pressure transducers")


class AxisState(Record):
    """The state of an axis, and the forces of its last step."""

    a = part(Chamber, "piston side")
    b = part(Chamber, "rod side")
    valve = part(ValveState, "its valve")
    seal = part(SealState, "its friction")
    transducers = part(TransducerState, "its pressure transducers")
    force = quantity("N", "mean on the rod over the last step, + pushes out")
    friction = quantity("N", "mean over the last step, against + rate")
    end_force = quantity("N", "mean of cushions and stops over the last step, along + extension")
    reached = quantity("m", "extension at the end of the last step")
    skipped = quantity(
        "m", "jump between the end of the previous step and the start of the last one"
    )
    thinning = quantity("1", "viscous friction by the oil's temperature, share of the reference's")
    leaking = quantity("1", "leakage by the oil's temperature, share of the declared")


class AxisInput(Record):
    """Motion, command and loads of an axis during a step."""

    extension = quantity("m", "at the start of the step")
    rate = quantity("m/s", "constant over the step")
    command = quantity("1", "valve command, -1 to 1, + extends")
    load = quantity("N", "on the rod, + presses it in: for load-dependent friction")
    side_load = quantity("N", "across the rod: for load-dependent friction")
