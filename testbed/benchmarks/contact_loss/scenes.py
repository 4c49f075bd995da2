"""What the contact-loss detectors are tried on: drilling on slopes, with and without feet that leave the ground.

Every scene is drawn from its own seed: slope, rock, ropes, oil temperature, payload, the plant's friction and, in a
third, one undeclared effect. A quiet scene drills for minutes with everything that is not an event: hammering at 15 to
50 Hz, rods added, voids and stuck rods, pulling out, ropes re-tensioned, intended load shifts, body motion. A loss
scene adds upsets that may take the load off feet: a leg gives way, the frame is twisted between the diagonals, the
feed thrusts the machine off the slope, a jerk hits the body. Whether a foot is lost only the truth says.
"""

from __future__ import annotations

import json
import math
from dataclasses import dataclass, replace
from functools import cache
from pathlib import Path
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray

from testbed.control.command import Command, along_vertical
from testbed.control.measured import Measured
from testbed.envs.randomisation import draw_overrides
from testbed.machine.names import LEGS
from testbed.scenario.scenario import Scenario, load_scenario

Array = NDArray[np.float64]
Kind = Literal["quiet", "losses", "supervised"]
Split = Literal["tuning", "scoring"]
FIRST_SEED = {"tuning": 410_000, "scoring": 930_000}
"""Seeds of the two splits never meet; constants and thresholds are set on `tuning` alone. Scoring seeds from 870 000 on
have been looked at: a drifting sensor was found there."""
SETTLE_S = 2.0
LOSS_SCENE_S = 60.0
QUIET_SCENE_S = 300.0
SMALL_HOURS = 0.1
"""A benchmark shorter than this is a look at whether it works: its loss scenes are half as long."""
NORMAL_WEIGHT_N = 4000.0 * 9.81
UPSETS = ("yield", "twist", "thrust", "thrust", "jerk")
GROUND = {
    "terrain.slope_deg": {"uniform": [30.0, 78.0]},
    "terrain.friction": {"uniform": [0.455, 0.845]},
    "robot.payload_kg": {"uniform": [0.0, 1333.0]},
    "ropes.azimuth_deg": {"uniform": [-6.0, 6.0]},
    "ropes.share": {"uniform": [0.88, 1.02]},
    "hydraulics.oil_temperature_degc": {"uniform": [15.0, 60.0]},
    "sensors.thermal_drift": {"one_of": [True]},
}
UNDECLARED = Path(__file__).with_name("undeclared.yaml")
ROUGH_SHARE, SLOW_SHARE = 0.1, 0.5
PLANT_SPREAD = 0.2
"""One scene in ten stands on rough rock, in every other one the drill builds up its force slowly; the plant's friction
differs from the believed by up to PLANT_SPREAD of itself."""


@cache
def undeclared() -> dict[str, Any]:
    """What is hidden in a third of the scenes: probability, effects and places."""
    import yaml

    return yaml.safe_load(UNDECLARED.read_text(encoding="utf-8"))  # type: ignore[no-any-return]


@dataclass(frozen=True)
class Scene:
    """One scene: its kind, split and number; `duration_s` simulated seconds.

    `supervised`: the loss scene of the same number once more, with the supervisor at work.
    """

    kind: Kind
    split: Split
    number: int
    duration_s: float
    machine: str | None = None
    """Tolerances from which each scene's machine is drawn; None: the world has the drawing-board machine."""

    @property
    def name(self) -> str:
        """Its file's name."""
        drawn = f"-{self.machine}" if self.machine else ""
        return f"{self.split}-{self.kind}-{self.number:04d}-{self.duration_s:g}s{drawn}"

    @property
    def seed(self) -> int:
        """Seed of the run; loss scenes and quiet scenes have their own."""
        return FIRST_SEED[self.split] + self.number + (0 if self.kind == "quiet" else 200_000)


@dataclass(frozen=True)
class Upset:
    """One try to take the load off: when it begins, ends and is over, and what it is."""

    kind: str
    start_s: float
    end_s: float
    gradual: bool
    foot: int


@dataclass(frozen=True)
class Drawn:
    """A scene ready to run: the scenario, the hidden moves of the feet and the upsets."""

    scenario: Scenario
    time_s: Array
    """Knots (n) of the moves, s."""
    moves_m: Array
    """Offsets of the vertical set points at the knots (n, 4), m."""
    upsets: tuple[Upset, ...]


def scenes(split: Split, hours: float, machine: str | None = None) -> list[Scene]:
    """Scenes of a benchmark: `hours` of quiet drilling, and eight loss scenes an hour (at least three).

    `machine`: tolerances from which each scene draws its world's machine.
    """
    total_s = hours * 3600.0
    count = max(1, math.ceil(total_s / QUIET_SCENE_S))
    quiet = [Scene("quiet", split, k, round(SETTLE_S + total_s / count, 1)) for k in range(count)]
    length_s = LOSS_SCENE_S if hours >= SMALL_HOURS else 0.5 * LOSS_SCENE_S
    losses = [Scene("losses", split, k, length_s) for k in range(max(3, math.ceil(8.0 * hours)))]
    again = [
        replace(scene, kind="supervised") for scene in losses[: max(1, math.ceil(4.0 * hours))]
    ]
    return [replace(scene, machine=machine) for scene in (*losses, *again, *quiet)]


