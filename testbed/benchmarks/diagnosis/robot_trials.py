"""The whole robot's diagnosis on one random run: one leg of four hides an effect, or none does.

Every run sways on its own slope, with its own oil, payload, sensors and friction (which the model knows to a tenth
only).
"""

from __future__ import annotations

import json
from functools import cache
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
import numpy.typing as npt

from testbed.benchmarks.diagnosis.scores import Trial
from testbed.machine.build import build_machine
from testbed.machine.names import LEGS
from testbed.scenario.scenario import Scenario, load_scenario

if TYPE_CHECKING:
    from testbed.diagnosis.robot.diagnose import RobotDiagnosis

Array = npt.NDArray[np.float64]
VISIBLE = 0.05
HIDDEN = Path(__file__).with_name("robot_hidden.yaml")
SIGNED = ("gain_error", "rate")
FRICTION_SPREAD = 0.1


@cache
def hidden_sizes() -> dict[str, dict[str, tuple[float, float]]]:
    """Effect -> parameter -> the sizes between which it is drawn."""
    import yaml

    return yaml.safe_load(HIDDEN.read_text(encoding="utf-8"))  # type: ignore[no-any-return]


def drawn(seed: int) -> tuple[Scenario, str, str]:
    """The scenario of a seed, the hidden effect ("" for none) and the axis where it is."""
    rng = np.random.default_rng([seed, 23])
    sizes = hidden_sizes()
    name = list(sizes)[seed % len(sizes)]
    place = f"{LEGS[int(rng.integers(len(LEGS)))]}_vertical"
    values = {k: float(np.exp(rng.uniform(*np.log(span)))) for k, span in sizes[name].items()}
    values = {
        k: v * (float(rng.choice([-1.0, 1.0])) if k in SIGNED else 1.0) for k, v in values.items()
    }
    hidden = [{"effect": name, "at": place, "parameters": values}] if name else []
    overrides = [
        f"terrain.slope_deg={rng.uniform(30.0, 65.0):.2f}",
        f"robot.payload_kg={max(0.0, rng.uniform(-800.0, 800.0)):.1f}",
        f"hydraulics.oil_temperature_degc={rng.uniform(15.0, 45.0):.1f}",
        f"task.amplitude_m={json.dumps([round(v, 4) for v in rng.uniform(0.04, 0.07, 3)])}",
        f"task.period_s={json.dumps([round(v, 2) for v in rng.uniform(6.0, 12.0, 3)])}",
        *_friction(rng),
        f"undeclared={json.dumps(hidden)}",
    ]
    return load_scenario("stand_clean", overrides, seed), name, place


def _friction(rng: np.random.Generator) -> list[str]:
    """True friction of all vertical cylinders, which the model believes to be the declared one."""
    cylinder = build_machine().vertical_cylinder
    names = [f"{kind}_{way}" for way in ("out", "in") for kind in ("coulomb", "static", "viscous")]
    units = {"coulomb": "n", "static": "n", "viscous": "n_s_m"}
    out = []
    for name in names:
        kind, _, way = name.partition("_")
        key = f"{kind}_{way}_{units[kind]}"
        factor = 1.0 + FRICTION_SPREAD * rng.uniform(-1.0, 1.0)
        value = getattr(cylinder, key) * factor
        out.append(f"hydraulics.parameters.vertical_cylinder.{key}={value:.6g}")
    return out


def simulate(scenario: Scenario) -> dict[str, Array]:
    """What the sensors of a run read: column -> (n,)."""
    from testbed.world.simulation import Simulation

    world = Simulation(scenario)
    try:
        blocks = []
        while not world.finished:
            blocks.append(world.run_block(1000)[0])
        data = np.concatenate(blocks)
        return {name: np.ascontiguousarray(data[:, k]) for k, name in enumerate(world.data_columns)}
    finally:
        world.close()


def trial(seed: int) -> Trial:
    """One run: simulate it, diagnose it, compare with what was hidden."""
    from testbed.diagnosis.robot.diagnose import diagnose_robot
    from testbed.diagnosis.robot.findings import as_json
    from testbed.diagnosis.robot.probabilities import signs_of

    scenario, name, place = drawn(seed)
    found = diagnose_robot(scenario.name, simulate(scenario), build_machine(), Path(f"seed-{seed}"))
    truth = f"{name}@{place}" if name else ""
    said = as_json(found)
    return {
        "seed": seed,
        "kind": "single" if truth else "clean",
        "truth": [truth] if truth else [],
        "numbers": dict(scenario.undeclared[0].parameters) if truth else {},
        "visible": bool(truth) and _visible(found, truth),
        "verdict": said["verdict"],
        "names": [f"{e['name']}@{e['place']}" for e in said["effects"]],
        "effects": said["effects"],
        "hypotheses": said["hypotheses"],
        "error": said["error"]["force_n"],
        "signs": signs_of(found.state).as_json(),
    }


def _visible(found: RobotDiagnosis, truth: str) -> bool:
    """Whether an oracle that knows the name lowers some leg's force or flow residual by 5 % on the part kept back."""
    from testbed.diagnosis.leg.evidence import of_residual
    from testbed.diagnosis.leg.fit import residuals
    from testbed.diagnosis.leg.hypotheses import fit_with
    from testbed.effects import by_name

    known = found.state.tried.get(frozenset([truth]))
    fit = known.fit if known else fit_with(found.problem, found.state.refit.fit, by_name(truth))
    refit, problem = found.state.refit.fit, found.kept_back
    before, after = (
        of_residual(problem, residuals(problem, f.at, problem.channels())).scale
        for f in (refit, fit)
    )
    return any(after[key] < (1.0 - VISIBLE) * before[key] for key in before)
