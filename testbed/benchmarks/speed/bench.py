"""Speed of the whole loop against the bare engine, measured in one process, alternating.

Bare: the same URDF standing on all four feet on the same kind of ground (level, for without ropes
it would slide), held by the engine's own position motors and limits, 50 solver iterations,
`stepSimulation` alone. Times are processor times of the thread, so that other work on the machine
does not count. Full: the scenario `drill_slope_45` while it drills, everything on and recorded.
"""

from __future__ import annotations

import json
import statistics
import subprocess
import sys
import time
from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from testbed.report.page import Table
from testbed.scenario.scenario import Scenario, load_scenario

if TYPE_CHECKING:
    from testbed.world.simulation import Simulation

ROUNDS = 15
STEPS = 300
SETTLE = 8000
"""Steps before the bare engine is timed: just after landing its solver finds less to do (85 instead
of 125 us).
"""
ROUGH = ("terrain.kind=heightfield", "terrain.roughness_m=0.03")


def bench(rounds: int = ROUNDS, steps: int = STEPS) -> dict[str, Any]:
    """All figures; times in microseconds per 1 ms step (medians over rounds), ratios are medians of
    paired ratios.
    """
    from testbed.benchmarks.speed.bench import against_bare, fresh_process, resets

    flat = _drilling(())
    rough = _drilling(ROUGH)
    bare = bare_engine(())
    timed = alternate(
        {"bare": bare.step, "full": _blocks(flat), "rough": _blocks(rough)}, rounds, steps
    )
    parts = _parts(flat, steps)
    out: dict[str, Any] = {
        "bare_step_us": statistics.median(timed["bare"]),
        "full_step_us": statistics.median(timed["full"]),
        "ratio": _ratio(timed["full"], timed["bare"]),
        "full_step_rough_us": statistics.median(timed["rough"]),
        "ratio_rough": _ratio(timed["rough"], timed["bare"]),
        **parts,
    }
    out["kernel_ratio"] = out["hydraulics_us"] / out["bare_step_us"]
    for world in (flat, rough):
        world.close()
    bare.close()
    from testbed.benchmarks.hydraulics.kernel_speed import kernel_vs_lsoda

    out["kernel_vs_lsoda"] = kernel_vs_lsoda()
    env = against_bare(rounds=3, steps=30)
    out["env_steps_per_s"], out["env_ratio"] = env["env_steps_per_s"], env["ratio"]
    out |= {f"env_reset_{key}": value for key, value in resets().items()}
    return out | fresh_process()


def table(found: dict[str, Any]) -> Table:
    """The figures for a person."""
    return Table(
        "Speed", ["figure", "value"], [[name, f"{value:.4g}"] for name, value in found.items()]
    )


def alternate(
    jobs: dict[str, Callable[[], Any]], rounds: int, steps: int
) -> dict[str, list[float]]:
    """Microseconds per call of each job, one figure a round, the jobs taking turns within a
    round.
    """
    times: dict[str, list[float]] = {name: [] for name in jobs}
    for _ in range(rounds):
        for name, job in jobs.items():
            start = time.thread_time()
            for _ in range(steps if name == "bare" else 1):
                job()
            times[name].append((time.thread_time() - start) / steps * 1e6)
    return times


def _ratio(over: list[float], under: list[float]) -> float:
    return statistics.median(whole / bare for whole, bare in zip(over, under, strict=True))


def _drilling(overrides: tuple[str, ...]) -> Any:
    from testbed.world.simulation import Simulation

    scenario: Scenario = load_scenario(
        "drill_slope_45", ["task.start_s=0.2", *overrides], duration=3600.0
    )
    world = Simulation(scenario)
    world.run_block(1500)
    return world


def _blocks(world: Simulation) -> Callable[[], Any]:
    return lambda: world.run_block(STEPS)


