"""A made-up run with the columns of a true one and known answers, for tests of what reads runs."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import numpy.typing as npt

from testbed.estimation.contact_losses import LossRule
from testbed.machine.names import AXES, LEGS, SIDES
from testbed.simulation.metrics import run_metrics
from testbed.simulation.recorder import RunRecorder, write_summary

METHODS = ("one_chamber", "two_chamber", "friction", "kbf", "modified_kbf")
SLOPE_DEG = 45.0
RMS_N = {
    "one_chamber": 900.0,
    "two_chamber": 250.0,
    "friction": 120.0,
    "kbf": 90.0,
    "modified_kbf": 110.0,
}


def synthetic_columns(
    duration_s: float, gain_error_fl: float = 0.0
) -> tuple[dict[str, npt.NDArray[np.float64]], ...]:
    """Data and truth of a drill run at 1 kHz: feed from 20 to 80 % of the time, fr off the ground 1
    s at half time.
    """
    rng = np.random.default_rng(5)
    t = np.arange(round(duration_s * 1000)) / 1000.0
    drilling = (t > 0.2 * duration_s) & (t < 0.8 * duration_s)
    feed = np.where(drilling, 5500.0 + 1500.0 * np.abs(np.sin(2 * np.pi * 15 * t)) ** 8, 0.0)
    lifted = (t >= 0.5 * duration_s) & (t < 0.5 * duration_s + 1.0)
    data: dict[str, npt.NDArray[np.float64]] = {"t": t}
    truth: dict[str, npt.NDArray[np.float64]] = {"t": t}
    for k, axis in enumerate(AXES):
        data[f"position_{axis}"] = np.round(0.2 + 0.002 * np.sin(0.3 * t + k), 4)
        data[f"pressure_a_{axis}"] = (
            2.5e6 + 5e5 * np.sin(0.2 * t + k) + 2e4 * rng.normal(size=len(t))
        )
        data[f"pressure_b_{axis}"] = (
            1.5e6 + 3e5 * np.cos(0.2 * t + k) + 2e4 * rng.normal(size=len(t))
        )
        data[f"valve_{axis}"] = 0.05 * np.sin(t + k)
        truth[f"friction_{axis}"] = 300.0 * np.sign(np.sin(0.3 * t + k))
    data |= {
        "supply_pressure": 1.5e7 + 1e5 * rng.normal(size=len(t)),
        "oil_temperature": 40.0 + 0.0 * t,
    }
    for side in SIDES:
        tension = 13000.0 + 800.0 * np.sin(0.1 * t) - 0.1 * feed
        truth |= {
            f"rope_force_in_world_{side}_{i}": v * tension
            for i, v in zip("xyz", (0.7, 0.14, 0.7), strict=True)
        }
        data[f"rope_tension_{side}"] = tension + 60.0 * rng.normal(size=len(t))
    for name in (
        "attitude_roll",
        "attitude_pitch",
        "attitude_yaw",
        *(f"angular_rate_{i}" for i in "xyz"),
    ):
        data[name] = 0.002 * rng.normal(size=len(t)) - (
            np.deg2rad(SLOPE_DEG) if name.endswith("pitch") else 0.0
        )
    for k, leg in enumerate(LEGS):
        load = 6900.0 + 300.0 * np.sin(0.15 * t + k) - feed / 4
        load = np.where(lifted & (leg == "fr"), 0.0, load)
        truth[f"foot_load_{leg}"] = truth[f"contact_normal_{leg}"] = load
        truth |= {
            f"foot_force_in_world_{leg}_{i}": v * load
            for i, v in zip("xyz", (-0.7, 0.0, 0.7), strict=True)
        }
        gain = gain_error_fl if leg == "fl" else 0.0
        for method in METHODS:
            data[f"estimate_{method}_{leg}"] = (1 + gain) * load + RMS_N[method] * np.sin(
                1.3 * t + k
            ) * np.sqrt(2)
        data[f"expected_{leg}"] = load + 50.0 * (-1) ** (leg in ("fr", "rl"))
        late = np.concatenate([np.zeros(30), lifted & (leg == "fr")])[: len(t)]
        data[f"contact_{leg}"] = 1.0 - late
        data[f"carrying_{leg}"] = np.ones_like(t)
    half = np.deg2rad(SLOPE_DEG) / 2
    pose = {
        "x": 0.0 * t,
        "y": 0.0 * t,
        "z": 0.8 + 0.0 * t,
        "qx": 0 * t,
        "qy": -np.sin(half) + 0 * t,
        "qz": 0 * t,
        "qw": np.cos(half) + 0 * t,
    }
    truth |= {f"body_pose_in_world_{name}": values for name, values in pose.items()}
    wrench = {
        "fx": -0.7071 * feed,
        "fy": 0 * t,
        "fz": 0.7071 * feed,
        "tx": 0 * t,
        "ty": 0 * t,
        "tz": -0.09 * feed,
    }
    truth |= {f"drill_wrench_in_world_{name}": values for name, values in wrench.items()}
    return data, truth


def write_synthetic_run(folder: Path, duration_s: float = 60.0, gain_error_fl: float = 0.0) -> Path:
    """A finished run folder made of `synthetic_columns`."""
    data, truth = synthetic_columns(duration_s, gain_error_fl)
    meta = {
        "format": "roboclimber-recording/1",
        "rig": "robot",
        "data": "data.parquet",
        "sample_rate_hz": 1000,
    }
    recorder = RunRecorder(folder, list(data), list(truth), meta)
    rows = np.column_stack(list(data.values())), np.column_stack(list(truth.values()))
    for start in range(0, len(rows[0]), 1000):
        recorder.write(rows[0][start : start + 1000], rows[1][start : start + 1000])
    recorder.finish()
    summary = {
        "format": "roboclimber-summary/1",
        "scenario": "drill_slope_45",
        "seed": 1,
        "verdict": "stood",
        "description": "On a 45 degree slope, held by two ropes, drilling.",
        "slope_deg": SLOPE_DEG,
        "task": "drill",
        "interrupted": False,
        "planned_s": duration_s,
        "simulated_s": duration_s,
        "wall_s": 9.3,
        "undeclared": [],
        "events": [
            {"t": 0.2 * duration_s, "kind": "hammer"},
            {"t": 0.5 * duration_s, "kind": "contact_lost", "leg": "fr"},
            {"t": 0.8 * duration_s, "kind": "pull_out"},
        ],
        **run_metrics(data, truth, SLOPE_DEG, LossRule(9810.0)),
    }
    write_summary(folder, summary)
    return folder
