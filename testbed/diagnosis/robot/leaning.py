"""Which way stuck seals lean: what a piston that stands still, or creeps too slowly to be seen
sliding, last did.

The contact of a seal bends over some hundredths of a millimetre and is renewed by more. So a piston
whose encoder has just gone on by a count has its friction against that way, however slow it was,
and keeps it while it stands. A count against the way before may be any part of one: it may have
turned the contact round or just unbent it. A load that changes meanwhile bends the contact
unseen, the more the larger it is beside the friction. Rotation joints have play between piston
and encoder, of many times what a contact bends: theirs do not show.
"""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
import numpy.typing as npt

from testbed.formats.arrays import Flags
from testbed.machine.names import AXES
from testbed.robot.robot import Robot

Array = npt.NDArray[np.float64]
THINNED_S = 0.01
"""Readings are means over this long."""
FORGOTTEN_BY = 1.0
"""A change of the piston's force by so many times its dry friction leaves 1/e of the lean (B: in
three walks, a sway and a drilling of drawn machines 3 foretells as well, but errs where it is sure
while drilling).
"""


def leaning_of(data: Mapping[str, Array], period_s: float, robot: Robot) -> list[Array]:
    """Sense, -1 to 1, that the friction of each piston of a recording would have at rest, AXES
    order, (samples,) each.
    """
    machine, width = robot.machine, max(round(THINNED_S / period_s), 1)
    samples = len(data["t"])
    starts = np.arange(0, samples, width)

    def thinned(stem: str) -> Array:
        columns = [np.asarray(data[f"{stem}_{axis}"], dtype=float) for axis in AXES]
        rows = np.diff(np.append(starts, samples))
        return np.column_stack([np.add.reduceat(column, starts) / rows for column in columns])

    axes = machine.axes.values()
    area_a, area_b = np.array([a.cylinder.areas_m2 for a in axes]).T
    force = thinned("pressure_a") * area_a - thinned("pressure_b") * area_b
    dry = np.array([a.cylinder.coulomb_out_n + a.cylinder.static_out_n for a in axes])
    counts = np.array([a.encoder_count for a in axes])
    changed = np.abs(np.diff(force, axis=0)) / (FORGOTTEN_BY * dry)
    leans = leant(np.diff(thinned("position"), axis=0) / counts, np.exp(-changed))
    return list((np.repeat(leans, width, axis=0)[:samples] * ~leans_hidden()).T)


def leans_hidden() -> Flags:
    """(12,) of the pistons, AXES order: whether play between piston and encoder hides which way
    their seals lean.
    """
    return np.array([axis.endswith("rotation") for axis in AXES])


def leant(steps: Array, kept: Array) -> Array:
    """(n + 1, k) sense of friction after each of n steps (n, k), in counts of the encoder, of which
    the share `kept` (n, k) of what was before is left; it begins with none.
    """
    out = np.zeros((len(steps) + 1, steps.shape[1]))
    for k in range(len(steps)):
        out[k + 1] = np.clip(kept[k] * out[k] + steps[k], -1.0, 1.0)
    return out
