"""What the flow balance of a cylinder is worth: what a sound one may miss, and how noisy it is."""

from __future__ import annotations

from collections.abc import Callable, Iterator

import numpy as np

from testbed.diagnosis.robot.bin_edge_noise import of_shared_edges
from testbed.diagnosis.robot.evidence import RawGroup
from testbed.diagnosis.robot.oil import Oil
from testbed.diagnosis.robot.piston_positions import PLAY_S, played, rounded, swept
from testbed.diagnosis.robot.tolerances import LATE_S, middle, standard_deviation
from testbed.effects.hydraulics_hose import HOSE_TIMES_S
from testbed.formats.arrays import Array
from testbed.machine.model import Axis, Machine
from testbed.machine.names import AXES
from testbed.machine.scale import Scale

WHITE_M3_S = 2.0e-6
"""Noise of a bin beside the encoder's rounding (E)."""
VALVE_SHARE, MEMORY_S = 0.03, 0.5
"""A valve's flow is known to this share, and its deviation lasts so long on ROBOCLIMBER (E)."""
EDGE_SHARE = 0.1
"""What goes through one edge is known to this share (E)."""
VOID_M3_S = 8.0e-5
"""Where a chamber may hold a void, flows are known to this (E)."""
ZERO_PA = 4.0e4
"""Zeros of a sensor and its line, at any warmth (E)."""
COMPRESSED_SHARE = 0.15
"""Oil in which air goes in and out of solution is known to this share beside its tolerances (E)."""
CUT_OFF = 0.003
"""An overlap that is wider than declared within its tolerance cuts small openings off as a wide one
does (B).
"""
LEAST_OVERLAP_OFF = 0.006
"""No overlap is known better than to this share of the spool's travel (E)."""
SUCKED_M3_S, SUCKED_S = 1.5e-6, 5.0
"""Into a chamber of a few bar so much may come that nobody sees, for so long (B: four sound
drillings, up to 2e-6 m3/s).
"""
SUCKED_PA, NOT_SUCKED_PA = 2.2e5, 5.2e5
"""Pressures up to which that is so, and from which on it is not (E)."""
SEEPS_M3_S = 7.0e-7
"""What seeps through a valve whose spool lies at the edge of its overlap (E)."""
SPOOL_OFF = 0.002
"""The spool's place is known to this share of its travel: play, amplifier (E)."""
HOSE_M3_PA = 3.0e-13
"""What hoses of any machine may take up, by each time in which they fill (E)."""
AIR_CHANGES = 0.5
"""From one recording to another a cylinder's air changes by this share of a workshop's standard
deviation (E): a fifth of what is usual comes or goes by its return line, its bleeding and rest.
"""
SOUND_LEAK_M3_S_PA = 1.0e-13
"""What passes the piston of a sound seal: 3e-14 to 2e-13 (D)."""


def tolerated(oil: Oil, axis: Axis, scale: Scale) -> Iterator[tuple[Array, float]]:
    """(change (n, 2), standard deviation) of everything that a sound cylinder's valve, sensors and
    hoses may differ by.
    """
    valve, declared = axis.valve, axis.oil
    for k in range(2):
        alone = np.eye(2)[k]
        yield oil.from_supply * alone, EDGE_SHARE
        yield oil.to_tank * alone, EDGE_SHARE
        yield np.tile(alone, (len(oil.missing), 1)), scale.times("m3/s") * SEEPS_M3_S
        for edge, name in enumerate((("pa", "at"), ("pb", "bt"))[k]):
            leaks = getattr(valve, f"edge_{name}_leakage_m3_s_pa")
            yield oil.by_edge_leak[:, :, edge] * alone, leaks
        reading = oil.by_reading * alone
        yield reading, scale.times("Pa") * ZERO_PA
        yield reading * oil.pressure_pa, standard_deviation(f"sensor.gain_{'ab'[k]}@*.gain_error")
    yield oil.by_spool, SPOOL_OFF
    yield (
        oil.by_deadband,
        max(standard_deviation("axes.*.valve.deadband", valve.deadband), LEAST_OVERLAP_OFF),
    )
    yield oil.by_wide_deadband, CUT_OFF
    yield oil.by_hysteresis, 1.0
    for alone in np.eye(2):
        yield oil.by_lateness * alone, LATE_S
    for k in range(len(HOSE_TIMES_S)):
        yield (
            oil.by_hose[:, k],
            max(declared.hose_capacity_m3_pa, scale.times("m3/Pa") * HOSE_M3_PA),
        )


