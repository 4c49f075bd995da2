"""What a sound leg or bench leaves because no formula of friction or of an orifice is true to the
last per mille, however fine its sensors are.
"""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from testbed.diagnosis.leg.evidence import FEWEST, Key
from testbed.diagnosis.leg.fit import Fit
from testbed.diagnosis.leg.problem import Problem
from testbed.diagnosis.leg.series import Series
from testbed.estimation.leg.flow import edge_flow
from testbed.recording.leg_model import Friction

Array = npt.NDArray[np.float64]
FRICTION_FORM, METERING_FORM = 0.006, 0.003
"""Share of the friction, and of the metered flow, that counts as a sensor's floor does. E: a seal's
friction follows its formula to a per cent or two, an orifice's flow to half of one; a sound leg may
leave 2.5 and 1.75 floors (probabilities.FORCE_LEFT, FLOW_LEFT)."""
FRICTION_FORM_OF_BENCHES = 0.015
"""Share of a bench's or a drive's friction that its formula may miss; it counts as the whole of
what a sound one may leave, not as the 2.5th part. E: a Stribeck curve that falls with the square of
the speed where (5) has it fall with the speed, and bristles of some micrometres, leave 1 to 2 % of
the friction.
"""


def form_floors(problem: Problem, fit: Fit) -> dict[Key, float]:
    """Group -> what the form of its law is taken not to be true to, N and m3/s: shares of the root
    mean square of friction and of the metered flow while the piston moves. Groups as in
    floor.group_floors.
    """
    bench = problem.kind in ("cylinder", "drive")
    share = FRICTION_FORM_OF_BENCHES if bench else FRICTION_FORM
    out: dict[Key, float] = {}
    for series in problem.series:
        moving = series.trusted & series.clear
        if moving.sum() < FEWEST:
            moving = series.clear
        speed = series.signals.velocity_m_s[moving]
        out["force", series.name] = share * _rms(_friction_n(fit.at.friction, speed))
        if problem.with_flow:
            for part, metered in zip(("flow_a", "flow_b"), _metered_m3_s(series), strict=True):
                out[part, series.name] = METERING_FORM * _rms(metered[moving])
    return out


def _friction_n(friction: Friction, velocity: Array) -> Array:
    """Friction (5) against the motion without its sign, N, (n,): of both ways together, as a
    constant force, a spring's rest or a mass, makes them differ as well.
    """
    speed = np.abs(velocity)
    ways = (
        (
            friction.coulomb_plus_n,
            friction.viscous_plus_n_s_m,
            friction.stribeck_plus_n,
            friction.stribeck_speed_plus_m_s,
        ),
        (
            friction.coulomb_minus_n,
            friction.viscous_minus_n_s_m,
            friction.stribeck_minus_n,
            friction.stribeck_speed_minus_m_s,
        ),
    )
    both = np.zeros_like(speed)
    for coulomb, viscous, stribeck, width in ways:
        both += coulomb + viscous * speed + stribeck * np.exp(-speed / width)
    return 0.5 * both


def _metered_m3_s(series: Series) -> tuple[Array, Array]:
    """What the plate says of the flow through the open edges of A and B, m3/s, each (n,)."""
    known, opening = series.signals.known, series.opening
    pressure_a, pressure_b = series.signals.pressure_a_pa, series.signals.pressure_b_pa
    assert opening is not None and pressure_a is not None and pressure_b is not None
    assert known.valve_rated_flow_m3_s and known.valve_rated_drop_per_edge_pa
    assert known.supply_pressure_nominal_pa
    supply, tank = known.supply_pressure_nominal_pa, known.tank_pressure_pa or 0.0
    rated = known.valve_rated_flow_m3_s, known.valve_rated_drop_per_edge_pa
    drop_a = np.where(opening > 0.0, supply - pressure_a, pressure_a - tank)
    drop_b = np.where(opening < 0.0, supply - pressure_b, pressure_b - tank)
    return edge_flow(opening, drop_a, *rated), edge_flow(opening, drop_b, *rated)


def _rms(values: Array) -> float:
    return float(np.sqrt(np.mean(values**2))) if len(values) else 0.0
