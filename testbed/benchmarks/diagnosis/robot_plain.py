"""One plain effect of every kind, hidden in shipped scenes on drawn machines: what the diagnosis
says of each, and what it says of the same scenes with nothing hidden.

This is what a stranger tries first. The sizes are in `robot_plain.yaml`; nothing is fitted on it.
"""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np

from testbed.benchmarks.diagnosis.robot_draws import strokes_m
from testbed.benchmarks.diagnosis.robot_recordings import Run, run_of
from testbed.benchmarks.diagnosis.robot_trials import balances_in, names_in
from testbed.benchmarks.diagnosis.scores import rate
from testbed.benchmarks.harness import Answers, Benchmark
from testbed.effects import by_name, place_of
from testbed.errors import InputError
from testbed.report.page import Table
from testbed.scenario.scenario import Scenario, load_scenario

SIZES = Path(__file__).with_name("robot_plain.yaml")
SOUND = "sound"
MOTIONS = ("stand", "walk", "drill")
SECONDS = 20.0
"""Of each scene so much is looked at."""
BEFORE = 10_000
"""Seeds of recordings made before anything was hidden are so much higher."""


@dataclass(frozen=True)
class Case:
    """`effect` at a place that its seed draws, in the scene of a motion; `sound`: nothing."""

    seed: int
    motion: str
    effect: str

    def hidden(self) -> list[dict[str, Any]]:
        """As a scenario's `undeclared` has it."""
        if self.effect == SOUND:
            return []
        places = by_name(self.effect).places_on_robot
        place = str(np.random.default_rng([self.seed, 41]).choice(places))
        size = dict(plain_sizes()["effects"][self.effect]["parameters"])
        for parameter in plain_sizes()["of_stroke"].get(self.effect, ()):
            size[parameter] *= strokes_m()[place]
        return [{"effect": self.effect, "at": place, "parameters": size}]

    def scenario(self, before: bool = False) -> Scenario:
        """Its scene; `before`: of the same machine, with nothing hidden yet."""
        overrides = ["machine.draw=workshop", f"machine.seed={self.seed}"]
        if not before:
            overrides.append(f"undeclared={json.dumps(self.hidden())}")
        scene = plain_sizes()["scenes"][self.motion]
        return load_scenario(scene, overrides, self.seed + BEFORE * before, SECONDS)


@cache
def plain_sizes() -> dict[str, Any]:
    """The contents of robot_plain.yaml."""
    import yaml

    found: dict[str, Any] = yaml.safe_load(SIZES.read_text(encoding="utf-8"))
    return found


