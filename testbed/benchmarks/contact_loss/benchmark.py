"""The contact-loss benchmark: scenes recorded once, all detectors on the same samples, a floor
beside them.
"""

from __future__ import annotations

import inspect
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from testbed.benchmarks.contact_loss.page import curves, page
from testbed.benchmarks.contact_loss.recordings import Tape, facts_of, read_tape, record
from testbed.benchmarks.contact_loss.rivals import (
    grid_of,
    published,
    rivals,
    scores_of,
    thresholds_text,
)
from testbed.benchmarks.contact_loss.scenes import SETTLE_S, Scene, scenes
from testbed.benchmarks.contact_loss.score import Reference, scored, squares
from testbed.benchmarks.contact_loss.summary import COMMISSIONED, summarise, tables, tuned
from testbed.benchmarks.contact_loss.warning import outcomes
from testbed.benchmarks.harness import Answers, Benchmark, answers, code, digest
from testbed.errors import InputError
from testbed.estimation.detectors.base import Detector
from testbed.estimation.detectors.table import detector_of
from testbed.formats.files import make_folder, whole, write_text
from testbed.formats.records import SET
from testbed.formats.sockets import split_user_class, user_code
from testbed.report.page import Table
from testbed.workflows.commission import commission, recorded

Tree = dict[str, Any]
PILOTS = 8
"""Scenes that thresholds to look at are taken from."""
IN_THE_LOOP = ("base.py", "combined.py", "sample.py", "table.py")
"""Of the detectors' files those that have a say in what a machine does while it is recorded."""


@dataclass(frozen=True)
class Recorded(Benchmark[Scene]):
    """Scenes as recordings in `folder`."""

    name = "scenes"
    noun = "scenes to record"
    folder: Path
    chosen: tuple[Scene, ...]

    def cases(self) -> Mapping[str, Scene]:
        """Each scene."""
        return {scene.name: scene for scene in self.chosen}

    def made_from(self, case: Scene) -> str:
        """The scene alone, wherever its folder is."""
        return repr(case)

    def without(self) -> tuple[str, ...]:
        """What is made of a recording is no part of it."""
        ours = (
            *("benchmark", "floor", "limit", "published", "rivals", "score", "summary", "training"),
            "warning*",
        )
        detectors = Path(inspect.getfile(Detector)).parent.iterdir()
        return (
            *(f"benchmarks/contact_loss/{name}.py" for name in ours),
            *(
                f"estimation/detectors/{file.name}"
                for file in detectors
                if file.name not in IN_THE_LOOP
            ),
        )

    def work(self, case: Scene) -> Tree:
        """See tapes.record."""
        return record(case, self.folder / case.name)

    def summarise(self, answers: Answers) -> Answers:
        """What is known of each."""
        return answers

    def tables(self, result: Answers) -> Sequence[Table]:
        """None."""
        return []


@dataclass(frozen=True)
class Commissioned(Benchmark[int]):
    """The scenes' machines commissioned, each once, before anything went wrong with them: model
    files in `folder`.
    """

    name = "machines"
    noun = "machines to commission"
    folder: Path
    draw: str
    seeds: tuple[int, ...]

    def cases(self) -> Mapping[str, int]:
        """Each machine by its seed."""
        return {str(seed): seed for seed in self.seeds}

    def made_from(self, case: int) -> str:
        """The machine and the command that commissions it, wherever the folder is."""
        return f"{case} {self.draw} {code(Path(inspect.getfile(commission)))}"

    def without(self) -> tuple[str, ...]:
        """The benchmark itself, and what is made of recordings."""
        return ("benchmarks/contact_loss/*.py", *Recorded(self.folder, ()).without())

    def work(self, case: int) -> Tree:
        """Runs the programme of commissioning and writes the model file; the numbers it found."""
        changes = (f"machine.draw={self.draw}", f"machine.seed={case}")
        with recorded("commissioning_flat", changes, case) as runs:
            found = commission(runs, model_file(self.folder, case))
        return {"numbers": found["numbers"]}

    def summarise(self, answers: Answers) -> Answers:
        """What was found of each."""
        return answers

    def tables(self, result: Answers) -> Sequence[Table]:
        """None."""
        return []


def model_file(folder: Path, machine_seed: int) -> Path:
    """Where the model of a commissioned machine lies."""
    return folder / f"{machine_seed}.yaml"


