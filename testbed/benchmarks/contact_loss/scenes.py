"""What the contact-loss detectors are tried on: drawn machines that drill and walk on slopes, and
feet that come off.

Every scene is drawn from its own seed. So are the machines: every GROUP scenes share MACHINES of
them, each of which can be commissioned once. The ground is rock, soft, breaking under a foot or
rough; up to three effects that the model lacks, and that came after any commissioning, sit at any
of the twelve cylinders, and in a third of the scenes two or three pressure sensors drift. A
drilling scene goes from phase to phase; in most of them something takes load off feet:

    yield    a leg gives way, mostly slowly
    twist    the frame is twisted between the diagonals, mostly slowly
    thrust   the feed lifts the machine off
    jerk     a blow on the body
    lift     the control lifts a foot and puts it down again: meant, and scored like the rest

Half of the hammering is near the resonance of body and oil. A walking scene is a crawl: four
swings, four touchdowns. Whether and when a foot was lost only the truth says.
"""

from __future__ import annotations

import json
import math
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from typing import Any, Literal

import numpy as np

from testbed.control.gait import Command, Measured, along_vertical
from testbed.effects import by_name, ground_settling, sensor_drift_a, sensor_zero
from testbed.formats.arrays import Array
from testbed.formats.yaml_files import read_mapping
from testbed.machine.build import build_machine
from testbed.machine.names import AXES, LEGS
from testbed.scenario.scenario import Scenario, load_scenario

Tree = dict[str, Any]
Split = Literal["tuning", "scoring"]
Kind = Literal["drill", "crawl", "supervised"]
FIRST_SEED: dict[str, int] = {"tuning": 0, "scoring": 87000}
"""Seeds of the two splits never meet; constants, weights and thresholds are set on `tuning`
alone.
"""
MACHINES: dict[str, int] = {"tuning": 53, "scoring": 13}
"""Drawn machines of a group of scenes. Prime to CRAWL_EVERY, so that each drills and walks."""
GROUP, GROUP_SEEDS = 104, 2000
"""So many scenes are a group, and so far apart are the groups' seeds."""
SETTLE_S = 2.0
"""The first seconds, in which everything starts from nothing, are not scored."""
LENGTH_S: dict[str, float] = {"drill": 20.0, "crawl": 26.0, "supervised": 20.0}
STRIDES_M = (0.3, 0.2, 0.1)
"""Of a crawl: the longest that the drawn machine's legs can reach."""
CRAWL_EVERY, SUPERVISED_EVERY = 4, 5
"""One scene in four walks; one drilling scene in five is run once more with the supervisor at
work.
"""
WEIGHT_N = 4000.0 * 9.81
WALL_DEG = 78.0
"""From here on the ropes carry all of the pull and are attached at the height that balances the
machine.
"""
UPSETS = ("yield", "yield", "yield", "twist", "twist", "twist", "thrust", "jerk", "lift")
GRADUAL_SHARE = 0.92
GIVES_M_S = (2e-4, 1.2e-3)
"""Speed at which a leg gives way slowly; the oil under a foot springs by some 0.7 mm of its load
(B).
"""
PHASES = ("hammer", "hammer", "hammer", "push", "rest", "pull_out", "rod_change")
CALM_PHASES = ("hammer", "push", "push", "rest", "pull_out", "rod_change")
"""While something gives way slowly the drill hammers more rarely: blows make a slow loss abrupt."""
RESONANCE_HZ = (8.0, 22.0)
"""Body and rods on the oil of four vertical cylinders, 10-20 MN/m each and softer with air (B)."""
SETTLING = ground_settling.EFFECTS[0].kind
DRIFT, ZERO = sensor_drift_a.EFFECTS[0], sensor_zero.EFFECTS[0]
UNDECLARED = Path(__file__).with_name("undeclared.yaml")