def draw(scene: Scene) -> Drawn:
    """Draw a scene from its seed."""
    rng = np.random.default_rng(scene.seed)
    overrides = [
        *draw_overrides({**GROUND, "undeclared": undeclared()}, rng),
        f"duration_s={scene.duration_s}",
    ]
    slope = float(json.loads(overrides[0].partition("=")[2]))
    payload = float(json.loads(overrides[2].partition("=")[2]))
    overrides += _rock(rng) + _plant(rng)
    weight_n = NORMAL_WEIGHT_N * (1.0 + payload / 4000.0) * math.cos(math.radians(slope))
    phases, upsets = _drilling(rng, scene, weight_n)
    slow = bool(rng.random() < SLOW_SHARE)
    ramp_s = round(float(rng.uniform(1.5, 3.0) if slow else 10 ** rng.uniform(-1.3, 0.0)), 3)
    task = {"kind": "drill", "start_s": SETTLE_S, "phases": phases, "ramp_s": ramp_s}
    hole = _hole(rng, weight_n)
    if scene.kind == "quiet" and scene.number % 2:
        task = hole
    overrides += [
        "task=" + json.dumps(task),
        f"control.supervisor={json.dumps(scene.kind == 'supervised')}",
    ]
    time_s, moves, shoves = _moves(rng, scene, upsets, weight_n, math.radians(slope))
    if scene.machine is not None:
        overrides += [f"machine.draw={scene.machine}", f"machine.seed={scene.seed}"]
    events = shoves + (_ropes(rng, scene) if scene.kind == "quiet" else [])
    overrides.append("events=" + json.dumps(sorted(events, key=lambda e: float(e["at_s"]))))
    return Drawn(
        load_scenario("drill_slope_45", overrides, scene.seed), time_s, moves, tuple(upsets)
    )


def _rock(rng: np.random.Generator) -> list[str]:
    stiffness, rough, seed = 10 ** rng.uniform(7.3, 9.0), rng.random(), int(rng.integers(1000))
    out = [f"terrain.stiffness_n_m={stiffness:.6g}"]
    if rough < ROUGH_SHARE:
        out += [
            'terrain.kind="heightfield"',
            "terrain.roughness_m=0.001",
            f"terrain.roughness_seed={seed}",
        ]
    return out


def _plant(rng: np.random.Generator) -> list[str]:
    from testbed.machine.build import build_machine

    cylinder = build_machine().vertical_cylinder
    names = (
        "coulomb_out_n",
        "static_out_n",
        "viscous_out_n_s_m",
        "coulomb_in_n",
        "static_in_n",
        "viscous_in_n_s_m",
    )
    factors = 1.0 + PLANT_SPREAD * rng.uniform(-1.0, 1.0, len(names))
    return [
        f"hydraulics.parameters.vertical_cylinder.{name}={getattr(cylinder, name) * factor:.6g}"
        for name, factor in zip(names, factors, strict=True)
    ]


def _drilling(
    rng: np.random.Generator, scene: Scene, weight_n: float
) -> tuple[list[dict[str, Any]], list[Upset]]:
    """Phases one after the other until the scene's end; in loss scenes an upset in most of them."""
    phases: list[dict[str, Any]] = []
    upsets: list[Upset] = []
    now = SETTLE_S
    while now < scene.duration_s:
        loss = scene.kind != "quiet"
        kind = str(rng.choice(["hammer", "hammer", "push", "rest", "pull_out", "rod_change"]))
        length = float(rng.uniform(4.0, 7.0) if loss else rng.uniform(4.0, 20.0))
        upset = str(rng.choice(UPSETS)) if loss else ""
        phase: dict[str, Any] = {"kind": kind, "duration_s": length}
        if upset == "thrust":
            share = rng.uniform(0.6, 0.85)
            phase |= {
                "kind": "push",
                "feed_n": min(3.0e4, float(share * weight_n)),
                "torque_nm": 300.0,
            }
        elif kind in ("hammer", "push"):
            phase["feed_n"] = float(min(rng.uniform(1500.0, 5500.0), 0.35 * weight_n))
        elif kind == "pull_out":
            phase["pull_n"] = float(rng.uniform(2000.0, 12000.0))
        elif kind == "rod_change":
            phase["rod_kg"] = 10.2
        if phase["kind"] == "hammer":
            phase |= {
                "blow_hz": float(rng.uniform(15.0, 50.0)),
                "blow_n": float(rng.uniform(500.0, 3000.0)),
            }
        if upset:
            begin = now + rng.uniform(0.5, 1.5)
            gradual = bool(rng.random() < 0.5)
            upsets.append(Upset(upset, begin, now + length, gradual, int(rng.integers(4))))
        phases.append(phase)
        now += length
    return phases, upsets


