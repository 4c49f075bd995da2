"""The command line in a process of its own: to its end, or going on meanwhile."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path
from typing import Any


def completed(*arguments: str | Path, **options: Any) -> subprocess.CompletedProcess[str]:
    """`testbed` with these arguments, to its end, with what it printed; `options`: as run's."""
    return subprocess.run(_words(arguments), capture_output=True, text=True, **options)


def started(*arguments: str | Path, **options: Any) -> subprocess.Popen[str]:
    """`testbed` with these arguments, going on, its output in pipes; `options`: as Popen's."""
    pipe = subprocess.PIPE
    return subprocess.Popen(_words(arguments), stdout=pipe, stderr=pipe, text=True, **options)


def _words(arguments: tuple[str | Path, ...]) -> list[str]:
    return [sys.executable, "-m", "testbed", *map(str, arguments)]
