"""The whole robot's diagnosis on one random run, what a second motion adds where it cannot decide,
and what believing it does on another motion of the same machine.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from contextlib import suppress
from dataclasses import dataclass
from itertools import combinations
from pathlib import Path
from tempfile import TemporaryDirectory
from time import perf_counter
from typing import TYPE_CHECKING, Any

import numpy as np

from testbed.benchmarks.diagnosis.other_worlds import OtherWorld
from testbed.benchmarks.diagnosis.robot_draws import AGAIN, BEFORE, MOTIONS, THIRD, Drawn, drawn
from testbed.benchmarks.diagnosis.robot_recordings import Run, run_of
from testbed.benchmarks.diagnosis.scores import Trial
from testbed.effects import by_name
from testbed.errors import InputError
from testbed.formats.arrays import Array
from testbed.machine.build import build_machine
from testbed.machine.names import LEGS

if TYPE_CHECKING:
    from testbed.diagnosis.robot.diagnose import RobotDiagnosis
    from testbed.diagnosis.robot.groups import Balances
    from testbed.diagnosis.robot.hypotheses import Ledger
    from testbed.diagnosis.robot.probabilities import Names
    from testbed.recording.robot_model import RobotModelFile
    from testbed.robot.robot import Robot

VISIBLE = 6.0
"""An effect is visible in a run where knowing its name raises ln of the evidence by so much."""
NO_MOTION = "none"
"""Where none of the catalogue would part two sets, or control makes none of those that would."""
SETTLED_S = 1.0
"""Errors are scored after the start's transients."""


@dataclass(frozen=True)
class Asked:
    """How a trial is made. `recordings`: folder for its simulated runs; `second`: whether a second
    motion decides what the first cannot; `closed`: whether what was found is believed elsewhere;
    `alone`: whether the run is diagnosed without one from before as well; `world`: of which laws
    the machine is, None: of the simulator's.
    """

    recordings: Path | None = None
    second: bool = True
    closed: bool = True
    alone: bool = True
    world: OtherWorld | None = None

    def in_world(self, run: Run, seed: int, recording: int = 0) -> Run:
        """A run of the machine of a seed as its world would have it: see OtherWorld.recorded."""
        return run if self.world is None else self.world.recorded(run, seed, recording)


ALL_ASKED = Asked()


def trial(seed: int, asked: Asked) -> Trial:
    """The ordinary run of a seed: see trial_of."""
    return trial_of(drawn(seed), asked)


def trial_of(case: Drawn, asked: Asked) -> Trial:
    """One run: simulate it, diagnose it, compare with what was hidden; `alone`: the same of a
    diagnosis that is given no run from before.
    """
    from testbed.diagnosis.robot.diagnose import judged

    run, before = run_of(case.scenario(), asked.recordings), before_of(case, asked)
    run, before = asked.in_world(run, case.seed), asked.in_world(before, case.seed, BEFORE)
    began = perf_counter()
    balances = balances_in(run, before)
    found = judged(f"seed-{case.seed}", balances)
    seconds = perf_counter() - began
    alone = judged(f"seed-{case.seed}", balances_in(run)) if asked.alone else None
    return {
        **_said(found, case),
        "alone": {} if alone is None else _said(alone, case),
        "second": _second(found, before, case, asked) if asked.second else {},
        "closed": _closed(found, case, asked) if asked.closed else {},
        "seconds": seconds,
    }


def _said(found: RobotDiagnosis, case: Drawn) -> dict[str, Any]:
    """What is hidden in a run, what of it can be seen, and what is said of it."""
    from testbed.diagnosis.robot.findings import as_json
    from testbed.diagnosis.robot.hypotheses import Ledger
    from testbed.diagnosis.robot.probabilities import calibration

    said = as_json(found)
    return {
        "seed": case.seed,
        "motion": case.motion,
        "kind": case.kind,
        "truth": list(case.truth),
        "hidden": list(case.hidden),
        "visible": visible(Ledger(found.balances), case),
        "verdict": said["verdict"],
        "names": names_in(said),
        "effects": said["effects"],
        "hypotheses": said["hypotheses"],
        "signs": found.signs.as_json(),
        "width": calibration()["width"],
        "law": dict(calibration()["law"]),
    }


