"""On a cold cache: the kernels between two engine steps, compiled by two processes beside each other.

The first process needs the contact solver to build its world; meanwhile the second compiles the plant into the shared
cache. The first goes on with what is left, and finds the plant there.
"""

from __future__ import annotations

import os
import subprocess
import sys
from contextlib import suppress
from typing import Any

import numpy as np

from testbed import compiled
from testbed.control.valve_loop import control_step
from testbed.estimation.chain_kernel import step_chain
from testbed.parameters.names import GRAVITY_M_S2
from testbed.world import plant, sensing
from testbed.world.between import between_steps
from testbed.world.board import Board

Call = tuple[Any, tuple[Any, ...]]


def plant_calls() -> list[Call]:
    """The costly kernels that between_steps calls, each with arguments of its types: the second process's share."""
    b, dt = Board(), 1e-3
    return [
        (plant.plant_step, (
            b.q, b.qd, b.base, b.command, b.foot_force, b.axes, b.params, b.supply, b.unit, b.geometry, b.ropes, b.body,
            b.drill_loads, b.scratch, b.rotation, b.joint_torque, b.force, b.torque, b.drill_wrench,
            dt, 1, GRAVITY_M_S2,
        )),
        (plant.feet_under_motion, (
            b.legs, b.q, b.qd, b.qd, b.joint_torque, b.rotation, b.force, b.force, b.force, b.ground_normals,
            b.foot_force, b.normal_force, dt,
        )),
    ]  # fmt: skip


def other_calls(chain: tuple[Any, ...]) -> list[Call]:
    """The other kernels that between_steps calls; `chain`: EstimatorChain.arrays."""
    b, dt, row = Board(), 1e-3, np.zeros(128)
    return [
        (step_chain, (row, row, row, row, row, *chain)),
        (sensing.sense, (
            row, dt, b.q, b.base, b.rotation, b.axes, b.supply, b.ropes, b.command, b.transducers, b.sensors, row,
            b.late, 0, GRAVITY_M_S2, b.gravity_in_body,
        )),
        (plant.write_truth, (
            row, dt, b.base, b.force, b.rotation, b.foot_force, b.normal_force, b.ropes, b.drill_wrench, b.axes,
            b.supply, b.drill_loads,
        )),
        (plant.move_base, (b.pose, b.base_turn, b.base, dt, False)),
        (plant.rotation_matrix, (b.base_turn, b.rotation)),
        (control_step, (b.q, b.reference, b.reference_rate, b.integral, b.gains, False, dt, b.command)),
    ]  # fmt: skip


def beside() -> subprocess.Popen[bytes] | None:
    """Start the second process, to be waited for before the first step; None if the cache is warm or there is one core.

    If it fails, the first process compiles everything itself.
    """
    if compiled.is_cached(between_steps) or len(os.sched_getaffinity(0)) < 2:
        return None
    quiet = subprocess.DEVNULL
    return subprocess.Popen([sys.executable, "-m", __name__], stdin=quiet, stdout=quiet, stderr=quiet)


def finish(process: subprocess.Popen[bytes] | None, chain: tuple[Any, ...]) -> None:
    """Compile the first process's share (`chain`: EstimatorChain.arrays), then wait for the second one."""
    if process is not None:
        _compile(other_calls(chain))
        process.wait()


def _compile(calls: list[Call]) -> None:
    """Compile for the arguments' types; what does not compile here is left to the step that needs it."""
    for kernel, arguments in calls:
        with suppress(Exception):
            compiled.compile_for(kernel, *arguments)


if __name__ == "__main__":
    _compile(plant_calls())
