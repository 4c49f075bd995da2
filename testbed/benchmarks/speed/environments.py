"""How fast the environments step, against the bare engine, and how fast they begin anew."""

from __future__ import annotations

import statistics
import time

import numpy as np

from testbed.benchmarks.speed.bench import bare_engine

DRILL = "Roboclimber/Drill-v0"
KEEP = "Roboclimber/Keep-v0"
STEP_MS = 20


def against_bare(rounds: int = 9, steps: int = 50, name: str = DRILL) -> dict[str, float]:
    """Environment steps a second over what the bare engine would reach, both on processor time,
    taking turns.

    `ratio` is the median over rounds of (bare engine's time for the same simulated time) /
    (environment's time).
    """
    from testbed import envs

    env = envs.make(name, duration_s=3600.0)
    env.reset(seed=0)
    still = np.zeros(env.action_space.shape or (), dtype=np.float32)
    bare = bare_engine(())
    for _ in range(steps):
        env.step(still)
    full, lone = [], []
    for _ in range(rounds):
        start = time.thread_time()
        for _ in range(steps * STEP_MS):
            bare.step()
        lone.append(time.thread_time() - start)
        start = time.thread_time()
        for _ in range(steps):
            env.step(still)
        full.append(time.thread_time() - start)
    env.close()
    bare.close()
    return {
        "env_steps_per_s": steps / statistics.median(full),
        "bare_steps_per_s": steps / statistics.median(lone),
        "ratio": statistics.median(b / whole for b, whole in zip(lone, full, strict=True)),
    }


def resets(draws: int = 9, again: int = 15, name: str = KEEP) -> dict[str, float]:
    """Processor time of a reset, s, medians: `draw_s` with a new drawn machine, `same_machine_s`
    back at the beginning with other noise.
    """
    from testbed import envs

    env = envs.make(name)
    env.reset(seed=0)
    found: dict[str, list[float]] = {"draw_s": [], "same_machine_s": []}
    for times, count, options in (
        (found["draw_s"], draws, {}),
        (found["same_machine_s"], again, {"same_machine": True}),
    ):
        for _ in range(count):
            start = time.thread_time()
            env.reset(options=options)
            times.append(time.thread_time() - start)
            env.step(np.zeros(env.action_space.shape or (), dtype=np.float32))
    env.close()
    return {key: statistics.median(times) for key, times in found.items()}
