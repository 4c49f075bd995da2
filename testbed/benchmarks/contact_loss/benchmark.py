"""The contact-loss benchmark: scenes run once, all detectors on the same rows."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from testbed.benchmarks.contact_loss.loads import unpacked
from testbed.benchmarks.contact_loss.page import curves, page
from testbed.benchmarks.contact_loss.scenes import Scene, Split, scenes
from testbed.benchmarks.contact_loss.summary import summarise, table, tuned
from testbed.benchmarks.contact_loss.thresholds import shipped_thresholds, thresholds_text
from testbed.benchmarks.contact_loss.warning import outcomes
from testbed.benchmarks.contact_loss.watch import run_scene
from testbed.benchmarks.harness import Answers, Benchmark
from testbed.errors import InputError
from testbed.formats.files import whole, write_text
from testbed.report.tables import Table

Tree = dict[str, Any]


@dataclass(frozen=True)
class ContactLoss(Benchmark[Scene]):
    """`hours` of quiet drilling and their losses; `tune`: the tuning scenes, whose thresholds are written too.

    Raises InputError for hours that make no sense.
    """

    name = "contact_loss"
    noun = "scenes"
    hours: float = 8.0
    tune: bool = False

    def __post_init__(self) -> None:
        if not 0.0 < self.hours <= 1000.0:
            allowed = "more than 0, at most 1000"
            raise InputError("is out of range", field="--hours", value=self.hours, allowed=allowed)

    def cases(self) -> Mapping[str, Scene]:
        """The scenes of one split."""
        split: Split = "tuning" if self.tune else "scoring"
        return {scene.name: scene for scene in scenes(split, self.hours)}

    def work(self, case: Scene) -> Tree:
        """See watch.run_scene."""
        return run_scene(case)

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
        scored = [a | {"warning": outcomes(a, unpacked(a["loads"]))} for a in answers.values()]
        thresholds = tuned(scored) if self.tune else shipped_thresholds()
        return summarise(scored, self.hours, thresholds)

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
