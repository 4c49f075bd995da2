"""Keeps what a library prints from C off the console."""

from __future__ import annotations

import contextlib
import ctypes
import os
import sys
from collections.abc import Iterator

_MASTER = os.environ.get("TESTBED_ENGINE_MESSAGES")


@contextlib.contextmanager
def quiet() -> Iterator[None]:
    """Keep the engine's messages off the console while it loads a file (it prints from C)."""
    if _MASTER:
        yield
        return
    flush = ctypes.CDLL(None).fflush
    sys.stdout.flush()
    sys.stderr.flush()
    flush(None)
    saved, null = [os.dup(1), os.dup(2)], os.open(os.devnull, os.O_WRONLY)
    try:
        for stream in (1, 2):
            os.dup2(null, stream)
        yield
    finally:
        flush(None)
        for stream, old in zip((1, 2), saved, strict=True):
            os.dup2(old, stream)
            os.close(old)
        os.close(null)
