"""The paper's chain, live on all four feet: pressures -> cylinder force -> foot load -> filters -> contact word.

    one_chamber  = pA A_A                                                                   (1)
    two_chamber  = pA A_A - pB A_B                                                          (3)
    friction     = pA A_A - pB A_B - F_f(v) + m g cos(inclination) - m a                    (7) with (5)
    kbf, modified_kbf = the paper's filters on `friction`                                   (6)
    own          = the same balance with friction as a set at rest (friction_at_rest.py names the likeliest value in
                   it), through a gate that cannot lock out; where the whole machine is believed (body_belief.py), from
                   all twelve cylinders and the body's balance (own_kernel.py), with the foot's force in three axes

All in N along the vertical joint's axis, positive when the ground pushes the foot up. One compiled call a step.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence

import numpy as np
from numpy.typing import NDArray

from testbed.errors import InputError
from testbed.estimation.detectors.table import BEST, by_name
from testbed.estimation.live.believed import Believed
from testbed.estimation.live.chain_kernel import (
    METHODS,
    OIL,
    OUTPUTS,
    STATE_COLUMNS,
    SUPPLY,
    replay_chain,
    step_chain,
)
from testbed.estimation.live.own_kernel import STATE_SIZE
from testbed.laws.drill import KNOWN, KNOWN_COLUMNS
from testbed.machine.names import AXES, LEGS, SIDES

Array = NDArray[np.float64]
COLUMNS: tuple[str, ...] = tuple(
    f"{'estimate_' if name in METHODS else ''}{name}_{leg}" for name in OUTPUTS for leg in LEGS
)
"""Names of a flattened output row: `estimate_one_chamber_fl`, .., `own_low_fl`, .., `velocity_rr`, .., `contact_rr`."""

_NOUGHT, _ALL = np.zeros(6), np.ones(len(LEGS))


def gravity_in_body(
    roll_rad: float, pitch_rad: float, yaw_rad: float = 0.0, g_m_s2: float = 9.81
) -> Array:
    """Gravity's vector [3] in the body frame, m/s2, for rotation_body_to_world = Rz(yaw) Ry(pitch) Rx(roll).

    -g times the last row of that matrix; yaw has no part in it. On a slope that rises towards +x pitch < 0.
    """
    del yaw_rad
    c = math.cos(pitch_rad)
    up = (-math.sin(pitch_rad), c * math.sin(roll_rad), c * math.cos(roll_rad))
    return -g_m_s2 * np.array(up)


class EstimatorChain:
    """The estimators of a run: `step` once per control period, results in `output` (and, flat, in `row`).

    `output[i, leg]`, i in the order of OUTPUTS, is overwritten at every step and never reallocated.
    """

    def __init__(self, believed: Believed) -> None:
        t, self.believed = believed.tuning, believed
        self._legs = np.array([leg.packed() for leg in believed.legs])
        self._common = np.array(
            [
                believed.dt_s,
                believed.encoder_resolution_m,
                t.observer_rad_s,
                t.rest_m_s,
                t.slide_m_s,
                t.pressure_sd_pa,
                t.friction_sd_share,
                t.speed_sd_m_s,
                t.acceleration_sd_m_s2,
                20.0,
                t.kbf_q_n2,
                t.kbf_r_n2,
                t.e_max_n,
                t.hold_samples,
                t.contact_on_n,
                t.contact_off_n,
                t.contact_dwell_s,
                t.lost_dwell_s,
                believed.supply_pa,
                *by_name(BEST).numbers[:-1],
                believed.dt_s,
                *believed.valve,
            ]
        )
        self._state = np.zeros((len(LEGS), STATE_COLUMNS))
        self._body, self._own = believed.body, np.zeros(STATE_SIZE)
        self.output = np.zeros((len(OUTPUTS), len(LEGS)))
        self.row = self.output.reshape(-1)

    @property
    def arrays(self) -> tuple[Array, ...]:
        """Packed legs, common numbers, state, body, its state and output, for a compiled caller of `step_chain`."""
        return self._legs, self._common, self._state, self._body, self._own, self.output

    def forget(self) -> None:
        """Forget everything seen so far, but for the last output."""
        self._state[:] = 0.0
        self._own[:] = 0.0

    def reset(self) -> None:
        """Forget everything seen so far."""
        self.forget()
        self.output[:] = 0.0

    def step(
        self,
        pressure_a_pa: Array,
        pressure_b_pa: Array,
        position: Array,
        gravity_in_body_m_s2: Array,
        valve_command: Array,
        oil_temperature_degc: float = 20.0,
        rope_tension_n: Array = _NOUGHT[:2],
        attitude_rad: Array = _NOUGHT[:3],
        inertial: Array = _NOUGHT,
        carrying: Array = _ALL,
        drill_known: Array = _NOUGHT[:KNOWN],
        supply_pressure_pa: float | None = None,
    ) -> Array:
        """One period. Pressures (Pa, gauge), encoder readings (m, rad) and commands (1) are [12] by axis.

        Gravity is [3] in the body frame, m/s2; rope tensions [2] N, roll, pitch, yaw [3], the body's angular rate and
        specific force [6] rad/s, m/s2, which feet are meant to carry [4] and what the drill's controls know
        [KNOWN, laws/drill.py] serve the body's balance, where one is believed. Returns `output`
        [len(OUTPUTS), 4], the chain's own array.
        """
        self._common[OIL] = oil_temperature_degc
        self._common[SUPPLY] = (
            self.believed.supply_pa if supply_pressure_pa is None else supply_pressure_pa
        )
        step_chain(
            pressure_a_pa,
            pressure_b_pa,
            position,
            gravity_in_body_m_s2,
            valve_command,
            rope_tension_n,
            attitude_rad,
            inertial,
            carrying,
            drill_known,
            self._legs,
            self._common,
            self._state,
            self._body,
            self._own,
            self.output,
        )
        return self.output

    def method(self, name: str) -> Array:
        """A view of one output's four legs, e.g. `method("own")`. Raises InputError for an unknown name."""
        if name not in OUTPUTS:
            raise InputError(
                "no such estimate", field="method", value=name, allowed=", ".join(OUTPUTS)
            )
        view: Array = self.output[OUTPUTS.index(name)]
        return view