@dataclass(frozen=True)
class Scene:
    """One scene: what it does, its split and number. `supervised`: a drilling scene again, with the
    supervisor.
    """

    kind: Kind
    split: Split
    number: int
    machine: str | None = "workshop"
    """Tolerances from which the world's machine is drawn; None: the drawing-board machine."""

    @property
    def name(self) -> str:
        """Its folder's name."""
        return f"{self.split}-{self.number:04d}-{self.kind}-{self.machine or 'drawing'}"

    @property
    def seed(self) -> int:
        """Seed of the run."""
        return self._first_seed + self.number % GROUP

    @property
    def machine_seed(self) -> int:
        """Seed of its machine."""
        return self._first_seed + self.number % GROUP % MACHINES[self.split]

    @property
    def _first_seed(self) -> int:
        """Of its group."""
        return FIRST_SEED[self.split] + GROUP_SEEDS * (self.number // GROUP)

    @property
    def duration_s(self) -> float:
        """Simulated time, s."""
        return LENGTH_S[self.kind]


@dataclass(frozen=True)
class Upset:
    """One try to take load off feet, from `start_s` to `end_s`."""

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


def scenes(split: Split, foot_hours: float, machine: str | None = "workshop") -> list[Scene]:
    """Scenes in which four feet together spend `foot_hours` after settling, at least four
    scenes.
    """
    out: list[Scene] = []
    seconds, number = 0.0, 0
    while seconds < foot_hours * 3600.0 / len(LEGS) or number < CRAWL_EVERY:
        kind: Kind = "crawl" if number % CRAWL_EVERY == CRAWL_EVERY - 1 else "drill"
        out.append(Scene(kind, split, number, machine))
        seconds += LENGTH_S[kind] - SETTLE_S
        number += 1
    drilling = [scene for scene in out if scene.kind == "drill"]
    return out + [
        Scene("supervised", split, s.number, machine) for s in drilling[::SUPERVISED_EVERY]
    ]


def draw(scene: Scene, stride_m: float = STRIDES_M[0]) -> Drawn:
    """Draw a scene from its seed; a crawl with this stride."""
    rng = np.random.default_rng([scene.seed, 18])
    slope_deg = float(rng.uniform(20.0, 85.0))
    payload_kg = float(rng.uniform(0.0, 1333.0))
    site = _site(rng, slope_deg, payload_kg, scene.kind == "crawl")
    hidden = _undeclared(rng)
    weight_n = (WEIGHT_N + payload_kg * 9.81) * math.cos(math.radians(slope_deg))
    upsets: list[Upset] = []
    events: list[Tree] = []
    moves = np.zeros((1, len(LEGS)))
    knots = np.zeros(1)
    if scene.kind != "crawl":
        phases, upsets = _drilling(rng, scene.duration_s, weight_n)
        _leave_rods(phases, build_machine().rod_store_body.mass_kg + payload_kg)
        gradual = any(u.kind == "thrust" and u.gradual for u in upsets)
        ramp_s = float(rng.uniform(1.5, 3.0) if gradual else 10 ** rng.uniform(-1.3, 0.0))
        site["task"] = {"kind": "drill", "start_s": SETTLE_S, "phases": phases, "ramp_s": ramp_s}
        knots, moves, events = _moves(rng, upsets, weight_n, math.radians(slope_deg))
    else:
        site["task.step_length_m"] = stride_m
    site["control.supervisor"] = scene.kind == "supervised"
    site["undeclared"] = hidden + site.pop("ground", [])
    site["events"] = sorted(events, key=lambda event: float(event["at_s"]))
    site["duration_s"] = scene.duration_s
    if scene.machine is not None:
        site |= {"machine.draw": scene.machine, "machine.seed": scene.machine_seed}
    base = "crawl_slope_45" if scene.kind == "crawl" else "drill_slope_45"
    changes = [f"{path}={json.dumps(value)}" for path, value in site.items()]
    return Drawn(load_scenario(base, changes, scene.seed), knots, moves, tuple(upsets))


def _site(rng: np.random.Generator, slope_deg: float, payload_kg: float, walks: bool) -> Tree:
    """Slope, ground, ropes, oil: path of the scenario -> value; `ground` are hidden effects of the
    ground.
    """
    wall = slope_deg >= WALL_DEG
    share = rng.uniform(0.97, 1.01) if wall or walks else rng.uniform(0.88, 1.02)
    site: Tree = {
        "terrain.slope_deg": slope_deg,
        "terrain.friction": float(rng.uniform(0.455, 0.845)),
        "terrain.stiffness_n_m": float(10 ** rng.uniform(7.5, 8.7)),
        "robot.payload_kg": payload_kg,
        "ropes.azimuth_deg": 0.0 if walks else float(rng.uniform(-6.0, 6.0)),
        "ropes.share": float(share),
        "hydraulics.oil_temperature_degc": float(rng.uniform(15.0, 60.0)),
        "sensors.thermal_drift": True,
    }
    if wall:
        site["ropes.attachment_height_m"] = 0.28
    ground, foot = (
        str(rng.choice(["rock", "soft", "loose", "settling", "rough"])),
        int(rng.integers(4)),
    )
    size, seed = float(rng.random()), int(rng.integers(1000))
    if ground == "soft":
        site["terrain.stiffness_n_m"] = 10 ** (6.4 + size)
    elif ground == "loose":
        patch = {"foot": LEGS[foot], "plastic_n_m": 10 ** (5.6 + 0.8 * size), "stiffness_n_m": 1e7}
        site |= {"terrain.patches": [patch], "terrain.settle_s": 0.5 + 4.0 * size}
    elif ground == "settling":
        giving = {"rate": 2e-4 * 10**size, "depth": 0.01}
        site["ground"] = [{"effect": SETTLING, "at": f"foot_{LEGS[foot]}", "parameters": giving}]
    elif ground == "rough":
        site |= {"terrain.kind": "heightfield", "terrain.roughness_m": 0.001}
        site["terrain.roughness_seed"] = seed
    return site


@cache
def _hidden() -> Tree:
    """undeclared.yaml."""
    return read_mapping(UNDECLARED)


def _undeclared(rng: np.random.Generator) -> list[Tree]:
    """Effects of cylinders that the model lacks, then the drifting sensors."""
    hidden, out = _hidden(), []
    for _ in range(int(rng.integers(hidden["most"] + 1))):
        effect = by_name(str(rng.choice(hidden["effects"])))
        first = effect.parameters[0]
        values = {p.name: float(np.mean(p.prior)) for p in effect.parameters if p.default is None}
        values[first.name] = float(rng.uniform(*first.prior))
        place = str(rng.choice(AXES))
        out.append({"effect": effect.name, "at": place, "parameters": values})
    drifting = hidden["drifting"]
    if rng.random() >= drifting["share"]:
        return _each_once(out)
    rates = DRIFT.parameters[0].prior
    vertical = [axis for axis in AXES if axis.endswith("vertical")]
    axes = [str(rng.choice(vertical))]
    others = [axis for axis in AXES if axis not in axes]
    axes += [str(a) for a in rng.choice(others, rng.choice(drifting["sensors"]) - 1, False)]
    for axis in axes:
        rate, since_s = float(rng.uniform(*rates)), float(rng.uniform(0.0, drifting["since_s"]))
        for effect_name, parameters in (
            (DRIFT.kind, {"rate": rate}),
            (ZERO.kind, {"zero": rate * since_s}),
        ):
            out.append({"effect": effect_name, "at": axis, "parameters": parameters})
    return _each_once(out)


def _each_once(hidden: list[Tree]) -> list[Tree]:
    """Without what a later entry of the same effect at the same place replaces."""
    last = {(entry["effect"], entry["at"]): place for place, entry in enumerate(hidden)}
    return [hidden[place] for place in sorted(last.values())]


def drifting_sensors(scenario: Scenario) -> int:
    """How many pressure sensors drift."""
    return len({u.at for u in scenario.undeclared if u.effect == DRIFT.kind})


def _drilling(
    rng: np.random.Generator, duration_s: float, weight_n: float
) -> tuple[list[Tree], list[Upset]]:
    """Phases one after the other until the scene's end; an upset in three quarters of them."""
    phases: list[Tree] = []
    upsets: list[Upset] = []
    now = SETTLE_S
    while now < duration_s:
        length = float(rng.uniform(3.5, 6.0))
        upset = str(rng.choice(UPSETS)) if rng.random() < 0.75 else ""
        gradual = bool(rng.random() < GRADUAL_SHARE) and upset not in ("jerk", "lift")
        kinds = CALM_PHASES if upset and gradual else PHASES
        phases.append(_phase(rng, length, str(rng.choice(kinds)), upset == "thrust", weight_n))
        if upset and now + length + 0.5 < duration_s:
            begin = now + float(rng.uniform(0.3, 1.0))
            upsets.append(Upset(upset, begin, now + length, gradual, int(rng.integers(4))))
        now += length
    return phases, upsets


LEAST_LEFT = 0.1
"""Share of the rod store that stays in it where rod changes would have taken more than all."""


def _leave_rods(phases: list[Tree], stored_kg: float) -> None:
    """Make the rods of all changes lighter alike, in place, where a store of this mass lacks
    them.
    """
    taken_kg = sum(phase.get("rod_kg", 0.0) for phase in phases)
    if taken_kg < stored_kg:
        return
    for phase in phases:
        if "rod_kg" in phase:
            phase["rod_kg"] *= (1.0 - LEAST_LEFT) * stored_kg / taken_kg


def _phase(
    rng: np.random.Generator, length_s: float, kind: str, lifting: bool, weight_n: float
) -> Tree:
    """One drill phase; `lifting`: a push whose feed takes most of the weight off the slope."""
    phase: Tree = {"kind": "push" if lifting else kind, "duration_s": length_s}
    if lifting:
        phase |= {"feed_n": min(3.0e4, float(rng.uniform(0.6, 0.9) * weight_n)), "torque_nm": 300.0}
    elif kind in ("hammer", "push"):
        phase["feed_n"] = float(min(rng.uniform(1500.0, 5500.0), 0.35 * weight_n))
    elif kind == "pull_out":
        phase["pull_n"] = float(rng.uniform(2000.0, 12000.0))
    elif kind == "rod_change":
        phase["rod_kg"] = float(rng.uniform(10.2, 90.0))
    if phase["kind"] == "hammer":
        near = rng.random() < 0.5
        phase["blow_hz"] = float(rng.uniform(*(RESONANCE_HZ if near else (22.0, 50.0))))
        phase["blow_n"] = float(min(rng.uniform(500.0, 3000.0), 0.15 * weight_n))
    return phase


def _moves(
    rng: np.random.Generator, upsets: list[Upset], weight_n: float, slope_rad: float
) -> tuple[Array, Array, list[Tree]]:
    """Hidden moves of the feet at knots, and the events."""
    knots: list[tuple[float, Array]] = [(0.0, np.zeros(len(LEGS)))]
    events: list[Tree] = []

    def go(start_s: float, length_s: float, goal: Array) -> None:
        knots.append((max(start_s, knots[-1][0] + 1e-3), knots[-1][1]))
        knots.append((knots[-1][0] + length_s, goal))

    for upset in upsets:
        length = float(rng.uniform(1.0, 2.5) if upset.gradual else rng.uniform(0.01, 0.15))
        back = upset.end_s - 1.0
        slow_m = length * float(np.exp(rng.uniform(*np.log(GIVES_M_S))))
        size = slow_m if upset.gradual else float(10 ** rng.uniform(-3.3, -2.4))
        goal = np.zeros(len(LEGS))
        if upset.kind == "yield":
            goal[upset.foot] = -2.0 * size
        elif upset.kind == "twist":
            goal[:] = np.array([-size, size, size, -size]) * (1.0 if upset.foot in (0, 3) else -1.0)
        elif upset.kind == "jerk":
            events.append(_shove(rng, upset, weight_n, slope_rad))
        elif upset.kind == "lift":
            events.append(_lift(rng, upset))
        if np.any(goal):
            go(upset.start_s, min(length, max(back - upset.start_s - 0.3, 0.05)), goal)
            go(back, 0.7, np.zeros(len(LEGS)))
    return np.array([t for t, _ in knots]), np.array([g for _, g in knots]), events


def _lift(rng: np.random.Generator, upset: Upset) -> Tree:
    """The control lifts a foot and puts it down again."""
    return {
        "kind": "lift_foot",
        "at_s": round(upset.start_s, 2),
        "leg": LEGS[upset.foot],
        "height_m": float(rng.uniform(0.02, 0.06)),
        "duration_s": round(max(upset.end_s - upset.start_s - 0.8, 1.0), 2),
    }


def _shove(rng: np.random.Generator, upset: Upset, weight_n: float, slope_rad: float) -> Tree:
    """Off the slope and to a side: a rope that springs, a rock that hits."""
    off = float(rng.uniform(0.3, 0.9)) * weight_n
    along, side = (float(v) for v in rng.uniform(-0.25, 0.25, 2) * weight_n)
    force = [
        -off * math.sin(slope_rad) + along * math.cos(slope_rad),
        side,
        off * math.cos(slope_rad) + along * math.sin(slope_rad),
    ]
    return {
        "kind": "shove",
        "at_s": round(upset.start_s, 2),
        "duration_s": round(float(rng.uniform(0.05, 0.3)), 2),
        "force_in_world_n": force,
    }


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
