"""Files of every kind, spoilt by the mutator and then used: scenarios, recordings, models, sweeps
and machines.

Most are used in the shortest way that reads all of them; one in thirty by the command that a user
would give, page and pictures included.
"""

from __future__ import annotations

import copy
import shutil
import tempfile
from collections.abc import Callable
from functools import cache, partial
from pathlib import Path
from typing import Any

import numpy as np

from testbed import resources
from testbed.benchmarks.soak.sandbox import Ended, Judged, command, forked
from testbed.effects.robot_payload import HiddenPayload
from testbed.effects.sensor_drift_a import Drift
from testbed.effects.sensor_zero import ZeroA
from testbed.errors import InputError, SimulationFault
from testbed.formats.yaml_files import read_mapping, yaml_text
from testbed.machine.folder import BODIES, NUMBERS, machine_folder

# What a careless or hostile hand does to a file: a seeded mutator of trees and of bytes.


VALUES: tuple[Any, ...] = (
    *(0, -1, 1, 1e-30, 1e30, 10**400, float("nan"), float("inf"), True, None, ""),
    *("a" * 5000, "a<script>", "../../x", "mine.py:Mine", [], {}, [1, 2, 3], {"a": 1}, [[[[]]]]),
)
"""What stands in for a value."""
FACTORS = (-1.0, 0.0, 1e-3, 0.9, 1.1, 1e3, 1e9)
"""What a number is multiplied by."""
NEAR = (0.5, 0.8, 0.95, 1.05, 1.3, 2.0)
"""What a careless hand multiplies it by; most of it can be used, and shows what follows."""
Tree = dict[str, Any]


def mutated(tree: Tree, rng: np.random.Generator) -> Tree:
    """A copy of the tree with one to three changes: of numbers alone in half the trials; in the
    others another value, another size, a key less or one too many.
    """
    found = copy.deepcopy(tree)
    careless = rng.random() < 0.5
    for _ in range(int(rng.integers(1, 4))):
        holders = _holders(found)
        numbers = [held for held in holders if _is_number(held[0][held[1]])]
        if careless and numbers:
            holder, key = numbers[int(rng.integers(len(numbers)))]
            holder[key] *= NEAR[int(rng.integers(len(NEAR)))]
        else:
            _spoil(*holders[int(rng.integers(len(holders)))], rng)
    return found


def _spoil(holder: Any, key: Any, rng: np.random.Generator) -> None:
    """Change one value of a mapping or list beyond what anybody means."""
    way, value = rng.random(), holder[key]
    if _is_number(value) and way < 0.5:
        holder[key] = value * FACTORS[int(rng.integers(len(FACTORS)))]
    elif way < 0.85:
        holder[key] = copy.deepcopy(VALUES[int(rng.integers(len(VALUES)))])
    elif isinstance(holder, dict) and way < 0.92:
        holder[f"{key}x"] = value
    else:
        del holder[key]


def _is_number(value: Any) -> bool:
    return isinstance(value, int | float) and abs(value) < 1e200


def _holders(tree: Any) -> list[tuple[Any, Any]]:
    """(mapping or list, key) of every value of the tree; of an emptied one, a new key of it."""
    found: list[tuple[Any, Any]] = []
    keys = tree.keys() if isinstance(tree, dict) else range(len(tree))
    for key in list(keys):
        found.append((tree, key))
        if isinstance(tree[key], dict | list):
            found += _holders(tree[key])
    if not found and isinstance(tree, dict):
        tree["x"] = 1
        found.append((tree, "x"))
    return found


def damaged(content: bytes, rng: np.random.Generator) -> bytes:
    """The bytes cut off somewhere, or with some of them changed."""
    if rng.random() < 0.4:
        return content[: int(rng.integers(len(content)))]
    found = bytearray(content)
    for place in rng.integers(len(found), size=int(rng.integers(1, 20))):
        found[place] = int(rng.integers(256))
    return bytes(found)