def before_of(case: Drawn, asked: Asked) -> Run:
    """The run of the sound machine that a diagnosis is given; of those that it can make."""
    refused = InputError("cannot be recorded before anything is hidden", value=case.seed)
    for scenario in case.before():
        try:
            return run_of(scenario, asked.recordings)
        except InputError as error:
            refused = error
    raise refused


def names_in(said: dict[str, Any]) -> list[str]:
    """The effects of findings, as `effect@place`."""
    return [f"{e['name']}@{e['place']}" for e in said["effects"]]


def balances_in(run: Run, sound: Run | None = None) -> Balances:
    """A run's balances with the shipped machine as what the robot believes; `sound`: an earlier run
    of the same machine, with nothing hidden.
    """
    from testbed.diagnosis.robot.groups import raw_groups
    from testbed.diagnosis.robot.noise_levels import balances_at_level

    known = None if sound is None else raw_groups(*_measured(sound))[2]
    return balances_at_level(*_measured(run), {}, known)


def _measured(run: Run) -> tuple[Mapping[str, Array], Robot, Array]:
    """A run's columns, the robot as believed, and its ropes as surveyed (2, 3)."""
    from testbed.workflows.estimate import survey_of

    survey = survey_of(run.surveyed, Path("run"))
    return run.data, survey.robot(build_machine()), survey.ropes_in_world


def visible(ledger: Ledger, case: Drawn) -> list[str]:
    """Which of the hidden effects can be seen: those whose names raise the evidence beyond that of
    the best set of hidden effects without them, or of none. One that no name covers is seen where
    its own signature, or an error of any course at its place, is worth as much.
    """
    from testbed.diagnosis.robot.unexplained import UNNAMED

    if case.kind == "outside":
        there = [f"{UNNAMED}.{part}@{h['at']}" for h in case.hidden for part in ("force", "flow")]
        there = [name for name in (*case.truth, *there) if name in ledger.names]
        most = max((ledger.hypothesis((name,)).log_factor for name in there), default=0.0)
        return list(case.truth) if most >= VISIBLE else []
    there = [name for name in case.truth if name in ledger.names]
    sets = [names for size in range(len(there) + 1) for names in combinations(there, size)]
    worth = {names: ledger.hypothesis(names).log_factor if names else 0.0 for names in sets}

    def raised(name: str) -> float:
        """By how much the best set with a name is worth more than the best one without it."""
        return max(worth[s] for s in sets if name in s) - max(
            worth[s] for s in sets if name not in s
        )

    return [name for name in there if raised(name) >= VISIBLE]


def _second(found: RobotDiagnosis, before: Run, case: Drawn, asked: Asked) -> dict[str, Any]:
    """Where the two likeliest sets cannot be distinguished: the motion that is chosen, and what
    both recordings together say; what the first one says where no motion is to part them. `third`:
    the same of a third recording, where these two cannot distinguish them either.
    """
    from testbed.diagnosis.robot.motions import rivals

    if rivals(found.verdict.hypotheses) is None:
        return {}
    rehearsed: dict[str, Balances] = {}
    after, said = _after_a_motion(found, before, (case, AGAIN), asked, rehearsed)
    if said["motion"] != NO_MOTION and rivals(after.verdict.hypotheses) is not None:
        said["third"] = _after_a_motion(after, before, (case, THIRD), asked, rehearsed)[1]
    return said


def _after_a_motion(
    found: RobotDiagnosis,
    before: Run,
    again: tuple[Drawn, int],
    asked: Asked,
    rehearsed: dict[str, Balances],
) -> tuple[RobotDiagnosis, dict[str, Any]]:
    """What is said after the motion that promises to part the likeliest sets; `again`: the machine,
    and the seed of the recording's noise beside its own; `rehearsed`: what has been, and will be.
    """
    from testbed.diagnosis.robot.diagnose import judged
    from testbed.diagnosis.robot.findings import as_json
    from testbed.diagnosis.robot.hypotheses import Ledger
    from testbed.diagnosis.robot.motions import (
        made,
        motion_named,
        parted_sets,
        parting,
        promises,
        rivals,
    )
    from testbed.diagnosis.robot.several_recordings import together

    case, noise = again
    parted = parted_sets(found)
    asked_for = rehearsals(case, parted, asked, rehearsed)
    promised = promises(Ledger(found.balances), parted, asked_for)
    motion, after = NO_MOTION, found
    for chosen in parting(promised, parted):
        with suppress(InputError):  # steep ground refuses some: then the next best
            ways = motion_named(chosen)
            run = made(ways, lambda told: run_of(case.again(told, noise), asked.recordings))[1]
            balances = together(found.balances, balances_in(run, before))
            motion, after = chosen, judged(found.name, balances)
            break
    said = as_json(after)
    return after, {
        "rivals": [list(names) for names in rivals(found.verdict.hypotheses) or ()],
        "motion": motion,
        "promised": promised,
        "visible": visible(Ledger(after.balances), case),
        "verdict": said["verdict"],
        "names": names_in(said),
        "hypotheses": said["hypotheses"],
    }


