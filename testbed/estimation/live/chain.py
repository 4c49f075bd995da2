"""The paper's chain, live on all four feet: pressures -> cylinder force -> foot load -> filters ->
contact state.

    one_chamber  = pA A_A                                                                   (1)
    two_chamber  = pA A_A - pB A_B                                                          (3)
    friction     = pA A_A - pB A_B - F_f(v) + m g cos(inclination) - m a                    (7) with
    (5) kbf, modified_kbf = the paper's filters on `friction`                                   (6)
    own          = the same balance with friction as a set at rest (friction_at_rest.py names the
    likeliest value in
                   it), through a gate that cannot lock out; where the whole machine is believed
                   (body_belief.py), from all twelve cylinders and the body's balance
                   (whole_body.py), with the foot's force in three axes

All in N along the vertical joint's axis, positive when the ground pushes the foot up. One compiled
call a step, on the row that has just been measured.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray

from testbed.errors import InputError
from testbed.estimation.detectors.combined import CombinedNumbers, Held
from testbed.estimation.filters import persistent
from testbed.estimation.live.believed import Believed
from testbed.estimation.live.chain_step import ChainBelief, ChainState, replay_chain
from testbed.estimation.live.contact import limits_at
from testbed.formats.arrays import Array
from testbed.formats.records import from_columns
from testbed.machine.names import LEGS
from testbed.recording.rows import DataRow

OIL_DEGC = 20.0
"""The oil's temperature where it is not recorded."""
NEEDED = (
    *(
        f"{stem}_{leg}_vertical"
        for stem in ("position", "pressure_a", "pressure_b")
        for leg in LEGS
    ),
    "attitude_roll",
    "attitude_pitch",
)
"""Columns without which nothing can be estimated."""


class EstimatorChain:
    """The estimators of a run: `step` once per control period, on the running row.

    `belief` (ChainBelief) and `state` (ChainState), both of shape (1,), serve a compiled caller of
    `step_chain`.
    """

    def __init__(self, believed: Believed) -> None:
        self.believed, self.belief = believed, belief_of(believed)
        self.state = ChainState.zeros()

    def forget(self) -> None:
        """Forget everything seen so far."""
        self.state[:] = 0

    def step(self, rows: NDArray[Any]) -> None:
        """One period: fill the estimates of DataRow `rows` (1,) from what is measured there."""
        replay_chain(rows, self.belief, self.state)


def belief_of(believed: Believed) -> NDArray[Any]:
    """What the compiled step believes: one record `ChainBelief`, shape (1,)."""
    t, out = believed.tuning, ChainBelief.zeros()
    belief = out[0]
    belief["dt"], belief["gravity"] = believed.dt_s, believed.gravity_m_s2
    belief["encoder_resolution"] = believed.encoder_resolution_m
    belief["observer"] = t.observer_rad_s
    belief["rest_speed"], belief["slide_speed"] = t.rest_m_s, t.slide_m_s
    belief["pressure_sd"], belief["friction_share"] = t.pressure_sd_pa, t.friction_sd_share
    belief["speed_sd"], belief["acceleration_sd"] = t.speed_sd_m_s, t.acceleration_sd_m_s2
    belief["filter"] = persistent.Numbers.one(
        process_variance=t.kbf_q_n2,
        measurement_variance=t.kbf_r_n2,
        innovation_limit=t.e_max_n,
        hold_samples=t.hold_samples,
    )[0]
    belief["contact"] = limits_at(-t.contact_off_n, t.contact_hold)[0]
    numbers = Held.numbers | {"break_away": t.break_away_n}
    belief["combined"] = CombinedNumbers.one(**numbers)[0]
    belief["legs"]["linkage"] = believed.linkages
    for record, leg, valve in zip(belief["legs"], believed.legs, believed.valves, strict=True):
        leg.write(record["cylinder"])
        record["valve"] = valve
        record["mass"] = leg.moving_mass_kg
    if believed.body is not None:
        belief["body"] = believed.body[0]
    return out


def rows_of(columns: Mapping[str, Array], believed: Believed) -> NDArray[Any]:
    """A whole-robot recording's columns (n rows each) as DataRow records (n,), without estimates.

    Needs NEEDED, and the valve commands of all legs or of none; takes oil temperature, supply
    pressure, ropes, rates, stance and what the drill's controls know where they are there. Raises
    InputError naming the column that is missing.
    """
    valves = tuple(f"valve_{leg}_vertical" for leg in LEGS)
    for name in NEEDED + (valves if any(valve in columns for valve in valves) else ()):
        if name not in columns:
            raise InputError("the recording has no such column", field=name)
    measured = {name: values for name, values in columns.items() if name not in ESTIMATED}
    rows = from_columns(
        DataRow,
        measured,
        len(columns["attitude_roll"]),
        oil_temperature=OIL_DEGC,
        supply_pressure=believed.supply_pa,
        carrying=1.0,
    )
    if "specific_force_x" not in columns:  # at rest
        roll, pitch = rows["attitude"][:, 0], rows["attitude"][:, 1]
        along = believed.gravity_m_s2 * np.cos(pitch)
        rows["specific_force"][:, 0] = -believed.gravity_m_s2 * np.sin(pitch)
        rows["specific_force"][:, 1] = along * np.sin(roll)
        rows["specific_force"][:, 2] = along * np.cos(roll)
    return rows


def replay_rows(columns: Mapping[str, Array], believed: Believed) -> NDArray[Any]:
    """The chain over a recording's columns: DataRow records (n,) with every estimate. Raises as
    `rows_of`.
    """
    rows, chain = rows_of(columns, believed), EstimatorChain(believed)
    replay_chain(rows, chain.belief, chain.state)
    return rows


def replay(columns: Mapping[str, Array], believed: Believed) -> dict[str, Array]:
    """`replay_rows` as columns by name: what the chain fills of a recording."""
    table = DataRow.as_table(replay_rows(columns, believed))
    return {
        name: np.ascontiguousarray(table[:, k])
        for k, name in enumerate(DataRow.column_names())
        if name in ESTIMATED
    }


ESTIMATED = frozenset(
    name for name in DataRow.column_names() if name.startswith(("estimate_", "own_", "contact_"))
)
"""Columns that the chain fills."""


def forces(columns: Mapping[str, Array], believed: Believed) -> dict[str, Array]:
    """`t`, and per leg `force_<leg>_n` with `_low` and `_high`: what `testbed estimate` writes of a
    robot recording.
    """
    if "t" not in columns:
        raise InputError("the recording has no such column", field="t")
    estimates = replay(columns, believed)
    out = {"t": np.asarray(columns["t"])}
    for leg in LEGS:
        out[f"force_{leg}_n"] = estimates[f"estimate_own_{leg}"]
        out[f"force_{leg}_n_low"] = estimates[f"own_low_{leg}"]
        out[f"force_{leg}_n_high"] = estimates[f"own_high_{leg}"]
    return out