SHORT_S = "0.05"
STEPS = 40
"""Of a simulation that only shows whether it goes."""
WHOLE = 1.0 / 30.0
"""Share of the trials that are made by the whole command."""
MACHINES = ("climber_8t", "quarter_model")
SWEEP: dict[str, Any] = {
    "format": "roboclimber-sweep/1",
    "scenario": "stand_slope_45",
    "duration_s": 0.1,
    "keep": "summary",
    "seeds": [1, 2],
    "set": {"sensors.noise": False},
    "grid": {"terrain.slope_deg": [40, 50]},
    "list": [{"robot.payload_kg": 100}, {"terrain.friction": 0.6}],
    "latin": {"samples": 2, "seed": 3, "ranges": {"ropes.share": [0.5, 1.0]}},
}
"""Every field that a sweep has."""
ROBOT_MODEL: dict[str, Any] = {
    "format": "roboclimber-model/1",
    "rig": "robot",
    "machine": {"axes.fl_vertical.cylinder.coulomb_out_n": {"value": 700.0, "unit": "N"}},
    "effects": [
        {
            "name": HiddenPayload.kind,
            "place": "body",
            "parameters": {
                "mass": {"value": 90.0, "unit": "kg", "interval90": [80.0, 100.0]},
                **{axis: {"value": 0.1, "unit": "m"} for axis in "xyz"},
            },
        },
        {"name": ZeroA.kind, "place": "fl_vertical", "parameters": {"zero": 4.0e4}},
    ],
}
LEG_MODEL: dict[str, Any] = {
    "format": "roboclimber-model/1",
    "rig": "vertical-leg",
    "known": {
        **{"bore_m": 0.07, "rod_m": 0.056, "stroke_m": 0.5, "moving_mass_kg": 90.0},
        **{"supply_pressure_nominal_pa": 9.0e6, "tank_pressure_pa": 1.0e5},
        **{"dead_volume_a_m3": 3.0e-4, "dead_volume_b_m3": 3.0e-4, "bulk_modulus_pa": 1.2e9},
        **{"valve_rated_flow_m3_s": 5.0e-4, "valve_rated_drop_per_edge_pa": 3.5e6},
        **{"valve_natural_frequency_hz": 30.0, "valve_damping": 0.8, "valve_deadband": 0.02},
        "circuit": {"edge_pa": 1.0, "holding_a": "check", "supply": "varying"},
    },
    "friction": {"coulomb_plus_n": 300.0, "stribeck_plus_n": 100.0, "viscous_plus_n_s_m": 900.0},
    "effects": [{"name": Drift.kind, "parameters": {"rate": {"value": 200.0}}}],
}


def spoilt_scenario(folder: Path, rng: np.random.Generator) -> Judged:
    """A shipped scenario, changed, is run for a moment: what it records is finite."""
    names = [path.stem for path in resources.folder("scenarios").glob("*.yaml")]
    tree = read_mapping(resources.scenario(sorted(names)[int(rng.integers(len(names)))]))
    file = _written(folder / "spoilt.yaml", mutated(tree, rng))
    if rng.random() > WHOLE:
        return forked(partial(_runs, file)).judged
    run = folder / "run"
    outcome, wrong = command("run", str(file), "--duration", SHORT_S, "--out", str(run)).judged
    return outcome, wrong or (not_whole(run) if outcome == "served" else "")


def spoilt_sweep(folder: Path, rng: np.random.Generator) -> Judged:
    """A sweep, changed, is unfolded into its runs, or run."""
    file = _written(folder / "spoilt.yaml", mutated(SWEEP, rng))
    if rng.random() > WHOLE:
        return forked(partial(_unfolds, file)).judged
    shard = ("--shard", "1/16")
    return command("sweep", str(file), "--out", str(folder / "out"), *shard).judged


def spoilt_model(folder: Path, rng: np.random.Generator) -> Judged:
    """A model file of a leg or of the robot, changed, is believed by a run."""
    tree = (ROBOT_MODEL, LEG_MODEL)[int(rng.integers(2))]
    file = _written(folder / "model.yaml", mutated(tree, rng))
    return forked(partial(_runs, "stand_slope_45", file)).judged


