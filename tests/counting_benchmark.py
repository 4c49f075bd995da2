"""A benchmark that counts: its cases write a file each, wait, and answer; run as a program, it is
there to be killed.
"""

from __future__ import annotations

import os
import signal
import sys
import time
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from testbed.benchmarks import harness
from testbed.benchmarks.harness import Answers, Benchmark, run
from testbed.report.page import Table


@dataclass(frozen=True)
class Counting(Benchmark[int]):
    """`count` cases; each leaves a file in `folder`, called after case and process."""

    name = "counting"
    noun = "cases"
    folder: Path
    count: int = 4
    wait_s: float = 0.0
    options: str = ""

    def cases(self) -> Mapping[str, int]:
        return {f"case {number}": number for number in range(self.count)}

    def work(self, case: int) -> dict[str, Any]:
        (self.folder / f"{case}-{os.getpid()}-{time.time_ns()}").touch()
        time.sleep(self.wait_s)
        return {"square": case**2, "threads": os.environ.get("OMP_NUM_THREADS")}

    def made_from(self, case: int) -> str:
        return f"{case} {self.options}"

    def summarise(self, answers: Answers) -> dict[str, Any]:
        return {"squares": [answer["square"] for answer in answers.values()]}

    def tables(self, result: dict[str, Any]) -> list[Table]:
        return [Table("Squares", ["square"], [[str(n)] for n in result["squares"]])]

    def page(self, result: dict[str, Any]) -> str:
        return f"<p>{result['squares']}</p>"


if __name__ == "__main__":
    setattr(harness, "sources", lambda *_: "the sources")  # noqa: B010 as conftest has it
    out, made, wait_s, jobs = sys.argv[1:]
    signal.signal(signal.SIGINT, signal.default_int_handler)  # a shell's background ignores it
    run(Counting(Path(made), count=6, wait_s=float(wait_s)), Path(out), int(jobs))
