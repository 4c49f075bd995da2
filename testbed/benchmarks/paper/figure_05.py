"""Figure 5: the robot raised in steps from its belly, chamber A of every vertical joint alone."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from testbed.benchmarks.estimators.identification_trials import KNOWN
from testbed.benchmarks.paper.experiment import Line, Result
from testbed.benchmarks.paper.figure_04 import K_PA_PER_V
from testbed.benchmarks.paper.figure_06 import at_the_cell
from testbed.benchmarks.paper.leg import chosen
from testbed.formats.arrays import Array
from testbed.formats.checked import checked
from testbed.machine.names import LEGS
from testbed.scenario.scenario import Scenario
from testbed.world.simulation import Simulation

RECORD_HZ = 50
START_S, EVERY_S, STEP_M, STEPS, SPEED_M_S = 2.0, 12.0, 0.05, 3, 0.03
BELLY_M = 0.02
"""With the joints retracted the belly rests 20 mm below the feet's undersides."""
VARIANTS: tuple[tuple[str, tuple[str, ...]], ...] = (
    ("all parts", ()),
    ("no edge leakage", ("edge_leakage",)),
    ("no holding valves", ("load_holding",)),
    ("no piston leakage", ("internal_leakage",)),
    ("no leakage at all", ("leakage",)),
    ("no hose", ("hose",)),
)


@dataclass(frozen=True)
class Raised:
    """One run: sums over the legs; `one_n` is (1) with b = 0, errors of the positions in m."""

    time_s: Array
    one_n: Array
    two_n: Array
    true_n: Array
    position_m: Array
    reference_m: Array
    area_a_m2: float


def scenario(without: Sequence[str] = (), changes: Mapping[str, float] | None = None) -> Scenario:
    """The robot on its belly on even ground, without ropes; three steps of 50 mm, the first lifts
    it off.
    """
    return checked(
        Scenario,
        {
            "format": "roboclimber-scenario/1",
            "name": "raise-in-steps",
            "duration_s": START_S + STEPS * EVERY_S,
            "rates": {"record_hz": RECORD_HZ, "expected_loads_hz": 1},
            "robot": {"vertical_m": 0.0, "height_offset_m": BELLY_M},
            "ropes": {"enabled": False},
            "hydraulics": {
                "oil_temperature_degc": 20.0,
                "without": list(without),
                "parameters": dict(chosen().changes) | dict(changes or {}),
            },
            "machine": {"set": chosen().of_set},
            "sensors": {"thermal_drift": False},
            "task": {
                "kind": "raise",
                "start_s": START_S,
                "to_m": STEPS * STEP_M,
                "step_m": STEP_M,
                "every_s": EVERY_S,
                "speed_m_s": SPEED_M_S,
            },
        },
        "figure 5",
    )


def raised(without: Sequence[str] = (), changes: Mapping[str, float] | None = None) -> Raised:
    """Run it with `changes` of roboclimber.yaml. Raises SimulationFault where the world breaks
    down.
    """
    simulation = Simulation(scenario(without, changes))
    try:
        data, truth = simulation.run_block(round((START_S + STEPS * EVERY_S) * RECORD_HZ))
    finally:
        simulation.close()
    of = {column: data[:, index] for index, column in enumerate(simulation.data_columns)}
    true = {column: truth[:, index] for index, column in enumerate(simulation.truth_columns)}
    return Raised(
        of["t"],
        np.sum([of[f"estimate_one_chamber_{leg}"] for leg in LEGS], axis=0),
        np.sum([of[f"estimate_two_chamber_{leg}"] for leg in LEGS], axis=0),
        np.sum([true[f"foot_load_{leg}"] for leg in LEGS], axis=0),
        np.column_stack([of[f"position_{leg}_vertical"] for leg in LEGS]),
        np.column_stack([of[f"reference_{leg}_vertical"] for leg in LEGS]),
        KNOWN.area_a_m2,
    )


def holds(run: Raised) -> list[slice]:
    """The rest after each step, from 0.5 s after the set point stands to just before the next
    step.
    """
    out = []
    for index in range(STEPS):
        first = START_S + index * EVERY_S + STEP_M / SPEED_M_S + 0.5
        out.append(
            slice(*np.searchsorted(run.time_s, (first, START_S + (index + 1) * EVERY_S - 0.1)))
        )
    return out