def of_oil(oil: Oil, axis: Axis, scale: Scale) -> Iterator[tuple[str, Array, float]]:
    """(number, change (n, 2), standard deviation) of the oil's own numbers."""
    least = {"internal_leakage_m3_s_pa": scale.times("m3/(s Pa)") * SOUND_LEAK_M3_S_PA}
    for number, column in _by_oil(oil, axis).items():
        sd = _of_tolerance(standard_deviation, number, getattr(axis.oil, number))
        yield number, column, max(sd, least.get(number, 0.0))


def _by_oil(oil: Oil, axis: Axis) -> dict[str, Array]:
    """What the balance misses by one unit more of each of the oil's numbers."""
    softer = -oil.by_softness / axis.oil.bulk_modulus_pa**2
    return {
        "internal_leakage_m3_s_pa": oil.by_leak,
        "bulk_modulus_pa": softer,
        "entrained_air": oil.by_air,
    }


def is_alike(number: str) -> bool:
    """Whether a workshop's tolerance of a number of the oil is that of all cylinders' oil."""
    return standard_deviation(f"axes.*.oil.{number}", 1.0) <= 0.0


def _of_tolerance(asked: Callable[[str, float], float], number: str, value: float) -> float:
    """What is asked of the tolerance of a number of the oil, each cylinder's or all cylinders'."""
    each, alike = f"axes.*.oil.{number}", f"oil.{number}"
    return asked(each if standard_deviation(each, value) > 0.0 else alike, value)


def expected(oil: Oil, axis: Axis) -> Array:
    """(n, 2) what is missing in the mean of sound machines: they do not lie about the drawing."""
    out = np.zeros_like(oil.missing)
    for number, column in _by_oil(oil, axis).items():
        value = getattr(axis.oil, number)
        out += (_of_tolerance(middle, number, value) - value) * column
    return out


def group_of(oil: Oil, i: int, machine: Machine, time_s: Array) -> RawGroup:
    """The group of cylinder i: chamber A's bins, then B's."""
    nothing, axis = np.zeros_like(oil.missing), machine.axes[AXES[i]]
    own = [(c, sd) for c, sd in tolerated(oil, axis, machine.scale) if sd > 0.0]
    of_all = [one for one in of_oil(oil, axis, machine.scale) if one[-1] > 0.0]
    columns = [sd * c.T.ravel() for c, sd in (*own, *((c, sd) for _, c, sd in of_all))]
    of_oil_at = {number: len(own) + k for k, (number, *_) in enumerate(of_all)}
    alike = {number: k for number, k in of_oil_at.items() if is_alike(number)}
    air = of_oil_at.get("entrained_air")
    crosses_s = PLAY_S * machine.scale.times("s")
    playing = swept(oil.swept_m2, played(oil.play_m, time_s, crosses_s))
    return RawGroup(
        missing=(oil.missing - expected(oil, axis)).T.ravel(),
        time_s=np.tile(time_s, 2),
        noise=noise_of(oil, time_s, machine.scale) + playing,
        lasting=playing,
        tolerated=np.column_stack(columns),
        alike=alike,
        changing={} if air is None else {air: AIR_CHANGES},
        rows_of=lambda change: change.oil.get(i, nothing).T.ravel(),
    )


def noise_of(oil: Oil, time_s: Array, scale: Scale) -> Array:
    """Covariance (2 n, 2 n) of the group's rows, m6/s2, beside what tolerances make, of a machine
    of this size.
    """
    n = len(time_s)
    apart = np.abs(time_s[:, None] - time_s[None, :])
    flows = scale.times("m3/s")
    lasts = np.exp(-apart / (MEMORY_S * scale.times("s")))
    out = np.eye(2 * n) * (flows * WHITE_M3_S) ** 2
    size = VALVE_SHARE * np.abs(oil.from_supply + oil.to_tank)
    size = np.hypot(size, flows * VOID_M3_S * oil.void)
    size = np.sqrt(size**2 + oil.by_pressure**2 + (COMPRESSED_SHARE * oil.compressed) ** 2)
    off = SPOOL_OFF * oil.by_spool
    long = np.exp(-apart / (SUCKED_S * scale.times("s")))
    full = (oil.pressure_pa - SUCKED_PA) / (NOT_SUCKED_PA - SUCKED_PA)
    sucked = flows * SUCKED_M3_S * (1.0 - np.clip(full, 0.0, 1.0))
    for k in range(2):
        own = slice(k * n, (k + 1) * n)
        out[own, own] += lasts * np.outer(size[:, k], size[:, k])
        out[own, own] += long * np.outer(sucked[:, k], sucked[:, k])
        out[own, own] += of_shared_edges(oil.flickers[:, k])
    both = off.T.ravel()
    out += np.tile(lasts, (2, 2)) * np.outer(both, both)
    return np.asarray(out + swept(oil.swept_m2, rounded(oil.rounding_m, time_s)))
