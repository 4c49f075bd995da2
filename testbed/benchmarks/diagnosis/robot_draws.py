"""The random runs of the robot's blind test: which motion, which drawn machine, and what is hidden
in it.
"""

from __future__ import annotations

import json
import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np

from testbed.effects import by_name
from testbed.scenario.scenario import Scenario, load_scenario

HIDDEN = Path(__file__).with_name("robot_hidden.yaml")
MOTIONS = {"stand": "stand_clean", "walk": "crawl_slope_45", "drill": "drill_slope_45"}
"""A standing robot sways: only moving pistons show what they have."""
KINDS = (
    *("clean", "single", "double", "clean", "single"),
    *("outside", "clean", "single", "clean", "single"),
    *("clean", "single", "double", "clean", "single"),
    *("outside", "clean", "single", "clean", "single"),
    *("double", "clean", "single", "clean", "single"),
    *("outside", "clean", "single", "clean", "double"),
    *("single", "clean", "single", "clean", "outside"),
    *("single", "clean", "double", "single", "clean"),
    *("single", "clean", "single", "clean", "outside"),
    *("double", "single", "clean", "single", "clean"),
)
"""Of every 50 runs 20 are sound, 19 hide one effect, 6 hide two and 5 one that no name covers."""
SECONDS = 20.0
"""Most of a cycle of the crawl, two sways or more of a standing robot."""
SLOPES_DEG, STRIDES_M = (25.0, 80.0), (0.12, 0.4)
HEADINGS_DEG = (0.0, 0.0, 0.0, 45.0, -45.0, 90.0, -90.0)
"""Walks go uphill, aslant and across."""
GENTLE_DEG = 45.0
"""Up to here strides are as long as these; on steeper ground, where ropes allow less, shorter with
the cosine.
"""
AGAIN, BEFORE, THIRD = 5000, 10_000, 15_000
"""Seeds of second recordings are so much higher, those of recordings made before, and of third
ones.
"""
AS_BELIEVED = ("undeclared=[]", 'machine={"draw": null}')
"""The machine as the robot believes it to be."""
PHASES = (
    {"kind": "push", "duration_s": 3.5, "feed_n": 3000},
    {"kind": "hammer", "duration_s": 5.5, "feed_n": 5000, "blow_hz": 30, "blow_n": 1500},
    {"kind": "pull_out", "duration_s": 3, "pull_n": 7000},
    {"kind": "push", "duration_s": 3.5, "feed_n": 4500},
    {"kind": "pull_out", "duration_s": 2.5, "pull_n": 5000},
)


@dataclass(frozen=True)
class Drawn:
    """A run of the test: `hidden` as a scenario's `undeclared` has it."""

    seed: int
    motion: str
    kind: str
    hidden: tuple[dict[str, Any], ...]
    overrides: tuple[str, ...]
    later: int = 0
    """The seed of noise of its recording is so much higher than that of the machine."""

    @property
    def truth(self) -> tuple[str, ...]:
        """What is hidden, as `effect@place`."""
        return tuple(sorted(f"{h['effect']}@{h['at']}" for h in self.hidden))

    def scenario(self, motion: str | None = None) -> Scenario:
        """Its scenario; `motion`: another one with the same machine and the same effects."""
        moved = motion or self.motion
        return self._loaded(moved, _task(moved, self.seed), self.later)

    def again(self, overrides: Sequence[str], later: int = AGAIN) -> Scenario:
        """Where it stands, the same machine moved otherwise; the seed of noise is another."""
        return self._loaded("stand", overrides, later)

    def rehearsed(self, overrides: Sequence[str]) -> Scenario:
        """Where it stands, the machine as it is believed moved otherwise."""
        believed = replace(self, hidden=(), overrides=(*self.overrides, *AS_BELIEVED))
        return believed._loaded("stand", overrides, -self.seed)

    def before(self) -> Iterator[Scenario]:
        """The same machine at the same place while nothing was hidden in it yet: it walks, or
        sways where control refuses to walk.
        """
        still_sound = replace(self, hidden=(), overrides=self.overrides[:-1])
        for motion in ("walk", "stand"):
            yield still_sound._loaded(motion, _task(motion, self.seed), BEFORE)

    def _loaded(self, motion: str, own: Sequence[str], later: int = 0) -> Scenario:
        overrides = [*self.overrides, *own]
        return load_scenario(MOTIONS[motion], overrides, self.seed + later, SECONDS)


