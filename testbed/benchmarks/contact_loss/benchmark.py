"""The contact-loss benchmark: scenes run once, all detectors on the same rows."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from testbed.benchmarks.contact_loss.loads import unpacked
from testbed.benchmarks.contact_loss.page import curves, page
from testbed.benchmarks.contact_loss.scenes import Scene, scenes
from testbed.benchmarks.contact_loss.summary import summarise, table, tuned
from testbed.benchmarks.contact_loss.thresholds import (
    rivals,
    shipped_thresholds,
    thresholds_text,
)
from testbed.benchmarks.contact_loss.warning import outcomes
from testbed.benchmarks.contact_loss.watch import run_scene
from testbed.benchmarks.harness import Answers, Benchmark
from testbed.benchmarks.marks import code, digest
from testbed.errors import InputError
from testbed.estimation.detectors.table import detector_of
from testbed.formats.files import whole, write_text
from testbed.formats.sockets import split_user_class, user_code
from testbed.report.tables import Table

Tree = dict[str, Any]


@dataclass(frozen=True)
class ContactLoss(Benchmark[Scene]):
    """`hours` of quiet drilling and their losses; `tune`: the tuning scenes, whose thresholds are written too.

    `own`: detectors of the user's own, FILE.py:Class, beside the shipped ones; their thresholds are set on the tuning
    scenes, which are run for that, whatever the classes say. Raises InputError for hours that make no sense and for a
    class that is not there or does not fit.
    """

    name = "contact_loss"
    noun = "scenes"
    hours: float = 8.0
    tune: bool = False
    draw: str | None = None
    """Tolerances from which each scene's machine is drawn."""
    own: tuple[str, ...] = ()

    def __post_init__(self) -> None:
        if not 0.0 < self.hours <= 1000.0:
            allowed = "more than 0, at most 1000"
            raise InputError("is out of range", field="--hours", value=self.hours, allowed=allowed)
        for name in self.own:
            split_user_class(name, field="--detector")
            detector_of(name, "--detector")

    def cases(self) -> Mapping[str, Scene]:
        """The scenes of one split."""
        chosen = scenes("tuning" if self.tune else "scoring", self.hours, self.draw)
        if self.own and not self.tune:
            every = scenes("tuning", self.hours, self.draw)
            chosen = [*(s for s in every if s.kind != "supervised"), *chosen]
        return {scene.name: scene for scene in chosen}

    def made_from(self, case: Scene) -> str:
        """The scene, and the user's files."""
        files = [split_user_class(name, field="--detector")[0] for name in self.own]
        return f"{case!r} {self.own} {digest(*map(code, files))}" if files else repr(case)

    def work(self, case: Scene) -> Tree:
        """See watch.run_scene."""
        shipped = case.split == "scoring" or self.tune
        with user_code():
            return run_scene(case, rivals(self.own) if shipped else self.own)

    def without(self) -> tuple[str, ...]:
        """Thresholds and warning are applied to what is kept of a scene."""
        own = ("summary.py", "thresholds.py", "warning*.py")
        detectors = "estimation/detectors"
        return (
            *(f"benchmarks/contact_loss/{name}" for name in own),
            f"{detectors}/warning.py",
        )

    def summarise(self, answers: Answers) -> Tree:
        """See summary.summarise; the result carries the thresholds that it was scored with."""
        tuning = [a for a in answers.values() if a["scene"]["split"] == "tuning"]
        kept = [a for a in answers.values() if self.tune or a["scene"]["split"] == "scoring"]
        scored = [a | {"warning": outcomes(a, unpacked(a["loads"]))} for a in kept]
        thresholds = shipped_thresholds() | (tuned(tuning) if tuning else {})
        return summarise(scored, self.hours, thresholds, rivals(self.own))

    def tables(self, result: Tree) -> Sequence[Table]:
        """One table."""
        return [table(result)]

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
