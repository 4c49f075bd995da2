"""`make house`: size and form of the code, counted from the sources.

    python docs/measures.py [ROOT]

prints all figures and writes those of the table "Measures" into CONTRIBUTING.md.

Lines of code are those that hold a token which is neither comment nor docstring. Nothing here
freezes a size: what must hold (walls, names of effects, lengths of examples and tutorials) is kept
by tests, which are named beside the figure.
"""

from __future__ import annotations

import ast
import io
import re
import subprocess
import sys
import time
import tokenize
from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from pathlib import Path

MOST_PARAMETERS, MOST_LINES = 8, 400
LAYOUT = (
    tokenize.NL,
    tokenize.NEWLINE,
    tokenize.INDENT,
    tokenize.DEDENT,
    tokenize.ENDMARKER,
)
DEFINITION = (ast.FunctionDef, ast.AsyncFunctionDef)


@dataclass(frozen=True)
class Source:
    """One file, read once."""

    path: Path
    text: str
    tree: ast.Module

    @classmethod
    def read(cls, path: Path) -> Source:
        """A file with its syntax tree."""
        text = path.read_text(encoding="utf-8")
        return cls(path, text, ast.parse(text))

    @property
    def lines(self) -> int:
        """All of them."""
        return self.text.count("\n")

    def documented(self) -> set[int]:
        """Numbers of the lines of docstrings, those of constants and fields included."""
        found: set[int] = set()
        bodies = (getattr(node, "body", None) for node in ast.walk(self.tree))
        for statement in (one for body in bodies if isinstance(body, list) for one in body):
            value = statement.value if isinstance(statement, ast.Expr) else None
            if isinstance(value, ast.Constant) and isinstance(value.value, str):
                found |= set(range(statement.lineno, statement.end_lineno + 1))
        return found

    def coded(self) -> set[int]:
        """Numbers of the lines that hold code."""
        found: set[int] = set()
        for token in tokenize.generate_tokens(io.StringIO(self.text).readline):
            if token.type not in (*LAYOUT, tokenize.COMMENT):
                found |= set(range(token.start[0], token.end[0] + 1))
        return found - self.documented()

    def comments(self) -> int:
        """How many there are."""
        tokens = tokenize.generate_tokens(io.StringIO(self.text).readline)
        return sum(token.type == tokenize.COMMENT for token in tokens)

    def functions(self) -> Iterator[ast.FunctionDef | ast.AsyncFunctionDef]:
        """All of them, methods too."""
        return (node for node in ast.walk(self.tree) if isinstance(node, DEFINITION))

    def names(self) -> Iterator[str]:
        """Parameters and whatever else is given a name."""
        for node in ast.walk(self.tree):
            if isinstance(node, DEFINITION):
                yield from parameters(node)
            elif isinstance(node, ast.Name) and isinstance(node.ctx, ast.Store):
                yield node.id


def parameters(function: ast.FunctionDef | ast.AsyncFunctionDef) -> list[str]:
    """A function's parameters with `*args` and `**kwargs`, without `self` or `cls`."""
    given = function.args
    plain = (*given.posonlyargs, *given.args, *given.kwonlyargs)
    names = [one.arg for one in (*plain, given.vararg, given.kwarg) if one is not None]
    return names[1:] if names[:1] in (["self"], ["cls"]) else names


def read(folder: Path) -> list[Source]:
    """All sources below a folder."""
    return [Source.read(path) for path in sorted(folder.rglob("*.py"))]


def code(sources: Iterable[Source]) -> int:
    """Lines of code."""
    return sum(len(source.coded()) for source in sources)


def share(part: float, whole: float) -> str:
    """In per cent."""
    return f"{100.0 * part / whole:.1f} %"


def seconds(root: Path, *arguments: str) -> float:
    """Wall time of a Python process, the second of two: the first may compile its files."""
    for _ in range(2):
        begun = time.perf_counter()
        subprocess.run([sys.executable, *arguments], cwd=root, check=True, capture_output=True)
    return time.perf_counter() - begun


def files_of_a_millisecond(root: Path) -> int:
    """Files named in the table of CONTRIBUTING.md that follows one step."""
    text = (root / "CONTRIBUTING.md").read_text(encoding="utf-8")
    table = text.partition("## One step")[2].partition("\n## ")[0]
    rows = [line for line in table.splitlines() if line.startswith("| `")]
    named = [name for row in rows for name in re.findall(r"`(\S+\.py)`", row.split("|")[1])]
    missing = [name for name in named if not (root / "testbed" / name).is_file()]
    assert not missing, missing
    return len(named)


