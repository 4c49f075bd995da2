"""Loads of standing feet: what is known of them with the footing measured under load or known by
its deviation alone, and what a quiet stand owes to the engine.

Three of the four loads' combinations are fixed by equilibrium; the fourth, an internal force that
loads one diagonal and unloads the other, by heights and compliances. A tenth of a millimetre
decides hundreds of newtons, so an encoder cannot tell it: then a load is an interval. Where the
feet's heights under load are known exactly (a survey, a simulator), it is a number.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from testbed.benchmarks.harness import Answers, Benchmark
from testbed.formats.arrays import Array
from testbed.formats.intervals import Z90
from testbed.machine.names import AXES, LEGS, VERTICAL
from testbed.report.page import Table
from testbed.robot.contact.geometry import FootLoads
from testbed.robot.loads.foot_loads import ExpectedLoads, Footing, internal_force_of
from testbed.scenario.scenario import load_scenario

LEAST_SLOPE = 1e-9
"""Loss of load by push below which a foot never leaves, N/N."""

FRICTION_HOLD_N = 150.0
"""Standard deviation of what the cylinders' friction holds of the internal force (E; seen in thirty
simulated stands).
"""


def heights_under_load(
    expected: ExpectedLoads, positions: ArrayLike, normals: ArrayLike | None = None
) -> Array:
    """(4,) heights, m, at which flat ground meets feet whose joint positions (12) were measured
    under load.

    normals (4, 3): the ground's, in the body frame; default body z. Add the true heights of ground
    that is not flat.
    """
    up = (
        np.tile([0.0, 0.0, 1.0], (len(LEGS), 1))
        if normals is None
        else np.asarray(normals, dtype=float)
    )
    heights = -np.einsum("ij,ij->i", expected.model.foot_positions_m(positions), up)
    return np.asarray(heights - heights.mean())


def loads_of_measured_posture(
    expected: ExpectedLoads,
    positions: ArrayLike,
    gravity_in_body: ArrayLike,
    footing: Footing,
    **acts: Any,
) -> FootLoads:
    """Loads of a posture measured under load, heights of the footing given (heights_under_load).

    The joints' give is in their positions already, so only the ground gives. A further load changes
    the joints too: sensitivities and reserves are those of joints, oil and ground together, at
    these loads.
    """
    held = np.zeros(len(AXES))
    now = expected.solve(positions, gravity_in_body, footing=footing, joint_compliance=held, **acts)
    given = expected.oil.joint_compliance(positions)
    jacobians = expected.model.feet(positions)[1]
    give = np.array([jacobians[index, 2] ** 2 @ given for index in range(len(LEGS))])
    unloaded = replace(footing, heights_m=np.asarray(footing.heights_m) + give * now.normal_n)
    free = expected.solve(positions, gravity_in_body, footing=unloaded, **acts)
    slopes = np.where(free.reserve_n > 0.0, free.normal_n / free.reserve_n, 0.0)
    reserve = np.divide(
        now.normal_n, slopes, out=np.full(len(LEGS), np.inf), where=slopes > LEAST_SLOPE
    )
    return now._replace(
        load_per_height_n_m=free.load_per_height_n_m,
        load_per_wrench=free.load_per_wrench,
        reserve_n=reserve,
    )


def load_interval_n(
    expected: ExpectedLoads,
    positions: ArrayLike,
    gravity_in_body: ArrayLike,
    footing_deviation_m: float,
    **acts: Any,
) -> tuple[Array, Array]:
    """Ends (4,), (4,) of each foot's vertical load, N, between which it lies nine times in ten.

    The feet's height errors are independent and normal with the given deviation; only their part
    along the internal force matters, widened by what the cylinders' friction may hold of it.
    Lifting feet and sliding ones are reckoned with by solving at both ends.
    """
    internal = internal_force_of(expected.model.foot_positions_m(positions)[:, :2])
    given = acts.get("joint_compliance")
    joints = expected.oil.joint_compliance(positions) if given is None else np.asarray(given)
    held_m = FRICTION_HOLD_N * (joints[list(VERTICAL)].mean() + expected.ground_compliance_m_n)
    reach = Z90 * float(np.hypot(footing_deviation_m, held_m)) * internal
    ends = [
        expected.solve(
            positions, gravity_in_body, footing=Footing(heights_m=way * reach), **acts
        ).vertical_load_n
        for way in (-1.0, 1.0)
    ]
    return np.minimum(*ends), np.maximum(*ends)


def fixed_combinations(feet_xy: Array) -> Array:
    """(3, 4) orthonormal combinations of the loads on feet (4, 2) that equilibrium fixes."""
    return np.asarray(np.linalg.svd(np.vstack([np.ones(len(LEGS)), feet_xy.T]))[2][:3])


# What a quiet stand's foot loads owe to the engine and what to the machine.
#
# The robot stands on 45 degrees for a while: valves locked or position loops on, leakage in or out,
# bodies stepped at 1 kHz or at 4 kHz. Loads that differ between the two rates are the engine's;
# loads that move with the loops on are hunting; loads that drift with locked valves and stop
# drifting without leakage are leakage.

LOCKED = ("hydraulics.valves_locked=true",)
NO_LEAKAGE = ("hydraulics.without=[internal_leakage, outer_leakage, edge_leakage, hose]",)
CASES: dict[str, tuple[str, ...]] = {
    "valves locked": LOCKED,
    "valves locked, no leakage": LOCKED + NO_LEAKAGE,
    "position loops on": (),
    "position loops on, no leakage": NO_LEAKAGE,
}


def foot_loads(overrides: tuple[str, ...], physics_hz: int, duration_s: float) -> Array:
    """Loads along the vertical joints, N, (rows at 100 Hz, 4), sensors without noise."""
    from testbed.world.simulation import Simulation

    substeps = max(1, round(10 * 1000 / physics_hz))
    common = [
        "sensors.noise=false",
        f"rates.physics_hz={physics_hz}",
        f"rates.hydraulic_substeps={substeps}",
    ]
    scenario = load_scenario(
        "stand_slope_45", [*common, "rates.record_hz=100", *overrides], duration=duration_s
    )
    world = Simulation(scenario)
    try:
        _, truth = world.run_block(round(duration_s * 100))
    finally:
        world.close()
    columns = [world.truth_columns.index(f"foot_load_{leg}") for leg in LEGS]
    return np.asarray(truth[:, columns])


@dataclass(frozen=True)
class QuietStand(Benchmark[str]):
    """Every case for `duration_s`."""

    name = "quiet_stand"
    noun = "stands"
    duration_s: float = 60.0
    chosen: tuple[str, ...] = tuple(CASES)

    def cases(self) -> Mapping[str, str]:
        """The cases by what is on and off in them."""
        return {f"{name}, {self.duration_s:g} s": name for name in self.chosen}

    def work(self, case: str) -> dict[str, Any]:
        """How far loads wander (standard deviation, worst foot), drift (last second less first)
        and, between 1 kHz and 4 kHz, differ at any time (worst foot, N).
        """
        slow, fast = (foot_loads(CASES[case], hz, self.duration_s) for hz in (1000, 4000))
        between_means = np.abs(slow.mean(axis=0) - fast.mean(axis=0))
        return {
            "wander_n": float(slow.std(axis=0).max()),
            "drift_n": float(np.abs(slow[-100:].mean(axis=0) - slow[:100].mean(axis=0)).max()),
            "rate_difference_n": float(np.abs(slow - fast).max()),
            "rate_difference_of_means_n": float(between_means.max()),
            "mean_n": slow.mean(axis=0).tolist(),
        }

    def made_from(self, case: str) -> str:
        """The case and its length."""
        return f"{case} {self.duration_s!r}"

    def summarise(self, answers: Answers) -> dict[str, dict[str, Any]]:
        """Marks by case."""
        return dict(zip(self.chosen, answers.values(), strict=True))

    def tables(self, result: dict[str, dict[str, Any]]) -> Sequence[Table]:
        """One table."""
        marks = ("wander_n", "drift_n", "rate_difference_n", "rate_difference_of_means_n")
        rows = [[case, *(f"{found[mark]:.1f}" for mark in marks)] for case, found in result.items()]
        heads = ["case", "wander [N]", "drift [N]", "1 kHz less 4 kHz [N]", "of the means [N]"]
        return [Table("Quiet stand, the worst foot", heads, rows)]
