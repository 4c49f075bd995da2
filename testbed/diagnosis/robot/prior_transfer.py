"""How far what an earlier recording shows of a machine's oil and valves holds in another one.

A sway asks valves and oil for the same things as a walk; where a machine stands and drills, spools
lie in their overlaps and seep, and what a walk showed of them says little. A recording shows that
by itself: where what is recalled holds, all twelve cylinders miss as little as they then may. Each
cylinder is told it by the eleven others, so that what is hidden in one of them is not taken for
something that was forgotten.
"""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
from scipy.linalg import solve_triangular

from testbed.diagnosis.robot.evidence import RawGroup
from testbed.formats.arrays import Array

SHARES = (0.1, 0.2, 0.4, 0.7, 1.0)
"""Shares of its tolerances of which one is what remains of them beside what is recalled: of nine
walks and ten sways of sound machines all show the least, of ten drillings seven the most (B).
"""
MOST_SAID = 5.0
"""Ln of the likelihood by which one cylinder may speak against a share (E)."""


def shares(now: Mapping[str, RawGroup], sound: Mapping[str, RawGroup]) -> dict[str, float]:
    """Group -> the share by what the others of these groups show; `sound`: the same groups in an
    earlier recording.
    """
    names = [name for name in now if name in sound]
    if len(names) < 2:
        return {}
    said = np.array([_likelihoods(now[name], sound[name]) for name in names])
    said = np.maximum(said - said.max(axis=1, keepdims=True), -MOST_SAID)
    others = said.sum(axis=0) - said
    return {name: SHARES[int(np.argmax(row))] for name, row in zip(names, others, strict=True)}


def _likelihoods(now: RawGroup, sound: RawGroup) -> Array:
    """Ln of the likelihood of a group by each share."""
    out = []
    for share in SHARES:
        group = now.knowing(sound, share)
        root = group.root()
        white = solve_triangular(root, group.missing, lower=True)
        out.append(-0.5 * float(white @ white) - float(np.log(np.diag(root)).sum()))
    return np.array(out)