@dataclass(frozen=True)
class ContactLoss(Benchmark[Scene]):
    """`hours` of feet in scoring scenes; `tune`: as many in tuning scenes, which set all thresholds
    anew.

    `own`: detectors of the user's own, FILE.py:Class, beside the shipped ones; their thresholds are
    set on the tuning scenes, whatever the classes say. `draw`: tolerances from which the scenes'
    machines are drawn; None: none is. `commission`: score everything once more with what each
    machine's commissioning found; thresholds stay what they are. Raises InputError for hours that
    make no sense, for a class that is not there or does not fit, and for a commissioning of
    machines that are not drawn.
    """

    name = "contact_loss"
    noun = "scenes to score"
    hours: float = 1.0
    tune: bool = False
    draw: str | None = "workshop"
    own: tuple[str, ...] = ()
    commission: bool = False
    folder: Path = Path()
    """Where the scenes' recordings are; beside it the machines' model files."""
    grids: tuple[tuple[str, tuple[float, ...]], ...] = ()
    """Thresholds that each detector is looked at with; that of a shipped one first."""

    def __post_init__(self) -> None:
        if not 0.0 < self.hours <= 1000.0:
            allowed = "more than 0, at most 1000"
            raise InputError("is out of range", field="--hours", value=self.hours, allowed=allowed)
        if self.commission and self.draw is None:
            allowed = "with machines that are drawn (--draw)"
            raise InputError("has no effect", field="--commission", allowed=allowed)
        for name in self.own:
            split_user_class(name, field="--detector")
            detector_of(name, "--detector")

    def prepared(self, out: Path, jobs: int) -> ContactLoss:
        """With all scenes recorded and every detector's thresholds chosen."""
        folder = make_folder(out / "scenes")
        chosen = tuple(self.cases().values())
        found = answers(Recorded(folder, chosen), jobs, folder)
        if self.commission and self.draw is not None:
            machines = make_folder(out / "machines")
            seeds = tuple(dict.fromkeys(s.machine_seed for s in chosen if s.kind != "supervised"))
            answers(Commissioned(machines, self.draw, seeds), jobs, machines)
        usable = [folder / name for name, facts in found.items() if facts["simulated_s"] > SETTLE_S]
        pilots = [read_tape(place) for place in usable[:PILOTS]]
        grids = grid_of(pilots, self.own, self.tune)
        return replace(self, folder=folder, grids=tuple(grids.items()))

    def cases(self) -> Mapping[str, Scene]:
        """The scoring scenes; before them the tuning ones where something is tuned."""
        chosen = scenes("scoring", self.hours, self.draw)
        if self.tune or self.own:
            chosen = scenes("tuning", self.hours, self.draw) + chosen
        return {scene.name: scene for scene in chosen}

    def made_from(self, case: Scene) -> str:
        """The scene, the thresholds, and the user's files."""
        files = [split_user_class(name, field="--detector")[0] for name in self.own]
        return f"{case!r} {self.grids} {self.commission} {digest(*map(code, files))}"

    def without(self) -> tuple[str, ...]:
        """What comes after the scores."""
        return ("benchmarks/contact_loss/summary.py", "benchmarks/contact_loss/training.py")

    def work(self, case: Scene) -> Tree:
        """One scene: its losses, and what every detector made of them at each of its thresholds;
        nothing of one that ended before it is scored.
        """
        place = self.folder / case.name
        if not (place / "truth.parquet").is_file():
            record(case, place)
        if facts_of(place)["simulated_s"] <= SETTLE_S:
            return {}
        tape = read_tape(place)
        late = tape.time_s >= SETTLE_S
        meant = tape.samples["row"]["carrying"][late] > SET
        reference = Reference.of(tape.normal_n[late], meant, tape.time_s[late], tape.rule)
        found = self._judged(case, tape, reference) | reference.facts()
        if self.commission and case.kind != "supervised":
            model = model_file(self.folder.parent / "machines", case.machine_seed)
            found[COMMISSIONED] = self._judged(case, read_tape(place, model), reference)
        return found

    def _judged(self, case: Scene, tape: Tape, reference: Reference) -> Tree:
        """What every detector made of a scene, and the warnings."""
        late, found = tape.time_s >= SETTLE_S, {}
        with user_code():
            for name, thresholds in self.grids if case.kind != "supervised" else ():
                score, hold = scores_of(name, tape, case)
                found[name] = scored(
                    score[late], np.array(thresholds), reference, hold, name not in self.own
                )
        own = tape.samples["row"]["estimate"]["own"][late]
        square = squares(own - tape.load_n[late], reference)
        return {"detectors": found, "square": square, "warning": outcomes(case, tape, reference)}

    def summarise(self, answers: Answers) -> Tree:
        """See summary.summarise; the result carries the thresholds that it was scored with."""
        kept = [facts_of(self.folder / name) | answer for name, answer in answers.items() if answer]
        tuning = [a for a in kept if a["scene"]["split"] == "tuning"]
        scoring = [a for a in kept if a["scene"]["split"] == "scoring"]
        grids = dict(self.grids)
        chosen = {name: 0 for name in grids if name not in self.own}
        if tuning:
            again = grids if self.tune else self.own
            chosen |= tuned(tuning, {name: grids[name] for name in again})
        return summarise(scoring, self.hours, grids, chosen, rivals(self.own))

    def published(self, result: Tree) -> Tree:
        """See published.published."""
        return published(result)

    def tables(self, result: Tree) -> Sequence[Table]:
        """All detectors, before and after commissioning."""
        return tables(result)

    def page(self, result: Tree) -> str:
        """See page.page."""
        return page(result)

    def write_more(self, result: Tree, out: Path) -> None:
        """contact_loss_curves.png; after tuning thresholds.yaml."""
        with whole(out / "contact_loss_curves.png") as hidden:
            curves(result).savefig(hidden, dpi=110, format="png")
        if self.tune:
            found = {d["name"]: d["threshold"] for d in result["detectors"]}
            write_text(out / "thresholds.yaml", thresholds_text(found, self.hours))
