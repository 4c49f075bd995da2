"""What a benchmark's case was made with, as a digest: an answer made by other sources or options is
not taken over.
"""

from __future__ import annotations

import ast
import hashlib
from collections.abc import Iterable
from functools import cache
from pathlib import Path

from testbed import resources

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
