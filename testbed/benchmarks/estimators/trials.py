"""The runs on which estimators are compared: standing, swaying, raising, walking, drilling; warm
and cold; slopes.

In every run the true friction of the three kinds of cylinder, and what it depends on, is off from
the believed numbers by a drawn error (5 % in one standard deviation), as an identification would
leave it, and so is the load on the platform (15 kg); thermal zeros are drawn by seed.
`choose` runs may be used to choose constants on, `judge` runs are for results alone: other seeds,
slopes (save for one crawl's) and, but for the calibration's, temperatures.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from testbed.formats.arrays import Array
from testbed.machine.build import build_machine
from testbed.machine.names import AXES, LEGS, SIDES
from testbed.recording.rows import DrillKnown
from testbed.robot.rope_bearings import SurveyedRopes
from testbed.scenario.scenario import Scenario, load_scenario

BASE_C = 40.0
"""The temperature at which the pressure sensors were calibrated, degC."""
FRICTION_ERROR = 0.05
"""One standard deviation of what the believed friction numbers are off by: what an identification
leaves.
"""
DEPENDENCE_ERROR = 0.2
"""One standard deviation of what friction depends on, share: place, pressure, side load, warmth,
rest.
"""
MASS_ERROR_KG = 15.0
"""One standard deviation of the load on the platform."""


@dataclass(frozen=True)
class Trial:
    """One run: shipped scenario, changes, oil temperature degC, seed."""

    name: str
    kind: str
    scenario: str
    changes: tuple[str, ...]
    oil_degc: float
    seed: int
    draw: str | None = None
    """Tolerances from which the world's machine is drawn."""

    def load(self) -> Scenario:
        """The scenario with the drawn errors of its friction."""
        draws = np.random.default_rng([self.seed, 77])
        machine = build_machine()
        changes = [f"hydraulics.oil_temperature_degc={self.oil_degc}"]
        for part in ("vertical_cylinder", "radial_cylinder", "rotation_cylinder"):
            for name in (
                "coulomb_out_n",
                "static_out_n",
                "viscous_out_n_s_m",
                "coulomb_in_n",
                "static_in_n",
                "viscous_in_n_s_m",
            ):
                value = machine.quantity(f"{part}.{name}").value * (
                    1.0 + FRICTION_ERROR * draws.standard_normal()
                )
                changes.append(f"hydraulics.parameters.{part}.{name}={value:.9g}")
        for name in (
            "position_slope",
            "pressure_coefficient_m2",
            "side_load_coefficient",
            "viscosity_rate_1_k",
            "dwell_gain",
        ):
            value = getattr(machine.seal, name) * (1.0 + DEPENDENCE_ERROR * draws.standard_normal())
            changes.append(f"hydraulics.parameters.seal.{name}={value:.9g}")
        if self.draw is not None:
            changes += [f"machine.draw={self.draw}", f"machine.seed={self.seed}"]
        mass = MASS_ERROR_KG * draws.standard_normal()
        changes.append(f"events=[{{kind: payload, at_s: 0.0, mass_kg: {mass:.4g}}}]")
        return load_scenario(self.scenario, [*changes, *self.changes], seed=self.seed)


SWAY = "task={kind: sway}"
STEP = "task={kind: raise, start_s: 2, to_m: 0.28, step_m: 0.01, every_s: 20, speed_m_s: 0.02}"
RAISE = "task={kind: raise, start_s: 2, to_m: 0.35, step_m: 0.03, every_s: 4, speed_m_s: 0.02}"


def _trials(seed: int, slopes: tuple[int, ...], warm: tuple[float, ...]) -> tuple[Trial, ...]:
    out = []
    for index, degc in enumerate(warm):
        a, b, c = (slopes[(index + ahead) % len(slopes)] for ahead in range(3))
        number = seed + 10 * index
        stand, drill, crawl = "stand_slope_45", "drill_slope_45", "crawl_slope_30"
        out += [
            Trial(
                f"stand-{degc:.0f}",
                "stand",
                stand,
                (
                    f"terrain.slope_deg={a}",
                    "duration_s=20",
                    RAISE.replace("to_m: 0.35, step_m: 0.03", "to_m: 0.26, step_m: 0.01"),
                ),
                degc,
                number,
            ),
            Trial(
                f"sway-{degc:.0f}",
                "move",
                stand,
                (f"terrain.slope_deg={b}", "duration_s=24", SWAY),
                degc,
                number + 1,
            ),
            Trial(
                f"raise-{degc:.0f}",
                "move",
                stand,
                (f"terrain.slope_deg={c}", "duration_s=18", RAISE),
                degc,
                number + 2,
            ),
            Trial(
                f"crawl-{degc:.0f}",
                "walk",
                crawl,
                (f"terrain.slope_deg={min(a, 45)}",),
                degc,
                number + 3,
            ),
            Trial(
                f"drill-{degc:.0f}",
                "drill",
                drill,
                (f"terrain.slope_deg={b}", "duration_s=30"),
                degc,
                number + 4,
            ),
        ]
    return tuple(out)