def spoilt_machine(folder: Path, rng: np.random.Generator) -> Judged:
    """A shipped machine's numbers, changed, or its URDF, damaged, is looked at and run."""
    shipped = machine_folder(MACHINES[int(rng.integers(len(MACHINES)))])
    made = Path(shutil.copytree(shipped, folder / "machine"))
    numbers, bodies = made / NUMBERS, made / BODIES
    if rng.random() < 0.7:
        _written(numbers, mutated(read_mapping(numbers), rng))
    else:
        bodies.write_bytes(damaged(bodies.read_bytes(), rng))
    if rng.random() < WHOLE:
        return command("machine", str(made)).judged
    tree = {"format": "roboclimber-scenario/1", "machine": {"folder": str(made)}}
    return forked(partial(_runs, _written(folder / "on.yaml", tree))).judged


def spoilt_recording(folder: Path, rng: np.random.Generator) -> Judged:
    """A run's header, table or summary, changed, is read in one of the ways that there are."""
    run = Path(shutil.copytree(_recorded(), folder / "run"))
    name = ("recording.yaml", "data.parquet", "truth.parquet", "summary.json")[rng.integers(4)]
    if name == "recording.yaml" and rng.random() < 0.8:
        _written(run / name, mutated(read_mapping(run / name), rng))
    else:
        (run / name).write_bytes(damaged((run / name).read_bytes(), rng))
    if rng.random() < WHOLE:
        return command("view", str(run), "--no-open").judged
    ways: tuple[Callable[[], Ended], ...] = (
        partial(command, "estimate", str(run), "--out", str(folder / "forces.csv")),
        partial(command, "detect", str(run), "--out", str(folder / "contact.csv")),
        partial(_checked, run),
        partial(forked, partial(_summed_up, run)),
    )
    return ways[int(rng.integers(len(ways)))]().judged


def not_whole(folder: Path) -> str:
    """What is wrong with the records of a run: unreadable, not finite; empty: nothing."""
    try:
        _summed_up(folder)
    except (InputError, SimulationFault) as error:
        return f"its records are lost: {error}"
    return ""


def _checked(run: Path) -> Ended:
    """`testbed check`, which says on standard output why a recording cannot be used."""
    done = command("check", str(run))
    said = done.said or "testbed: cannot be used"
    return Ended(done.status, said) if done.status == 2 else done


def _runs(scenario: Path | str, model: Path | None = None) -> None:
    """Some steps of a scenario. Raises SimulationFault where it shows what is no number."""
    from testbed.scenario.scenario import load_scenario
    from testbed.world.simulation import Simulation

    world = Simulation(load_scenario(scenario), model=model)
    for rows in world.run_steps(STEPS):
        if not np.isfinite(rows).all():
            raise ValueError("a run without a fault recorded what is no number")


def _unfolds(sweep: Path) -> None:
    """All runs of a sweep, by name."""
    from testbed.scenario.sweep import load_sweep

    _, runs = load_sweep(sweep)
    if len({run.name for run in runs}) != len(runs):
        raise ValueError("two runs of a sweep share a folder")


def _summed_up(run: Path) -> None:
    """Read a run's every column. Raises SimulationFault for one that is not finite."""
    from testbed.simulation.runs import read_run

    found = read_run(run)
    for name, values in (*found.data.items(), *found.truth.items()):
        if not np.isfinite(values).all():
            raise SimulationFault(f"{name} is not finite")


@cache
def _recorded() -> Path:
    """A run to spoil copies of, made once in this process and gone with it."""
    import atexit

    place = Path(tempfile.mkdtemp(prefix="soak-"))
    atexit.register(shutil.rmtree, place, ignore_errors=True)
    done = command("run", "stand_slope_45", "--duration", "0.3", "--out", str(place / "run"))
    if done.status != 0:
        raise InputError(f"no run to spoil could be made: {done.said[-200:]}")
    (place / "run" / "report.html").unlink()
    return place / "run"


def _written(path: Path, tree: Any) -> Path:
    path.write_text(yaml_text(tree))
    return path
