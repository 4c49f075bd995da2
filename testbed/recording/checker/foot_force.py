"""The force of one foot against its own scale and its contact."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from testbed.recording.checker.finding import Finding
from testbed.recording.checker.raw import Raw
from testbed.recording.foot import FootHeader

AIR = 0.12
"""Share of the strong forces that a foot may read in the air, from friction or a zero (E)."""
NEAR_LOAD = 0.1, 8.0
"""Shares of the nominal load between which strong forces may lie: one foot carries at
most the whole machine, for longer than a blow.
"""


def check_foot(raw: Raw, header: FootHeader) -> Iterator[Finding]:
    """Sign and scale of the force, and what it reads where the contact says that the foot does not
    carry.
    """
    force = raw.series["force"]
    strong = float(np.quantile(np.abs(force), 0.95))
    if strong and float(np.median(force[np.abs(force) > 0.3 * strong])) < 0.0:
        yield Finding(
            "error",
            "force",
            "its sign is turned round",
            f"most strong forces are negative, 95 % within {strong:.4g} N",
            "turn its sign: + is pressed on the ground",
        )
    nominal = header.known.nominal_load_n
    if nominal is not None and not NEAR_LOAD[0] < strong / nominal < NEAR_LOAD[1]:
        yield Finding(
            "error",
            "force",
            "has another scale than the nominal load",
            f"95 % within {strong:.4g} N, nominal load {nominal:g} N",
            "declare the unit that the column is in (kN?)",
        )
    contact = raw.series.get("contact")
    if contact is not None and len(np.unique(contact)) == 2:
        loaded, lifted = force[contact == contact.max()], force[contact == contact.min()]
        if abs(np.mean(loaded)) < abs(np.mean(lifted)):
            yield Finding(
                "error",
                "contact",
                "is turned round",
                f"{np.mean(loaded):.4g} N where it carries, {np.mean(lifted):.4g} N where it does not",
                "exchange its two values: the larger one means that the foot carries",
            )
        elif (in_air := float(np.median(np.abs(lifted)))) > AIR * strong:
            yield Finding(
                "warning",
                "force",
                "reads a load in the air",
                f"{in_air:.4g} N where the contact says that it does not carry, 95 % within "
                f"{strong:.4g} N",
                "take its zero off, or declare known.breakaway_n where friction holds so much: a "
                "detector may miss what it does not expect",
            )