CHOOSE = _trials(1000, (30, 45, 60), (40.0, 15.0))
JUDGE = _trials(5000, (40, 55, 35), (40.0, 10.0, 25.0, 50.0))
DITHER = ("control.dither_m=0.0003", "control.dither_hz=2.0")
DITHERED = tuple(
    out
    for index, degc in enumerate((40.0, 10.0))
    for out in (
        Trial(
            f"still-{degc:.0f}",
            "still",
            "stand_slope_45",
            ("duration_s=20", STEP),
            degc,
            3000 + index,
        ),
        Trial(
            f"dither-{degc:.0f}",
            "dither",
            "stand_slope_45",
            ("duration_s=20", STEP, *DITHER),
            degc,
            3000 + index,
        ),
    )
)
"""Twins: the same stand after a raise, without and with a dither of the valves."""
LIAR = "undeclared=[{effect: sensor.gain_a, at: fr_vertical, parameters: {gain_error: -0.15}}]"
LIARS = tuple(
    Trial(
        f"liar-{degc:.0f}",
        "liar",
        "stand_slope_45",
        ("duration_s=30", SWAY, LIAR),
        degc,
        3100 + index,
    )
    for index, degc in enumerate((40.0, 15.0))
)
"""One pressure sensor reads 15 % low, and the model does not know."""

MEASURED: tuple[str, ...] = (
    "t",
    *(
        f"{stem}_{axis}"
        for stem in ("position", "pressure_a", "pressure_b", "valve")
        for axis in AXES
    ),
    "oil_temperature",
    *(f"rope_tension_{side}" for side in SIDES),
    *(f"attitude_{angle}" for angle in ("roll", "pitch", "yaw")),
    *(f"angular_rate_{axis}" for axis in "xyz"),
    *(f"specific_force_{axis}" for axis in "xyz"),
    *(f"carrying_{leg}" for leg in LEGS),
    *(f"expected_{leg}" for leg in LEGS),
    *DrillKnown.fields,
)
TRUE: tuple[str, ...] = (
    *(f"foot_force_in_world_{leg}_{axis}" for leg in LEGS for axis in "xyz"),
    *(f"foot_load_{leg}" for leg in LEGS),
    *(f"body_pose_in_world_q{axis}" for axis in "xyzw"),
    *(f"chamber_{chamber}_{axis}" for chamber in "ab" for axis in AXES),
    *(f"friction_{axis}" for axis in AXES),
)


@dataclass(frozen=True)
class Series:
    """What a run leaves for the comparison: measured and true columns (n,), and the ropes as
    surveyed, world frame.
    """

    data: dict[str, Array]
    truth: dict[str, Array]
    ropes: SurveyedRopes


def simulate(
    scenario: Scenario,
    tell: Callable[[float], None] | None = None,
    measured: Sequence[str] = MEASURED,
    true: Sequence[str] = TRUE,
) -> Series:
    """Run a scenario and keep what the comparison needs."""
    from testbed.world.simulation import Simulation

    world = Simulation(scenario)
    try:
        at = (
            [world.data_columns.index(column) for column in measured],
            [world.truth_columns.index(column) for column in true],
        )
        blocks: list[tuple[Array, Array]] = []
        while not world.finished:
            data, truth = world.run_block(1000)
            blocks.append((data[:, at[0]], truth[:, at[1]]))
            if tell is not None:
                tell(float(data[-1, 0]))
        data, truth = (np.concatenate([block[part] for block in blocks]) for part in (0, 1))
        ropes = world.machine.expectation.surveyed
    finally:
        world.close()
    return Series(
        {column: np.ascontiguousarray(data[:, index]) for index, column in enumerate(measured)},
        {column: np.ascontiguousarray(truth[:, index]) for index, column in enumerate(true)},
        ropes,
    )