def rehearsals(
    case: Drawn, parted: Iterable[Names], asked: Asked, rehearsed: dict[str, Balances]
) -> dict[str, Balances]:
    """Motions of the catalogue, of the machine as it is believed where it stands: those that may
    part these sets. `rehearsed`: those that have been, to which the others are added.
    """
    from testbed.diagnosis.robot.motions import made, motions_for
    from testbed.diagnosis.robot.noise_levels import rehearsed_balances

    wanted = motions_for(parted)
    for motion in wanted:
        if motion.name not in rehearsed:
            with suppress(InputError):  # from here it cannot make this one
                run = made(motion, lambda told: run_of(case.rehearsed(told), asked.recordings))[1]
                rehearsed[motion.name] = rehearsed_balances(*_measured(run))
    return {motion.name: rehearsed[motion.name] for motion in wanted if motion.name in rehearsed}


def _closed(found: RobotDiagnosis, case: Drawn, asked: Asked) -> dict[str, float]:
    """Foot-force error, N RMS over the feet, on another motion: as believed, with what was found,
    with what is really hidden believed to the number (`told`), and of the machine without what is
    hidden; nothing where control refuses that motion.
    """
    from testbed.diagnosis.robot.findings import models
    from testbed.recording.robot_model import RobotModelFile, write_robot_model

    if found.verdict.kind != "effect":
        return {}
    names = list(MOTIONS)
    other = names[(names.index(case.motion) + 1) % len(names)]
    sound = Drawn(case.seed, case.motion, "clean", (), case.overrides[:-1])
    with TemporaryDirectory() as folder, suppress(InputError):
        after, told = (Path(folder) / name for name in ("model.yaml", "told.yaml"))
        write_robot_model(after, models(found, RobotModelFile())["after"])
        write_robot_model(told, told_model(case))
        run = run_of(case.scenario(other), asked.recordings)
        return {
            "before": force_error_n(run, None),
            "after": force_error_n(run, after),
            "told": force_error_n(run, told),
            "sound": force_error_n(run_of(sound.scenario(other), asked.recordings), None),
        }
    return {}


def told_model(case: Drawn) -> RobotModelFile:
    """The model file of who knows what is hidden in a run, to the number."""
    from testbed.recording.leg_model import Parameter
    from testbed.recording.robot_model import PlacedEffect, RobotModelFile

    told = []
    for hidden in case.hidden:
        spec = by_name(hidden["effect"]).spec
        values = {k: Parameter(value=v, unit=spec(k).unit) for k, v in hidden["parameters"].items()}
        told.append(PlacedEffect(name=hidden["effect"], place=hidden["at"], parameters=values))
    return RobotModelFile(effects=tuple(told))


def force_error_n(run: Run, model: Path | None) -> float:
    """Root mean square error of the own estimate over the four feet, N, with what a model file adds
    to the belief.
    """
    from testbed.estimation.live.joined import forces
    from testbed.workflows.estimate import with_body
    from testbed.world.believed_robot import believed_robot

    believed = believed_robot(build_machine(), model)
    belief = believed.legs(float(np.median(np.diff(run.data["t"]))))
    told = forces(run.data, with_body(belief, believed, run.surveyed, Path("run")))
    later = run.data["t"] > run.data["t"][0] + SETTLED_S
    errors = [told[f"force_{leg}_n"] - run.truth[f"foot_load_{leg}"] for leg in LEGS]
    return float(np.sqrt(np.mean(np.square(errors)[:, later])))
