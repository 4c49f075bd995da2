"""Every estimator on the same runs: the paper's ladder, ours idea by idea, and the floor that the
sensors set.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

from testbed.benchmarks.estimators.page import page, table, targets
from testbed.benchmarks.estimators.scores import result, scores
from testbed.benchmarks.estimators.trials import DITHERED, JUDGE, LIARS, Trial, simulate
from testbed.benchmarks.harness import Answers, Benchmark, code, digest
from testbed.errors import check_one_of
from testbed.estimation.estimator import estimator_of
from testbed.estimation.live.uncertainty import Uncertainty
from testbed.formats.sockets import split_user_class
from testbed.machine.build import build_machine
from testbed.report.page import Table
from testbed.world.believed_robot import BelievedRobot

RUNS = (*JUDGE, *DITHERED, *LIARS)
"""The runs that results come from."""


@dataclass(frozen=True)
class Estimators(Benchmark[Trial]):
    """All runs; `few`: one of each kind; `kinds`: of these alone; `own`: estimators of the user's
    own, FILE.py:Class, beside the shipped ones.

    Raises InputError for a class that is not there or does not fit, and for an unknown kind.
    """

    name = "estimators"
    noun = "runs"
    few: bool = False
    draw: str | None = "workshop"
    """Tolerances from which each run's machine is drawn, beside the errors of friction that it has
    anyhow.
    """

    own: tuple[str, ...] = ()
    kinds: tuple[str, ...] = ()

    def __post_init__(self) -> None:
        known = dict.fromkeys(trial.kind for trial in RUNS)
        for kind in self.kinds:
            check_one_of(kind, known, "--kind", "no such kind of run")
        for name in self.own:
            split_user_class(name, field="--estimator")
            estimator_of(name, "--estimator")

    def made_from(self, case: Trial) -> str:
        """The run, and the user's files."""
        files = [split_user_class(name, field="--estimator")[0] for name in self.own]
        return f"{case!r} {self.own} {digest(*map(code, files))}" if files else repr(case)

    def cases(self) -> Mapping[str, Trial]:
        """The runs that results come from."""
        wanted = [trial for trial in RUNS if not self.kinds or trial.kind in self.kinds]
        every = tuple(replace(trial, draw=self.draw) for trial in wanted)
        first = {trial.kind: trial for trial in reversed(every)}
        return {trial.name: trial for trial in (first.values() if self.few else every)}

    def work(self, case: Trial) -> dict[str, Any]:
        """The run's scores, which add up with those of other runs."""
        believed = BelievedRobot(build_machine(), sure=Uncertainty(case.draw))
        return {
            "name": case.name,
            "kind": case.kind,
            "oil_degc": case.oil_degc,
            "scores": scores(simulate(case.load()), believed, self.own),
        }

    def summarise(self, answers: Answers) -> dict[str, Any]:
        """Marks by estimator over groups of runs, and what was wanted of the own estimate."""
        answer = result(list(answers.values()))
        return answer | {"targets": targets(answer)}

    def tables(self, result: dict[str, Any]) -> Sequence[Table]:
        """One table over all runs, or over the first group where those are few."""
        groups = result["groups"]
        return [
            table(
                result, "all temperatures" if "all temperatures" in groups else next(iter(groups))
            )
        ]

    def page(self, result: dict[str, Any]) -> str:
        """See page.page."""
        return page(result)