def drift_n(force_n: Array, hold: slice) -> float:
    """Change over a hold, N: mean of its last second less mean of its first half second; negative:
    it decays.
    """
    part = force_n[hold]
    return float(part[-RECORD_HZ:].mean() - part[: RECORD_HZ // 2].mean())


def half_time_s(force_n: Array, hold: slice) -> float:
    """Time until half of the change over a hold is done, s (0.3 s mean)."""
    part = np.convolve(force_n[hold], np.ones(15) / 15.0, "valid")
    change = part - part[0]
    return float(np.argmax(np.abs(change) >= 0.5 * abs(change[-1]))) / RECORD_HZ


def approach(run: Raised, gain: float, shift_n: float) -> float:
    """Error of the calibrated one-chamber sum at the end of a hold over that at its start (means
    over the holds).
    """
    error = [gain * run.one_n[hold] + shift_n - run.true_n[hold] for hold in holds(run)]
    first = float(np.mean([abs(wrong[: RECORD_HZ // 2].mean()) for wrong in error]))
    return float(np.mean([abs(wrong[-RECORD_HZ:].mean()) for wrong in error])) / first


def experiment() -> Result:
    """The raise, and the same with one part of the hydraulics left out at a time."""
    runs = {name: raised(without) for name, without in VARIANTS}
    run, line = runs["all parts"], at_the_cell()
    shift = len(LEGS) * line.b * K_PA_PER_V * run.area_a_m2
    rows = [_row(name, run_, line.a, shift) for name, run_ in runs.items()]
    rests = holds(run)
    drift = float(np.mean([drift_n(line.a * run.one_n, rest) for rest in rests]))
    still = max(float(np.abs(run.position_m[rest] - run.reference_m[rest]).max()) for rest in rests)
    weight = float(run.true_n[rests[-1]].mean())
    return Result(
        {
            "held": still,
            "decay": drift / weight,
            "half_time": float(np.mean([half_time_s(line.a * run.one_n, hold) for hold in rests])),
            "approach": approach(run, line.a, shift),
        },
        {
            "sums": _sums(run, line.a, shift),
            "position": [
                Line(run.time_s, run.position_m[:, 0] * 1e3, "encoder"),
                Line(run.time_s, run.reference_m[:, 0] * 1e3, "set point", 3, "--"),
            ],
            "left_out": [
                _sums(raise_, line.a, shift, name, colour)[0]
                for colour, (name, raise_) in enumerate(runs.items())
            ],
        },
        {"holds": rows},
        {"steps": STEPS, "step_mm": STEP_M * 1e3, "every_s": EVERY_S, "weight_n": weight},
    )


def _row(name: str, run: Raised, gain: float, shift_n: float) -> list[str]:
    rests = holds(run)
    error = [gain * run.one_n[rest] + shift_n - run.true_n[rest] for rest in rests]
    numbers = (
        f"{np.mean([drift_n(gain * run.one_n, rest) for rest in rests]):+.0f}",
        f"{np.mean([half_time_s(gain * run.one_n, rest) for rest in rests]):.1f}",
        f"{np.mean([drift_n(run.two_n, rest) for rest in rests]):+.0f}",
        f"{np.mean([wrong[: RECORD_HZ // 2].mean() for wrong in error]):+.0f}",
        f"{np.mean([wrong[-RECORD_HZ:].mean() for wrong in error]):+.0f}",
    )
    return [name, *numbers]


def _sums(
    run: Raised, gain: float, shift_n: float, name: str = "chamber A (1)", colour: int = 0
) -> list[Line]:
    """Sums over the legs once the robot is off the ground."""
    up = run.time_s > START_S + STEP_M / SPEED_M_S
    time_s = run.time_s[up]
    return [
        Line(time_s, ((gain * run.one_n + shift_n) / 1e3)[up], name, colour),
        Line(time_s, run.two_n[up] / 1e3, "both chambers (3)", 2),
        Line(time_s, run.true_n[up] / 1e3, "true load of the feet", 3, "--"),
    ]
