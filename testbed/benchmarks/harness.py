"""One harness for all benchmarks: what a benchmark says of itself, and what is done with it.

A benchmark names its cases, says what one case does, how the answers are summed up, and how the sum
is shown. The harness works through the cases in processes, keeps every answer as a line of
`cases.jsonl`, resumes where a killed process stopped, and writes NAME.json, NAME.md and, where the
benchmark has a page, NAME.html.
"""

from __future__ import annotations

import ast
import hashlib
import inspect
import json
import math
from abc import ABC, abstractmethod
from collections.abc import Iterable, Mapping, Sequence
from contextlib import closing, nullcontext, suppress
from functools import cache, partial
from pathlib import Path
from typing import Any, ClassVar, Generic, Self, TypeVar

import numpy as np
from numpy.typing import ArrayLike

from testbed import resources
from testbed.errors import InputError
from testbed.formats.files import Lines, owned, plain, resumable, write_json, write_text
from testbed.report.console import counting_progress
from testbed.report.page import Table, markdown
from testbed.simulation.workers import Workers, work_through

# What a benchmark's case was made with, as a digest: an answer made by other sources or options is
# not taken over.

PACKAGE = Path(__file__).resolve().parents[1]
SHOWING = ("report", "workflows", "benchmarks", "cli")
"""Rooms that have no say in what a simulation or an estimate gives."""
ENDINGS = (".py", ".yaml", ".urdf", ".npz")


@cache
def sources(folders: tuple[str, ...], without: tuple[str, ...] = ()) -> str:
    """Digest of what decides what the cases of these folders of benchmarks/ give, `without` some
    (path patterns).
    """
    files = [
        path
        for path in PACKAGE.rglob("*")
        if path.suffix in ENDINGS and _decides(path.relative_to(PACKAGE), folders, without)
    ]
    shipped = (path for name in ("urdf", "scenarios") for path in resources.folder(name).rglob("*"))
    return digest(
        *map(code, sorted(files)), *map(code, sorted(path for path in shipped if path.is_file()))
    )


def _decides(path: Path, folders: Iterable[str], without: Iterable[str]) -> bool:
    if path.name == "page.py" or any(path.match(pattern) for pattern in without):
        return False
    room = path.parts[0]
    return room not in SHOWING or (room == "benchmarks" and path.parts[1] in folders)


def digest(*parts: str) -> str:
    """Digest of several texts."""
    return hashlib.sha256("\0".join(parts).encode()).hexdigest()[:16]


@cache
def code(path: Path) -> str:
    """A file's content; of Python what is executed alone, without comments, docstrings and
    layout.
    """
    if path.suffix != ".py":
        return hashlib.sha256(path.read_bytes()).hexdigest()
    tree = ast.parse(path.read_text(encoding="utf-8"))
    for node in ast.walk(tree):
        if isinstance(body := getattr(node, "body", None), list):
            node.body = [line for line in body if not _is_text(line)]  # type: ignore[attr-defined]
    return path.name + ast.dump(tree)


def _is_text(line: ast.AST) -> bool:
    return (
        isinstance(line, ast.Expr)
        and isinstance(line.value, ast.Constant)
        and isinstance(line.value.value, str)
    )


CaseT = TypeVar("CaseT")
Answers = dict[str, Any]
LINES = "cases.jsonl"
DIGITS = 5
"""Significant digits of the fractions in NAME.json: more than any benchmark's cases can tell apart.
"""


class Benchmark(ABC, Generic[CaseT]):
    """One benchmark with its options; a frozen dataclass of few and small fields, for every process
    gets a copy.

    An answer is made of what JSON knows, of NumPy's numbers and of dataclasses; it reaches
    `summarise` as JSON has it.
    """

    name: ClassVar[str]
    """The files it writes are called after it."""
    noun: ClassVar[str]
    """What its cases are called, in the plural."""
    beside: ClassVar[tuple[str, ...]] = ()
    """Other benchmarks' folders whose sources its cases use."""

    def prepared(self, out: Path, jobs: int) -> Self:
        """The benchmark once all is there that its cases need; what takes long is kept in `out`."""
        return self

    @abstractmethod
    def cases(self) -> Mapping[str, CaseT]:
        """Every case by a name of its own, in order; what a case is, is small and can be
        pickled.
        """

    @abstractmethod
    def work(self, case: CaseT) -> Any:
        """The answer of one case. Runs in a process of its own."""

    @abstractmethod
    def summarise(self, answers: Answers) -> Any:
        """The result: what all answers, by case and in order, say together."""

    @abstractmethod
    def tables(self, result: Any) -> Sequence[Table]:
        """The result as tables for a person."""

    def page(self, result: Any) -> str | None:
        """The result as a self-contained HTML page; None: there is none."""
        return None

    def published(self, result: Any) -> Any:
        """What NAME.json holds of the result."""
        return result

    def write_more(self, result: Any, out: Path) -> None:
        """Further files of the result."""
        return

    def made_from(self, case: CaseT) -> str:
        """What an answer depends on beside the sources: all that is particular to the case."""
        return repr(case)

    def without(self) -> tuple[str, ...]:
        """Sources that have no say in what any case gives: patterns of paths below the package."""
        return ()

    def mark(self, case: CaseT) -> str:
        """Digest of everything that decides what a case gives; another mark, and it is worked out
        again.
        """
        own = Path(inspect.getfile(type(self)))
        common = sources((own.parent.name, *self.beside), self.without())
        return digest(common, code(own), self.made_from(case))