def bare_engine(overrides: tuple[str, ...]) -> Any:
    """An engine with the robot standing on level ground on the engine's own motors."""
    from testbed import resources
    from testbed.world.engine import Engine
    from testbed.world.ground.terrain import make_ground
    from testbed.world.start import nominal_joints

    scenario = load_scenario("stand_flat", list(overrides))
    engine = Engine(resources.urdf(), make_ground(scenario.terrain), step_s=1e-3)
    joints = nominal_joints(scenario)
    engine.reset(np.array([0.0, 0.0, 0.16 + float(joints[2])]), np.eye(3), joints)
    engine.hold_with_motors(joints)
    force, normal = np.zeros((4, 3)), np.zeros(4)
    for _ in range(SETTLE):
        engine.step()
    if engine.feet.forces(force, normal) > 0.0 or (normal <= 0.0).any():
        raise RuntimeError("the bare robot does not stand on its four feet")
    return engine


def _hydraulics() -> Any:
    """The hydraulics of a Board alone, compiled."""
    from testbed.compiled import njit
    from testbed.laws.hydraulics import hydraulic_step

    @njit
    def step(boards: Any, dt: float, substeps: int) -> None:
        board = boards[0]
        hydraulic_step(
            board.axes, board.parameters, board.inputs, board.supply, board.unit, dt, substeps
        )

    return step


def _parts(world: Simulation, steps: int) -> dict[str, float]:
    """Where the time of a full step goes, microseconds: each part called alone on the running
    world. Noise is drawn for many samples at once: each has its share.
    """
    from testbed.world import compiled_step, sensing
    from testbed.world.simulation import SAMPLES

    machine, nowhere = world.machine, world._nowhere
    boards, substeps = machine.boards.copy(), world.scenario.rates.hydraulic_substeps
    noise = machine.noise_rng, machine.added_noise_rng
    force, normal = np.zeros((4, 3)), np.zeros(4)
    hydraulics = _hydraulics()

    board, estimator, noises, row = world._fixed

    def compiled(due: int) -> None:
        compiled_step.between_steps(due, board, estimator, noises, row, nowhere)

    def engine() -> None:
        machine.engine.apply(machine.boards["given"])
        machine.engine.step()

    jobs: dict[str, Callable[[], Any]] = {
        "hydraulics_us": lambda: hydraulics(boards, 1e-3, substeps),
        "sensors_us": lambda: compiled(compiled_step.SENSE),
        "noise_us": lambda: sensing.draw_noise(SAMPLES, *noise),
        "estimators_us": lambda: compiled(compiled_step.ESTIMATE),
        "read_us": lambda: machine.engine.read(machine.boards["engine"]),
        "contacts_us": lambda: machine.engine.feet.forces(force, normal),
        "expected_us": world._expect,
        "engine_us": engine,
    }
    out = {}
    for name, job in jobs.items():
        job()
        start = time.thread_time()
        for _ in range(steps):
            job()
        out[name] = (time.thread_time() - start) / steps * 1e6
    out["expected_us"] /= world._schedule.expected
    out["sensors_us"] += out.pop("noise_us") / SAMPLES
    return out


# Speed figures that need a process of their own.

_FRESH = """
import json, sys, time
start = float(sys.argv[1])
from testbed.scenario.scenario import load_scenario
from testbed.world.simulation import Simulation
world = Simulation(load_scenario("drill_slope_45", duration=10.0))
world.run_block(1)
first = time.time() - start
for _ in range(2):
    world.run_block(1000)
from testbed.benchmarks.speed.bench import peak_memory_mb
print(json.dumps([first, peak_memory_mb()]))
"""


def peak_memory_mb() -> float:
    """Most memory that this process has held, MB.

    Not ru_maxrss where it can be helped: Linux hands a parent's peak on to the process that it
    starts.
    """
    try:
        status = Path("/proc/self/status").read_text()
        return float(status.partition("VmHWM:")[2].split()[0]) / 1024.0
    except (OSError, IndexError):
        import resource

        peak = float(resource.getrusage(resource.RUSAGE_SELF).ru_maxrss)
        return peak / (2.0**20 if sys.platform == "darwin" else 1024.0)


def fresh_process() -> dict[str, float]:
    """Seconds from the start of a process to its first step (kernels cached) and its peak memory
    after 2 s, MB.
    """
    out = subprocess.run(
        [sys.executable, "-c", _FRESH, repr(time.time())],
        capture_output=True,
        text=True,
        check=True,
    ).stdout
    first, memory = json.loads(out.strip().splitlines()[-1])
    return {"first_step_s": first, "memory_mb": memory}


# How fast the environments step, against the bare engine, and how fast they begin anew.

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