MANY = f"functions of more than {MOST_PARAMETERS} parameters"


def sized(root: Path) -> Iterator[tuple[str, str, str]]:
    """What is counted, how much of it there is, and which test keeps it where one does."""
    sources, tests = read(root / "testbed"), read(root / "tests")
    benchmarks = [s for s in sources if "benchmarks" in s.path.relative_to(root).parts]
    whole, measuring = code(sources), code(benchmarks)
    names = [name for source in sources for name in source.names()]
    functions = [function for source in sources for function in source.functions()]
    long = [f"{s.path.relative_to(root)} {s.lines}" for s in sources if s.lines > MOST_LINES]
    many = [f.name for f in functions if len(parameters(f)) > MOST_PARAMETERS]
    yield "code, all of testbed/", f"{whole}", ""
    yield "of it product; benchmarks", f"{whole - measuring}; {measuring}", ""
    yield "tests by code", f"{code(tests) / whole:.3f}", ""
    yield "docstrings by code", share(sum(len(s.documented()) for s in sources), whole), "ruff D"
    yield (
        "comments by lines",
        share(sum(s.comments() for s in sources), sum(s.lines for s in sources)),
        "",
    )
    yield MANY, f"{len(many)} {many}", "PLR0913"
    yield "one-letter names", share(sum(len(n) == 1 and n != "_" for n in names), len(names)), ""
    yield f"files of more than {MOST_LINES} lines", f"{len(long)} {long}", ""
    yield "files to open for one millisecond", f"{files_of_a_millisecond(root)}", ""


def figures(root: Path) -> Iterator[tuple[str, str, str]]:
    """The same, with lengths of examples, private modules of numba, and how long a start takes."""
    yield from sized(root)
    sources = read(root / "testbed")
    for folder, kind in (("examples", "*.py"), ("docs/tutorials", "*.md")):
        lengths = [p.read_text(encoding="utf-8").count("\n") for p in (root / folder).glob(kind)]
        yield (
            f"{folder}: how many, the longest",
            f"{len(lengths)}, {max(lengths)} lines",
            ("tests/test_examples.py, test_tutorial.py"),
        )
    private = [s.path.name for s in sources if re.search(r"numba\.(core|np|typed)\b", s.text)]
    yield "files that name numba's private modules", f"{len(private)}", ""
    yield "import testbed", f"{seconds(root, '-c', 'import testbed'):.2f} s", "test_live_run.py"
    yield "testbed --help", f"{seconds(root, '-m', 'testbed', '--help'):.2f} s", "tests/cli"


def tabled(root: Path) -> dict[str, str]:
    """First cell of a row of CONTRIBUTING's table -> its last cell, as counted."""
    counted = {what: found for what, found, _ in sized(root)}
    whole = int(counted["code, all of testbed/"])
    parts = [int(part) for part in counted["of it product; benchmarks"].split("; ")]
    return {
        "code, all of `testbed/`": f"{whole:,}".replace(",", " "),
        "of it product; benchmarks": "; ".join(f"{part:,}".replace(",", " ") for part in parts),
        "functions with more than eight parameters": counted[MANY].split()[0],
        "one-letter names": counted["one-letter names"],
        "docstrings by code": counted["docstrings by code"],
        "test code per source code": counted["tests by code"],
        "files to open to follow one millisecond": counted["files to open for one millisecond"],
    }


def filled(text: str, rows: dict[str, str]) -> str:
    """CONTRIBUTING's text with the last cell of these rows written anew. Raises ValueError for a
    row that is not there.
    """
    lines = text.split("\n")
    for first, last in rows.items():
        place = next((k for k, line in enumerate(lines) if line.startswith(f"| {first} |")), None)
        if place is None:
            raise ValueError(f"CONTRIBUTING.md has no row {first!r}")
        lines[place] = "|".join([*lines[place].split("|")[:3], f" {last} ", ""])
    return "\n".join(lines)


def main() -> None:
    """Print all figures, and write the table of CONTRIBUTING.md."""
    root = Path(sys.argv[1] if len(sys.argv) > 1 else ".").resolve()
    page = root / "CONTRIBUTING.md"
    page.write_text(filled(page.read_text(encoding="utf-8"), tabled(root)), encoding="utf-8")
    for what, found, kept in figures(root):
        print(f"{what:45s} {found}" + (f"   [{kept}]" if kept else ""))


if __name__ == "__main__":
    main()
