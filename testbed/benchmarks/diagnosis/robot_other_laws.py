"""The blind test of the robot's diagnosis on machines of other laws: the runs of robot_benchmark,
as other_worlds changes them.

Neither a second motion nor what a find closes elsewhere is asked: another motion's forces are the
simulator's.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

from testbed.benchmarks.diagnosis.other_worlds import FAMILIES, OtherWorld
from testbed.benchmarks.diagnosis.robot_benchmark import RobotBlindTest
from testbed.benchmarks.diagnosis.robot_scores import target
from testbed.benchmarks.diagnosis.robot_trials import Asked
from testbed.benchmarks.diagnosis.scores import Trial, rate
from testbed.benchmarks.harness import Answers
from testbed.report.page import Table

WORLD = OtherWorld()
ASKED = Asked(second=False, closed=False, world=WORLD)


@dataclass(frozen=True)
class RobotOtherLaws(RobotBlindTest):
    """`runs` runs of consecutive seeds, each machine of a world of other laws."""

    name = "robot_other_laws"
    asked: Asked = ASKED

    def work(self, case: int) -> Trial:
        """See RobotBlindTest; `families`: the laws of its world."""
        return {**super().work(case), "families": list(self._world.of_machine(case))}

    @property
    def _world(self) -> OtherWorld:
        return self.asked.world or WORLD

    def made_from(self, case: int) -> str:
        """Where runs are kept has no say."""
        return repr((case, self._world))

    def summarise(self, answers: Answers) -> dict[str, Any]:
        """See RobotBlindTest, and what is said by each law that a world has."""
        made = [answer for answer in answers.values() if "refused" not in answer]
        by_law = {f: _said([t for t in made if f in t["families"]]) for f in FAMILIES}
        return {
            **super().summarise(answers),
            "size": self._world.size,
            "families": list(self._world.families),
            "by_law": {family: said for family, said in by_law.items() if said["runs"]},
        }

    def tables(self, result: dict[str, Any]) -> Sequence[Table]:
        """Those of RobotBlindTest that were asked, and one by law."""
        marks, alone, _, _, by_effect, stated = super().tables(result)
        return [marks, alone, _by_law(result), by_effect, stated]


def _said(trials: Sequence[Trial]) -> dict[str, Any]:
    """How many runs; of sound ones those left alone, with a run from before and without; of those
    that hide what shows, the ones named rightly.
    """
    sound = [t for t in trials if t["kind"] == "clean"]
    seen = [t for t in trials if t["kind"] in ("single", "double") and t["visible"]]
    return {
        "runs": len(trials),
        "sound": rate([t["verdict"] == "none" for t in sound]),
        "sound_alone": rate([t["alone"]["verdict"] == "none" for t in sound]),
        "named": rate([frozenset(t["names"]) == target(t) for t in seen]),
    }


def _by_law(found: dict[str, Any]) -> Table:
    rows = []
    for family, said in found["by_law"].items():
        shares = [said[key] for key in ("sound", "sound_alone", "named")]
        cells = [f"{s['share']:.0%} of {s['of']}" if s["of"] else "" for s in shares]
        rows.append([family.replace("_", " "), str(said["runs"]), *cells])
    heads = ["law in the world", "runs", "sound left alone", "... without a run before", "named"]
    return Table("By law; most worlds have several", heads, rows)
