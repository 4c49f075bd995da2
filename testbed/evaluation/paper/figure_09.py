"""Figure 9: the differential force at slow reversals: compression of the oil, stick-slip."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from testbed.estimation.motion import smooth
from testbed.evaluation.paper.experiment import Array, Experiment, Line, Panel, Table, at_least
from testbed.evaluation.paper.leg import RATE_HZ, Trace, run

SLOW_M_S, TRAVEL_M = 1.0e-3, 0.010
COUNT_M = 1.0e-4


SPEEDS_M_S = (3.0e-4, 1.0e-3, 2.0e-3, 4.0e-3, 8.0e-3)
SOFT = {"oil.entrained_air": 0.02, "vertical_cylinder.dead_volume_a_m3": 1.0e-3,
        "vertical_cylinder.dead_volume_b_m3": 1.0e-3}  # fmt: skip
"""2 % of air and a litre of hose at each chamber: a soft oil column, to see whether that lets the piston stick."""

QUICK = {"seal.bristle_stiffness_n_m": 3.0e8, "seal.bristle_damping_n_s_m": 1.0e3}
"""A bristle that follows the Stribeck curve within micrometres and hardly damps."""


def slow_reversals(cycles: int = 2, speed_m_s: float = SLOW_M_S, travel_m: float = TRAVEL_M) -> Array:
    """Set points (n), m: out and back at an even speed."""
    way = np.arange(0.0, travel_m, speed_m_s / RATE_HZ)
    return np.concatenate([np.full(1000, 0.25), *[0.25 + np.r_[way, way[-2::-1]]] * cycles])


def compression_n(trace: Trace, window_s: float = 4.0) -> float:
    """Median over reversals of the change of force before the encoder moves by one count, N."""
    wanted = np.sign(np.diff(trace.reference_m, prepend=trace.reference_m[0]))
    turns = np.flatnonzero((wanted[1:] * wanted[:-1]) < 0.0) + 1
    force, out = smooth(trace.two_chamber_n, 10.0), []
    for k in turns:
        stop = min(k + int(window_s * RATE_HZ), len(force))
        shown = trace.encoder_m[k:stop]
        direction = wanted[k]
        # from where the piston stood at its furthest until it is one count back
        furthest = int(np.argmax(-direction * shown))
        moved = np.flatnonzero(direction * (shown - shown[furthest]) >= COUNT_M * 0.99)
        moved = moved[moved > furthest]
        if moved.size:
            out.append(float(np.ptp(force[k : k + int(moved[0])])))
    return float(np.median(out)) if out else float("nan")


def stick_slips(speed_m_s: Array, wanted_m_s: float) -> int:
    """Times at which the piston stands (below 10 % of the wanted speed) and then slips (above 200 % of it)."""
    count, stuck = 0, False
    for v in np.abs(speed_m_s) / wanted_m_s:
        if v < 0.1:
            stuck = True
        elif v > 2.0 and stuck:
            count, stuck = count + 1, False
    return count


def slips_at(speed_m_s: float, changes: Mapping[str, float]) -> int:
    """Stick-slips while the leg goes out and back once at `speed_m_s`, 4 mm or 10 mm far."""
    motion = slow_reversals(1, speed_m_s, 0.004 if speed_m_s < 5e-4 else TRAVEL_M)
    return stick_slips(smooth(run(motion, changes, seed=9).after(1.0).speed_m_s, 2.0), speed_m_s)


def experiment() -> Experiment:
    """Reverse slowly and look for both marks; other speeds and a softer oil column beside it."""
    trace = run(slow_reversals(), seed=9).after(1.0)
    counts = {name: [slips_at(v, change) for v in SPEEDS_M_S]
              for name, change in (("as declared", {}), ("soft oil column", SOFT),
                                   ("quick bristle", QUICK))}  # fmt: skip
    slips = stick_slips(smooth(trace.speed_m_s, 2.0), SLOW_M_S)
    t, s = trace.time_s, slice(None, None, 5)
    return Experiment(
        "9", "Differential force: compression and stick-slip",
        "The differential force shows the compression of the fluid before the joint moves, and the marks of "
        "stick-slip.",
        f"{TRAVEL_M * 1e3:g} mm out and back at {SLOW_M_S * 1e3:g} mm/s in the air, cold oil.",
        [
            at_least("9", "the force changes before the encoder sees any motion at a reversal (median)", 300.0,
                     compression_n(trace), "N"),
            at_least("9", "stick-slip: the piston stands and then slips at more than twice the speed", 3.0,
                     float(slips), "times"),
        ],
        [Panel("differential force", "time [s]", "F [N]", [Line(t[s], smooth(trace.two_chamber_n, 3.0)[s], "(3)")]),
         Panel("speed", "time [s]", "v [mm/s]",
               [Line(t[s], smooth(trace.speed_m_s, 2.0)[s] * 1e3, "true speed", 1)]),
         Panel("position", "time [s]", "x [mm]",
               [Line(t[s], (trace.encoder_m[s] - 0.25) * 1e3, "encoder", 0),
                Line(t[s], (trace.reference_m[s] - 0.25) * 1e3, "set point", 3, "--")])],
        [Table("Stick-slips while going out and back once",
               ["machine", *(f"{v * 1e3:g} mm/s" for v in SPEEDS_M_S)],
               [[name, *map(str, found)] for name, found in counts.items()])],
        ["Every number of the seal is assumed; the table says what a softer oil column or a stiffer, less damped "
         "bristle would change. Which of them the real leg has is not known."],
    )  # fmt: skip