def run(benchmark: Benchmark[Any], out: Path, jobs: int = 1) -> Any:
    """Work through all cases that `out` does not have yet, write the result's files; returns the
    result.

    Raises InputError where `out` cannot be written or another process is at work in it, before any
    work is done.
    """
    with owned(out), resumable(out):
        benchmark = benchmark.prepared(out, jobs)
        result = benchmark.summarise(answers(benchmark, jobs, out))
        write(benchmark, result, out)
    return result


def write(benchmark: Benchmark[Any], result: Any, out: Path) -> None:
    """NAME.json with its numbers rounded, NAME.md, NAME.html and what the benchmark adds."""
    write_json(out / f"{benchmark.name}.json", rounded(plain(benchmark.published(result))))
    write_text(out / f"{benchmark.name}.md", "\n".join(map(markdown, benchmark.tables(result))))
    page = benchmark.page(result)
    if page is not None:
        write_text(out / f"{benchmark.name}.html", page)
    benchmark.write_more(result, out)


def rounded(tree: Any) -> Any:
    """What JSON knows, with every fraction to DIGITS significant digits; whole numbers, such as
    counts and seeds, stay what they are.
    """
    if isinstance(tree, dict):
        return {name: rounded(item) for name, item in tree.items()}
    if isinstance(tree, list):
        return [rounded(item) for item in tree]
    if isinstance(tree, float):
        return float(f"{tree:.{DIGITS}g}")
    return tree


def answers(benchmark: Benchmark[CaseT], jobs: int = 1, out: Path | None = None) -> Answers:
    """Every case's answer, in order. `out`: folder where finished ones are kept, and taken from."""
    cases = benchmark.cases()
    marks = {key: benchmark.mark(case) for key, case in cases.items()} if out is not None else {}
    found = _read(out / LINES, marks) if out is not None else {}
    todo = [(key, case) for key, case in cases.items() if key not in found]
    kept = closing(Lines(out / LINES)) if out is not None else nullcontext()
    with kept as lines, counting_progress(len(cases), benchmark.noun) as tell:
        if tell is not None:
            tell(len(found))
        for key, answer in work_through(
            partial(_work, benchmark), todo, Workers.from_environment(jobs)
        ):
            if lines is not None:
                lines.add(_text({"case": key, "mark": marks[key], "answer": answer}))
            found[key] = as_json(answer)
            if tell is not None:
                tell(len(found))
    return {key: found[key] for key in cases}


def stored(out: Path) -> list[Any]:
    """All answers that a folder holds, whatever they were made with. Raises InputError where there
    is none.
    """
    found = list(_read(out / LINES, None).values())
    if not found:
        raise InputError("holds no finished cases", file=out, allowed=f"a benchmark's {LINES}")
    return found


def as_json(answer: Any) -> Any:
    """An answer as it comes back from its line, whether it was just made or kept."""
    return json.loads(_text(answer))


def _work(benchmark: Benchmark[CaseT], item: tuple[str, CaseT]) -> tuple[str, Any]:
    return item[0], benchmark.work(item[1])


def _text(tree: Any) -> str:
    return json.dumps(tree, default=lambda v: v.tolist() if hasattr(v, "tolist") else vars(v))


def _read(lines: Path, marks: Mapping[str, str] | None) -> Answers:
    """Answers of the cases with these marks (None: of all); a line that was cut off counts for
    nothing.
    """
    found: Answers = {}
    if not lines.is_file():
        return found
    with lines.open(encoding="utf-8") as file:
        for line in file:
            with suppress(ValueError, KeyError, TypeError):
                kept = json.loads(line)
                if marks is None or marks.get(kept["case"]) == kept["mark"]:
                    found[kept["case"]] = kept["answer"]
    return found


# Figures that benchmarks state: root mean squares, intervals of shares and rates.


def rms(values: ArrayLike) -> float:
    """Root mean square, in their unit."""
    return float(np.sqrt(np.mean(np.square(values))))


def wilson(hits: int, of: int, z: float = 1.959964) -> list[float] | None:
    """95 % interval of a share (Wilson's score); None of nothing."""
    if of == 0:
        return None
    share, shrink = hits / of, 1.0 + z * z / of
    middle = (share + z * z / (2 * of)) / shrink
    half = z / shrink * math.sqrt(share * (1 - share) / of + z * z / (4.0 * of * of))
    return [max(0.0, middle - half), min(1.0, middle + half)]


def poisson(count: int, hours: float) -> list[float] | None:
    """Exact 95 % interval of a rate an hour from `count` events; None of no time."""
    from scipy.stats import chi2

    if hours <= 0.0:
        return None
    low = float(chi2.ppf(0.025, 2 * count)) / 2.0 if count else 0.0
    return [low / hours, float(chi2.ppf(0.975, 2 * count + 2)) / 2.0 / hours]