@cache
def hidden_sizes() -> dict[str, Any]:
    """The contents of robot_hidden.yaml."""
    import yaml

    found: dict[str, Any] = yaml.safe_load(HIDDEN.read_text(encoding="utf-8"))
    return found


def drawn(seed: int) -> Drawn:
    """The run of a seed."""
    rng = np.random.default_rng([seed, 29])
    sizes = hidden_sizes()
    motion = list(MOTIONS)[seed % len(MOTIONS)]
    kind = KINDS[seed % len(KINDS)]
    table = sizes["unnamed" if kind == "outside" else "named"]
    names = [name for name in table if sizes["only"].get(name, motion) == motion]
    count = {"clean": 0, "double": 2}.get(kind, 1)
    picked = rng.choice(len(names), count, replace=False)
    hidden = tuple(effect_drawn(rng, names[k], table[names[k]]) for k in picked)
    overrides = (
        f"terrain.slope_deg={_slope_deg(seed):.2f}",
        *_stance(seed),
        "machine.draw=workshop",
        f"machine.seed={seed}",
        f"hydraulics.oil_temperature_degc={rng.uniform(15.0, 40.0):.1f}",
        f"undeclared={json.dumps(hidden)}",
    )
    return Drawn(seed, motion, kind, hidden, overrides)


def effect_drawn(
    rng: np.random.Generator, name: str, sizes: dict[str, list[float]]
) -> dict[str, Any]:
    """An effect at one of its places, with sizes that are drawn evenly between these ends."""
    signed = hidden_sizes()["signed"]
    of_stroke = hidden_sizes()["of_stroke"].get(name, ())
    place = str(rng.choice(by_name(name).places_on_robot))
    values = {}
    for parameter, (low, high) in sizes.items():
        sign = float(rng.choice([-1.0, 1.0])) if parameter in signed and low > 0.0 else 1.0
        values[parameter] = sign * float(rng.uniform(low, high))
        if parameter in of_stroke:
            values[parameter] *= strokes_m()[place]
    return {"effect": name, "at": place, "parameters": values}


@cache
def strokes_m() -> dict[str, float]:
    """The stroke of each cylinder of the drawing-board machine, m, by its name."""
    from testbed.machine.build import build_machine
    from testbed.robot.linkage import Linkages

    machine = build_machine()
    strokes = Linkages.from_machine(machine).stroke_m.tolist()
    return dict(zip(machine.axes, strokes, strict=True))


def _slope_deg(seed: int) -> float:
    """Of the ground of a seed."""
    return float(np.random.default_rng([seed, 41]).uniform(*SLOPES_DEG))


def _stance(seed: int) -> list[str]:
    """How the machine of a seed stands on its slope, and how much its ropes bear of what slides."""
    rng = np.random.default_rng([seed, 37])
    turned = float(rng.uniform(0.0, 12.0))
    return [
        f"robot.vertical_m={rng.uniform(0.2, 0.32):.3f}",
        f"robot.radial_m={rng.uniform(0.08, 0.28):.3f}",
        f"robot.rotation_deg={json.dumps([turned, -turned, -turned, turned])}",
        f"ropes.share={rng.uniform(0.8, 0.97):.3f}",
    ]


def _task(motion: str, seed: int) -> list[str]:
    """What it does: how far a sway goes, or where a walk goes and how it strides."""
    rng = np.random.default_rng([seed, 31])
    if motion == "stand":
        amplitude, period = rng.uniform(0.04, 0.07, 3), rng.uniform(6.0, 12.0, 3)
        return [
            f"task.amplitude_m={json.dumps(amplitude.round(4).tolist())}",
            f"task.period_s={json.dumps(period.round(2).tolist())}",
        ]
    if motion == "drill":
        return ["task.start_s=1.5", f"task.phases={json.dumps(PHASES)}"]
    steep = min(1.0, math.cos(math.radians(_slope_deg(seed))) / math.cos(math.radians(GENTLE_DEG)))
    return [
        "task.start_s=1.5",
        f"task.heading_deg={rng.choice(HEADINGS_DEG)}",
        f"task.step_length_m={steep * rng.uniform(*STRIDES_M):.3f}",
    ]