def replay(columns: Mapping[str, Array], believed: Believed) -> dict[str, Array]:
    """The chain over the whole-robot recording's columns (n rows each): every name of COLUMNS -> array [n].

    Needs `position_*`, `pressure_a_*`, `pressure_b_*` of the vertical joints and `attitude_roll`, `attitude_pitch`;
    takes `valve_*`, `oil_temperature`, `rope_tension_*`, `attitude_yaw`, `carrying_*`, `ordered_*` and `rods_*` where
    they are there.
    Raises InputError naming the column that is missing.
    """
    pa, pb, q = (_by_axis(columns, stem) for stem in ("pressure_a", "pressure_b", "position"))
    u = (
        _by_axis(columns, "valve")
        if any(f"valve_{leg}_vertical" in columns for leg in LEGS)
        else np.zeros_like(q)
    )
    roll, pitch = _column(columns, "attitude_roll"), _column(columns, "attitude_pitch")
    g = believed.gravity_m_s2 * np.cos(pitch)
    gravity = np.stack(
        [believed.gravity_m_s2 * np.sin(pitch), -g * np.sin(roll), -g * np.cos(roll)], axis=1
    )
    temperature = np.ascontiguousarray(columns.get("oil_temperature", np.full(len(roll), 20.0)))
    supply = np.ascontiguousarray(
        columns.get("supply_pressure", np.full(len(roll), believed.supply_pa))
    )
    chain = EstimatorChain(believed)
    out = np.empty((len(roll), len(OUTPUTS), len(LEGS)))
    n = len(roll)
    zeros, ones = np.zeros(n), np.ones(n)
    rope = _stacked(columns, [f"rope_tension_{side}" for side in SIDES], zeros)
    attitude = np.column_stack([roll, pitch, columns.get("attitude_yaw", zeros)])
    carrying = _stacked(columns, [f"carrying_{leg}" for leg in LEGS], ones)
    drill = _stacked(columns, KNOWN_COLUMNS, zeros)
    inertial = np.hstack([_stacked(columns, [f"angular_rate_{k}" for k in "xyz"], zeros), -gravity])
    if "specific_force_x" in columns:
        inertial[:, 3:] = _stacked(columns, [f"specific_force_{k}" for k in "xyz"], zeros)
    replay_chain(
        pa,
        pb,
        q,
        gravity,
        u,
        temperature,
        supply,
        rope,
        attitude,
        inertial,
        carrying,
        drill,
        *chain.arrays[:-1],
        out,
    )
    flat = out.reshape(len(roll), -1)
    return {name: np.ascontiguousarray(flat[:, i]) for i, name in enumerate(COLUMNS)}


def forces(columns: Mapping[str, Array], believed: Believed) -> dict[str, Array]:
    """`t`, and per leg `force_<leg>_n` with `_low` and `_high`: what `testbed estimate` writes of a robot recording."""
    estimates = replay(columns, believed)
    out = {"t": np.asarray(_column(columns, "t"))}
    for leg in LEGS:
        out[f"force_{leg}_n"] = estimates[f"estimate_own_{leg}"]
        out[f"force_{leg}_n_low"] = estimates[f"own_low_{leg}"]
        out[f"force_{leg}_n_high"] = estimates[f"own_high_{leg}"]
    return out


def _column(columns: Mapping[str, Array], name: str) -> Array:
    if name not in columns:
        raise InputError("the recording has no such column", field=name)
    return columns[name]


def _stacked(columns: Mapping[str, Array], names: Sequence[str], default: Array) -> Array:
    """[n, len(names)]; a column that is missing is `default`."""
    return np.column_stack([columns.get(name, default) for name in names])


def _by_axis(columns: Mapping[str, Array], stem: str) -> Array:
    """[n, 12]; only the vertical joints are asked for, the others are filled with zeros where they are missing."""
    first = _column(columns, f"{stem}_{LEGS[0]}_vertical")
    out = np.zeros((len(first), len(AXES)))
    for i, axis in enumerate(AXES):
        name = f"{stem}_{axis}"
        if name in columns or axis.endswith("_vertical"):
            out[:, i] = _column(columns, name)
    return out