def _hole(rng: np.random.Generator, weight_n: float) -> dict[str, Any]:
    """A stretch of a deep hole in drawn layers: voids, rods added, a string that may stick on its way out."""
    drilled = round(float(rng.uniform(0.0, 9.0)), 2)
    return {
        "kind": "drill_hole",
        "start_s": SETTLE_S,
        "drilled_m": drilled,
        "depth_m": round(drilled + 0.4, 2),
        "feed_n": float(np.clip(rng.uniform(2000.0, 5500.0), 500.0, max(500.0, 0.35 * weight_n))),
        "blow_hz": float(rng.uniform(23.0, 50.0)),
        "blow_n": float(rng.uniform(500.0, 3000.0)),
        "rock": {"stick_probability": 0.5, "void_share": 0.2},
    }


def _moves(
    rng: np.random.Generator, scene: Scene, upsets: list[Upset], weight_n: float, slope_rad: float
) -> tuple[Array, Array, list[dict[str, Any]]]:
    knots: list[tuple[float, Array]] = [(0.0, np.zeros(4))]
    shoves: list[dict[str, Any]] = []
    resting = np.zeros(4)

    def go(start: float, length: float, goal: Array) -> None:
        knots.append((max(start, knots[-1][0] + 1e-3), knots[-1][1]))
        knots.append((knots[-1][0] + length, goal))

    if scene.kind == "quiet":
        now = SETTLE_S + 1.0
        while now < scene.duration_s:
            if rng.random() < 0.3:  # body motion
                resting = resting + rng.uniform(-0.01, 0.01)
                resting = np.clip(resting, -0.05, 0.05)
                go(now, float(rng.uniform(0.5, 3.0)), resting)
            else:  # an intended load shift
                go(now, float(rng.uniform(0.3, 3.0)), resting + rng.uniform(-2.0e-4, 2.0e-4, 4))
            now += float(rng.uniform(5.0, 20.0))
    for upset in upsets:
        length = float(rng.uniform(0.5, 3.0) if upset.gradual else rng.uniform(0.01, 0.15))
        back = upset.end_s - 1.2
        goal, size = np.zeros(4), float(rng.uniform(0.4e-3, 2.0e-3))
        if upset.kind == "yield":
            goal[upset.foot] = -2.0 * size
        elif upset.kind == "twist":
            goal[:] = np.array([-size, size, size, -size]) * (1.0 if upset.foot in (0, 3) else -1.0)
        elif upset.kind == "jerk":
            shoves.append(_shove(rng, upset, weight_n, slope_rad))
        if np.any(goal):
            go(upset.start_s, min(length, max(back - upset.start_s - 0.3, 0.05)), goal)
            go(back, 0.8, np.zeros(4))
    return np.array([t for t, _ in knots]), np.array([g for _, g in knots]), shoves


def _shove(
    rng: np.random.Generator, upset: Upset, weight_n: float, slope_rad: float
) -> dict[str, Any]:
    """Off the slope and to a side: a rope that springs, a rock that hits."""
    off = float(rng.uniform(0.4, 0.9)) * weight_n
    along, side = (float(v) for v in rng.uniform(-0.25, 0.25, 2) * weight_n)
    force = [
        -off * math.sin(slope_rad) + along * math.cos(slope_rad),
        side,
        off * math.cos(slope_rad) + along * math.sin(slope_rad),
    ]
    length = round(float(rng.uniform(0.05, 0.3)), 2)
    return {
        "kind": "shove",
        "at_s": round(upset.start_s, 2),
        "duration_s": length,
        "force_in_world_n": force,
    }


def _ropes(rng: np.random.Generator, scene: Scene) -> list[dict[str, Any]]:
    """Ropes re-tensioned now and then, to and fro."""
    out, now, given = [], SETTLE_S + 2.0, {"left": 0.0, "right": 0.0}
    while now < scene.duration_s - 4.0:
        side = str(rng.choice(["left", "right"]))
        goal = float(rng.uniform(-0.004, 0.004))
        out.append(
            {
                "kind": "set_rope",
                "at_s": round(now, 2),
                "rope": side,
                "pay_out_m": goal - given[side],
                "duration_s": float(rng.uniform(0.5, 3.0)),
            }
        )
        given[side] = goal
        now += float(rng.uniform(8.0, 30.0))
    return out


class Moves:
    """A Layer of hidden moves of the feet: the ground that gives, a frame that twists."""

    def __init__(self, drawn: Drawn) -> None:
        self._time_s, self._moves_m = drawn.time_s, drawn.moves_m

    def over(self, command: Command, t: float, dt: float, measured: Measured) -> Command:
        """See Layer."""
        before, after = self._at(t), self._at(t + dt)
        return command.moved(along_vertical(after), along_vertical((after - before) / dt))

    def _at(self, t: float) -> Array:
        return np.array([np.interp(t, self._time_s, self._moves_m[:, k]) for k in range(len(LEGS))])
