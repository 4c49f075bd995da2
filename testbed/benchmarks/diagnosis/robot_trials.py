"""Blind test of the whole robot's diagnosis: one leg of four hides an effect, or none does.

    python -m testbed.benchmarks.diagnosis.robot_trials --runs 60 --first-seed 1 --out DIR --jobs 2

Every run sways on its own slope, with its own oil, payload, sensors and friction (which the model knows to a tenth
only). One JSON file a run in DIR/runs, so that a second call carries on; DIR/robot_trials.json and .md say how often
leg and effect were named. Thresholds are set on other seeds (`testbed.benchmarks.diagnosis.robot_calibration`).
"""

from __future__ import annotations

import argparse
import json
import sys
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
import numpy.typing as npt

from testbed.benchmarks.diagnosis.scores import Trial, calibration, confusion, quantiles, rate
from testbed.errors import InputError
from testbed.formats.files import make_folder, write_json, write_text
from testbed.machine.build import build_machine
from testbed.machine.names import LEGS
from testbed.scenario.scenario import Scenario, load_scenario
from testbed.simulation.workers import work_through

if TYPE_CHECKING:
    from testbed.diagnosis.robot.diagnose import RobotDiagnosis

Array = npt.NDArray[np.float64]
VISIBLE = 0.05
HIDDEN = Path(__file__).with_name("robot_hidden.yaml")
SIGNED = ("gain_error", "rate")
FRICTION_SPREAD = 0.1


@dataclass(frozen=True)
class Job:
    """One run and its file."""

    seed: int
    path: Path


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
    from testbed.diagnosis.robot.belief import signs_of
    from testbed.diagnosis.robot.diagnose import diagnose_robot
    from testbed.diagnosis.robot.findings import as_json

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


def do(job: Job) -> bool:
    """One run into its file. False: nothing can interrupt it half-way."""
    write_text(job.path, json.dumps(trial(job.seed)))
    return False


def run(out: Path, runs: int, first_seed: int = 1, jobs: int = 1) -> list[Trial]:
    """Trials of these seeds; those whose files are there are not run again. Raises InputError for a bad folder."""
    folder = make_folder(out / "runs")
    all_jobs = [
        Job(seed, folder / f"{seed:05d}.json") for seed in range(first_seed, first_seed + runs)
    ]
    todo = [job for job in all_jobs if not job.path.is_file()]
    for done, _ in enumerate(work_through(do, todo, jobs, bool), start=1):
        print(
            f"\r{len(all_jobs) - len(todo) + done} of {runs} runs",
            end="",
            file=sys.stderr,
            flush=True,
        )
    return [json.loads(job.path.read_text(encoding="utf-8")) for job in all_jobs]


def scores(trials: Sequence[Trial]) -> dict[str, Any]:
    """The contents of robot_trials.json."""
    hidden = [t for t in trials if t["truth"] and t["visible"]]
    return {
        "runs": len(trials),
        "seeds": [min(t["seed"] for t in trials), max(t["seed"] for t in trials)],
        "leg_and_effect_named": rate([t["names"] == t["truth"] for t in hidden]),
        "leg_named": rate(
            [{_place(n) for n in t["names"]} == {_place(n) for n in t["truth"]} for t in hidden]
        ),
        "among_first_two": rate(
            [t["truth"] in [h["names"] for h in t["hypotheses"][:2]] for t in hidden]
        ),
        "clean_none": rate([t["verdict"] == "none" for t in trials if not t["truth"]]),
        "intervals": rate([hit for t in hidden if t["names"] == t["truth"] for hit in _held(t)]),
        "error_after_over_refit": quantiles(
            [t["error"]["after"] / t["error"]["refit"] for t in hidden]
        ),
        "calibration": calibration(trials),
        "confusion": confusion(trials),
        "by_effect": {
            name: rate([t["names"] == t["truth"] for t in hidden if t["truth"][0].startswith(name)])
            for name in hidden_sizes()
            if name
        },
    }


def _place(name: str) -> str:
    return name.partition("@")[2]


def _held(t: Trial) -> list[bool]:
    """Of each parameter of the one effect that was named: whether its 90 % interval holds the truth."""
    given = t["effects"][0]["parameters"]
    pairs = [(given[k]["interval90"], v) for k, v in t["numbers"].items() if k in given]
    return [interval[0] <= v <= interval[1] for interval, v in pairs if interval]


def table(found: Mapping[str, Any]) -> str:
    """The scores as Markdown."""
    rows = [
        ("leg and effect named, nothing else", found["leg_and_effect_named"]),
        ("leg named, no other leg", found["leg_named"]),
        ("right among the first two hypotheses", found["among_first_two"]),
        ("sound machine: nothing named", found["clean_none"]),
        ("90 % intervals of parameters hold the truth", found["intervals"]),
    ]
    lines = ["| what | share | of | 95 % |", "|---|---|---|---|"]
    lines += [
        f"| {what} | {r['share']:.1%} | {r['of']} | {r['low95']:.1%} to {r['high95']:.1%} |"
        for what, r in rows
        if r["of"]
    ]
    lines += ["", "| hidden effect | named | of |", "|---|---|---|"]
    lines += [
        f"| {name} | {r['share']:.0%} | {r['of']} |"
        for name, r in found["by_effect"].items()
        if r["of"]
    ]
    c = found["calibration"]
    lines += [
        "",
        f"{found['runs']} runs, seeds {found['seeds'][0]} to {found['seeds'][1]}. Expected calibration error "
        f"{c['expected_calibration_error']:.3f}, Brier score {c['brier']:.3f} (base rates "
        f"{c['brier_of_base_rates']:.3f}).",
        "",
    ]
    return "\n".join(lines)


def main(arguments: Sequence[str] | None = None) -> int:
    """Run, score, write. Returns the exit status."""
    parser = argparse.ArgumentParser(
        prog="python -m testbed.benchmarks.diagnosis.robot_trials", description=__doc__
    )
    parser.add_argument("--out", type=Path, required=True)
    parser.add_argument("--runs", type=int, default=60)
    parser.add_argument("--first-seed", type=int, default=1)
    parser.add_argument("--jobs", type=int, default=1)
    asked = parser.parse_args(arguments)
    try:
        found = scores(run(asked.out, asked.runs, asked.first_seed, asked.jobs))
        write_json(asked.out / "robot_trials.json", found)
        write_text(asked.out / "robot_trials.md", table(found))
    except InputError as error:
        print(error, file=sys.stderr)
        return 2
    print(table(found))
    return 0


if __name__ == "__main__":
    sys.exit(main())
