"""The reference leg against closed forms: trapped oil, leakage, a valve's speed, friction at
constant speed.
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest

from testbed.benchmarks.reference_leg.leg import COLUMNS, parameters, simulate
from testbed.benchmarks.reference_leg.rigs import answers, drawn, named

AREA_M2, STROKE_M, BETA_PA, MASS_KG = 3.0e-3, 0.5, 1.2e9, 200.0
SUPPLY_PA, RATED_M3_S, DROP_PA = 1.0e7, 4.0e-4, 3.5e6
MIDDLE_M = 0.25
PLAIN = {
    "area_a": AREA_M2,
    "area_b": AREA_M2,
    "stroke": STROKE_M,
    "mass": MASS_KG,
    "dead_a": 1.0e-4,
    "dead_b": 1.0e-4,
    "beta": BETA_PA,
    "supply": SUPPLY_PA,
    "rated": RATED_M3_S,
    "drop": DROP_PA,
    "valve_w": 300.0,
    "valve_damping": 1.0,
    "edge_smooth": 1.0e3,
    "speed_p": 0.01,
    "speed_m": 0.01,
    "bend": 1.0,
    "feed": 1.0,
}
"""Both areas alike, no friction, no gravity; the command is the desired speed itself."""


def columns(seconds: float, opening: float = 0.0, start_m: float = MIDDLE_M, **more: float) -> Any:
    """What the leg does with a constant opening: column -> (n,) at 1 kHz."""
    n = round(1000 * seconds)
    rows = simulate(
        parameters(PLAIN | more),
        np.zeros(n),
        np.full(n, opening),
        np.full(n, 20.0),
        1e-3,
        200,
        start_m,
    )
    return {name: rows[:, k] for k, name in enumerate(COLUMNS)}


def test_a_mass_on_trapped_oil_swings_as_the_oils_stiffness_says() -> None:
    """A spring that is suddenly there: x = x0 + d (1 - cos w t), w^2 = (oil + spring) / mass, d = F
    / (oil + spring).
    """
    spring, force = 1.0e5, 2000.0
    found = columns(0.2, spring=spring, spring_rest=MIDDLE_M + force / spring)
    oil = 2.0 * BETA_PA * AREA_M2**2 / (1.0e-4 + AREA_M2 * MIDDLE_M)
    frequency, way = math.sqrt((oil + spring) / MASS_KG), force / (oil + spring)
    t = 1e-3 * np.arange(1, 201)
    expected = MIDDLE_M + way * (1.0 - np.cos(frequency * t))
    assert np.abs(found["position"] - expected).max() < 0.01 * way
    assert frequency * 0.2 / (2.0 * math.pi) > 5, "several swings"


def test_a_load_on_a_leaking_piston_creeps_at_the_leaks_flow_over_the_area() -> None:
    """v = leakage * F / area^2, for the pressures differ by F / area."""
    leak, force = 5.0e-12, 3000.0
    found = columns(3.0, leak=leak, spring=1.0, spring_rest=MIDDLE_M + force)
    speed = leak * force / AREA_M2**2
    assert np.polyfit(np.arange(2000), found["position"][1000:], 1)[0] * 1e3 == pytest.approx(
        speed, rel=1e-3
    )


@pytest.mark.parametrize("opening", [0.2, -0.5])
def test_without_a_load_the_speed_is_the_rated_flow_at_half_the_supply_pressure(
    opening: float,
) -> None:
    start = MIDDLE_M - 0.1 * np.sign(opening)
    found = columns(1.0, opening, start)
    expected = RATED_M3_S * opening * math.sqrt(SUPPLY_PA / 2.0 / DROP_PA) / AREA_M2
    assert found["velocity"][-200:].mean() == pytest.approx(expected, rel=1e-3)
    assert found["pressure_a"][-1] == pytest.approx(SUPPLY_PA / 2.0, rel=2e-3)


@pytest.mark.parametrize(("opening", "way"), [(0.1, "p"), (-0.1, "m")])
def test_at_constant_speed_the_pressures_carry_the_friction_of_its_formula(
    opening: float, way: str
) -> None:
    friction = {
        "sigma_p": 5000.0,
        "coulomb_p": 400.0,
        "stribeck_p": 200.0,
        "sigma_m": 3000.0,
        "coulomb_m": 300.0,
        "stribeck_m": 100.0,
        "speed_p": 0.05,
        "speed_m": 0.03,
        "bend": 2.0,
        "bristle": 1.0e6,
        "bristle_damping": 300.0,
    }
    found = columns(1.5, opening, MIDDLE_M - 0.1 * np.sign(opening), **friction)
    v = found["velocity"][-200:].mean()
    drive = AREA_M2 * (found["pressure_a"] - found["pressure_b"])[-200:].mean()
    level = friction[f"coulomb_{way}"]
    level += friction[f"stribeck_{way}"] * math.exp(-((abs(v) / friction[f"speed_{way}"]) ** 2))
    assert drive == pytest.approx(np.sign(v) * level + friction[f"sigma_{way}"] * v, rel=1e-3)


def test_the_load_cell_reads_the_grounds_stiffness_times_its_depth() -> None:
    found = columns(1.0, 0.2, 0.2, ground=1.0e7, ground_at=0.21)
    touching = found["position"] > 0.21
    assert touching.any() and not touching.all()
    assert found["force"][~touching].max() == 0.0
    assert found["force"][-1] == pytest.approx(1.0e7 * (found["position"][-1] - 0.21), rel=1e-2)


def test_a_number_the_leg_does_not_have_is_refused() -> None:
    with pytest.raises(KeyError, match="sigma"):
        parameters({"sigma": 1.0})


@pytest.mark.parametrize(
    ("how", "expected"),
    [
        ({"times": 3.0}, 1.5),
        ({"times": 3.0, "plus": 1.0}, 2.5),
        ({"over": 3.0}, 6.0),
    ],
)
def test_a_hidden_number_goes_with_the_strength(how: dict[str, float], expected: float) -> None:
    assert drawn(np.random.default_rng(1), 0.5, how) == expected


def test_a_hidden_number_may_be_drawn_whatever_the_strength() -> None:
    rng = np.random.default_rng(1)
    signs = {drawn(rng, 0.5, {"signed": 3.0}) for _ in range(20)}
    forms = {drawn(rng, 0.5, {"of": 3}) for _ in range(50)}
    turns = [drawn(rng, 0.5, {"hz": [4.0, 16.0]}) / (2.0 * np.pi) for _ in range(50)]
    assert signs == {-1.5, 1.5} and forms == {0.0, 1.0, 2.0}
    assert 4.0 <= min(turns) < 6.0 and 14.0 < max(turns) <= 16.0


def test_every_named_answer_is_a_number_that_its_effect_draws() -> None:
    for name, (_, number) in answers().items():
        assert number.removeprefix(f"{name}:") in named()[name]["drawn"]