@dataclass(frozen=True)
class PlainEffects(Benchmark[Case]):
    """Every effect of the table in each of its scenes, and `sounds` sound machines in each scene;
    consecutive seeds. `before`: the diagnosis is given the same scene of the sound machine, too.
    """

    name = "robot_plain"
    noun = "runs"
    first_seed: int = 3000
    sounds: int = 3
    before: bool = False
    only: tuple[str, ...] = ()
    recordings: Path | None = None

    def cases(self) -> Mapping[str, Case]:
        """By effect and motion."""
        table = plain_sizes()["effects"]
        wanted = [(e, m) for e, row in table.items() for m in row["motions"]]
        wanted += [(SOUND, m) for m in MOTIONS for _ in range(self.sounds)]
        cases = [Case(self.first_seed + k, m, e) for k, (e, m) in enumerate(wanted)]
        chosen = [c for c in cases if not self.only or c.effect in self.only]
        return {f"{c.effect} {c.motion} {c.seed}": c for c in chosen}

    def work(self, case: Case) -> dict[str, Any]:
        """What is said of one run; `refused` where control will not start it."""
        try:
            return said_of(case, self.before, self.recordings)
        except InputError as error:
            return {"refused": str(error), "hidden": case.effect, "motion": case.motion}

    def without(self) -> tuple[str, ...]:
        """See RobotBlindTest."""
        names = ("*scores.py", "*calibration.py", "trials.py", "benchmark.py", "measured_rigs.py")
        return tuple(f"benchmarks/diagnosis/{name}" for name in names)

    def made_from(self, case: Case) -> str:
        """Where runs are kept has no say."""
        return repr((case, self.before))

    def summarise(self, answers: Answers) -> dict[str, Any]:
        """Shares of what is said, and every answer."""
        made = [one for one in answers.values() if "refused" not in one]
        hidden = [one for one in made if one["hidden"]]
        return {
            "refused": len(answers) - len(made),
            "seeds": [min(o["seed"] for o in made), max(o["seed"] for o in made)],
            "given_before": self.before,
            "sound_left_alone": rate([o["verdict"] == "none" for o in made if not o["hidden"]]),
            "named": rate([o["names"] == [o["hidden"]] for o in hidden]),
            "place": rate([_place_is_right(o) for o in hidden]),
            "noticed": rate([o["verdict"] != "none" for o in hidden]),
            "misnamed": rate([bool(set(o["names"]) - {o["hidden"]}) for o in hidden]),
            "runs": made,
        }

    def tables(self, result: dict[str, Any]) -> Sequence[Table]:
        """The shares, then a line for each run."""
        asked = {
            "plain effect: named, and its place": "named",
            "plain effect: its place alone": "place",
            "plain effect: something is said to be wrong": "noticed",
            "plain effect: a wrong name is given": "misnamed",
            "sound machine: nothing named": "sound_left_alone",
        }
        shares = [
            [what, f"{r['share']:.0%}", str(r["of"]), f"{r['low95']:.0%} to {r['high95']:.0%}"]
            for what, key in asked.items()
            if (r := result[key])["of"]
        ]
        first, last = result["seeds"]
        given = "given a recording from before" if result["given_before"] else "alone"
        title = f"Plain effects in shipped scenes, seeds {first} to {last}, {given}"
        rows = [
            [
                one["motion"],
                one["hidden"] or "nothing",
                one["verdict"],
                ", ".join(one["names"]),
                f"{one['probability']:.2f}",
                "" if one["evidence"] is None else f"{one['evidence']:.1f}",
                f"{one['rival']} {one['rival_evidence']:.1f}",
            ]
            for one in result["runs"]
        ]
        heads = ["scene", "hidden", "verdict", "named", "probability", "ln B of it", "best other"]
        return [Table(title, ["what", "share", "of", "95 %"], shares), Table("Runs", heads, rows)]


def said_of(case: Case, before: bool, recordings: Path | None) -> dict[str, Any]:
    """The diagnosis of one run."""
    from testbed.diagnosis.robot.diagnose import judged
    from testbed.diagnosis.robot.findings import as_json
    from testbed.diagnosis.robot.hypotheses import Ledger

    sound: Run | None = run_of(case.scenario(before=True), recordings) if before else None
    found = judged(str(case.seed), balances_in(run_of(case.scenario(), recordings), sound))
    said = as_json(found)
    truth = [f"{h['effect']}@{h['at']}" for h in case.hidden()]
    ledger = Ledger(found.balances)
    own = [ledger.hypothesis((name,)).log_factor for name in truth if name in ledger.names]
    others = [(f, n[0]) for n, f in found.signs.sets if len(n) == 1 and n[0] not in truth]
    rival_evidence, rival = max(others)
    return {
        "seed": case.seed,
        "motion": case.motion,
        "hidden": truth[0] if truth else "",
        "verdict": said["verdict"],
        "names": names_in(said),
        "probability": said["hypotheses"][0]["probability"],
        "evidence": own[0] if own else None,
        "rival": rival,
        "rival_evidence": rival_evidence,
    }


def _place_is_right(one: Mapping[str, Any]) -> bool:
    """Whether every place named is the one, and one is named."""
    return {place_of(name) for name in one["names"]} == {place_of(one["hidden"])}
