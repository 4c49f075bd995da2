"""Recordings that anyone can draw: benches, drives and single legs of independent simulators."""

from __future__ import annotations

from collections.abc import Iterator

from testbed.benchmarks.diagnosis.bench_rigs import make_bench
from testbed.benchmarks.recording_mistakes.sample import Sample, of_recording
from testbed.benchmarks.reference_leg.rigs import make_rig

KINDS = ("bench", "leg")


def drawn_cases(rigs: int, first_seed: int) -> Iterator[str]:
    """Names of recordings, two of each rig: one to identify on and one to judge by."""
    for seed in range(first_seed, first_seed + rigs):
        for kind in KINDS:
            for part in ("identify", "verify"):
                yield f"{kind} {seed} {part}"


def drawn_sample(case: str) -> Sample:
    """The recording of a name: a sound machine, another one of its motions for every seed."""
    kind, seed, part = case.split()
    if kind == "bench":
        rig, _ = make_bench(int(seed))
    else:
        rig, _ = make_rig(int(seed), "clean")
    recordings = rig.identify if part == "identify" else rig.verify
    return of_recording(recordings[int(seed) % len(recordings)])
