"""The commands that measure the testbed itself: each makes a benchmark with its options; the
harness does the rest.
"""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from testbed.cli.options import Json

if TYPE_CHECKING:
    from testbed.benchmarks.harness import Benchmark

benchmarks = typer.Typer()
lab = typer.Typer(help="Further benchmarks, and the tools that set the testbed's own numbers.")
Out = Annotated[Path, typer.Option(help="Folder for results and finished cases; resumed.")]
Draw = Annotated[
    str | None,
    typer.Option(help="Draw each run's machine from these tolerances: workshop. [as drawn up]"),
]
Drawn = Annotated[
    str,
    typer.Option(
        help="Each run's machine is drawn from these tolerances: workshop; none: as drawn up."
    ),
]
WORKSHOP = "workshop"
Jobs = Annotated[int, typer.Option(min=1, help="Processes.")]


def show(benchmark: Benchmark[Any], out: Path, jobs: int, json: bool) -> None:
    """Run a benchmark and print its result: JSON, or tables and where the files are."""
    from testbed.benchmarks.harness import run
    from testbed.report.console import print_json, print_table
    from testbed.simulation.workers import single_threaded

    single_threaded()
    result = run(benchmark, out, jobs)
    if json:
        print_json(benchmark.published(result))
        return
    for table in benchmark.tables(result):
        print_table(*table)
    print(out / f"{benchmark.name}.json")


def tolerances_named(draw: str) -> str | None:
    """The tolerances of that name. Raises InputError where there are none."""
    from testbed.errors import InputError

    if draw not in (WORKSHOP, "none"):
        raise InputError("no such tolerances", field="--draw", value=draw, allowed="workshop, none")
    return None if draw == "none" else draw


@benchmarks.command()
def bench(
    json: Json = False,
    scenario: Annotated[
        list[str] | None, typer.Option(help="Time this whole scenario (repeat for more).")
    ] = None,
    command: Annotated[
        list[str] | None,
        typer.Option(help="Time `testbed run` of this scenario, report and all (repeat for more)."),
    ] = None,
) -> None:
    """Measure the speed against the bare engine.

    Whole loop and bare engine take turns in one process; a whole command has processes of its own.
    """
    from testbed.benchmarks.speed import bench as whole
    from testbed.benchmarks.speed import command as commands
    from testbed.benchmarks.speed import scenarios
    from testbed.report.console import print_json, print_table, waiting

    found: Any
    with waiting("measuring"):
        if command:
            found = commands.command_speeds(command)
            shown = commands.table(found)
        elif scenario:
            found = scenarios.scenario_speeds(scenario)
            shown = scenarios.table(found)
        else:
            found = whole.bench()
            shown = whole.table(found)
    if json:
        print_json(found)
    else:
        print_table(*shown)


@benchmarks.command("identify-measured")
def identify_measured(
    folder: Annotated[
        Path,
        typer.Argument(metavar="FOLDER", help="Folder of rigs, each with identify/ and verify/."),
    ],
    diagnose: Annotated[
        bool, typer.Option("--diagnose", help="Judge what the diagnosis adds, too.")
    ] = False,
    json: Json = False,
) -> None:
    """Identify every rig below a folder and judge it on its other recordings: relative force
    errors, one table.
    """
    from dataclasses import asdict

    from testbed.benchmarks.diagnosis.measured_rigs import mark_all, table
    from testbed.report.console import print_json, print_table, waiting

    with waiting("identifying"):
        found = mark_all(folder, diagnose)
    if json:
        print_json([asdict(m) for m in found])
    else:
        print_table(*table(found))


@benchmarks.command()
def filters(
    out: Out,
    steps: Annotated[
        int, typer.Option(min=10, help="True steps in the trial of lock-out and delay.")
    ] = 10_000,
    jobs: Jobs = 1,
    json: Json = False,
) -> None:
    """Compare the force filters: six scenes, six rivals, lock-out and delay of true steps, in one
    table.
    """
    from testbed.benchmarks.filters.benchmark import Filters

    show(Filters(steps=steps), out, jobs, json)


@benchmarks.command()
def estimators(
    out: Out,
    few: Annotated[bool, typer.Option("--few", help="One run of each kind only.")] = False,
    draw: Drawn = WORKSHOP,
    estimator: Annotated[
        list[str] | None,
        typer.Option(
            help="An estimator of your own beside the shipped ones, FILE.py:Class; may be repeated."
        ),
    ] = None,
    jobs: Jobs = 1,
    json: Json = False,
) -> None:
    """Compare all force estimators: the paper's ladder, ours idea by idea, and the floor that the
    sensors set.
    """
    from testbed.benchmarks.estimators.benchmark import Estimators

    show(Estimators(few, tolerances_named(draw), tuple(estimator or ())), out, jobs, json)


@benchmarks.command()
def machines(
    out: Out,
    machines: Annotated[int, typer.Option(min=1, help="Drawn machines.")] = 8,
    first_seed: Annotated[int, typer.Option(min=0, help="Seed of the first one.")] = 2000,
    commission: Annotated[
        bool, typer.Option(help="Let each machine commission itself first, ten simulated minutes.")
    ] = True,
    recordings: Annotated[
        Path | None, typer.Option(help="Keep the runs in this folder, and take them from there.")
    ] = None,
    jobs: Jobs = 1,
    json: Json = False,
) -> None:
    """Judge the whole-body estimate on drawn machines: perfect, commissioned and drawing-board
    belief, idea by idea.
    """
    from testbed.benchmarks.machines.benchmark import DrawnMachines

    benchmark = DrawnMachines(machines, first_seed, WORKSHOP, commission, recordings)
    show(benchmark, out, jobs, json)


@benchmarks.command()
def distribution(
    out: Out,
    jobs: Jobs = 1,
    cases: Annotated[int, typer.Option(help="How many of the held-out cases.")] = 1000,
    seeds: Annotated[int, typer.Option(help="From how many held-out sets, as many of each.")] = 1,
    draw: Drawn = WORKSHOP,
    controller: Annotated[
        list[str] | None,
        typer.Option(
            help="Controller, file.py:Class or policy.npz; may be repeated. [those shipped]"
        ),
    ] = None,
    json: Json = False,
) -> None:
    """Compare the force-distributing controllers on held-out cases against an oracle that knows the
    truth.
    """
    from testbed.benchmarks.distribution.benchmark import ForceDistribution
    from testbed.control.distribution.controllers import CONTROLLERS

    names = tuple(controller or CONTROLLERS)
    show(ForceDistribution(cases, seeds, names, tolerances_named(draw)), out, jobs, json)


@benchmarks.command("evaluate-diagnosis")
def evaluate_diagnosis(
    out: Out,
    rigs: Annotated[int, typer.Option(min=1, help="How many random rigs.")] = 200,
    jobs: Jobs = 1,
    first_seed: Annotated[
        int, typer.Option(min=0, help="Seed of the first rig; the others follow it.")
    ] = 1000,
    json: Json = False,
) -> None:
    """Test the diagnosis blind on random rigs of an independent simulator."""
    from testbed.benchmarks.diagnosis.benchmark import BlindTest

    show(BlindTest(rigs, first_seed), out, jobs, json)


@benchmarks.command()
def hydraulics(
    out: Out,
    manoeuvres: Annotated[int, typer.Option(min=1, max=1000, help="Random manoeuvres.")] = 30,
    seconds: Annotated[
        float, typer.Option(min=1.0, help="Simulated seconds for the balances.")
    ] = 600.0,
    jobs: Jobs = 1,
    json: Json = False,
) -> None:
    """Check the compiled hydraulics: against an independent solver, and its books of oil and
    energy.
    """
    from testbed.benchmarks.hydraulics.benchmark import Hydraulics

    show(Hydraulics(manoeuvres, seconds), out, jobs, json)


@benchmarks.command("contact-loss")
def contact_loss(
    out: Out,
    hours: Annotated[
        float,
        typer.Option(
            help="Hours that single feet spend in scoring scenes; four feet, so a quarter is simulated."
        ),
    ] = 1.0,
    jobs: Jobs = 1,
    tune: Annotated[
        bool,
        typer.Option(
            "--tune", help="Run as many tuning scenes too and set thresholds.yaml on them."
        ),
    ] = False,
    detector: Annotated[
        list[str] | None,
        typer.Option(
            help="A detector of your own beside the shipped ones, FILE.py:Class; may be repeated. The tuning scenes "
            "set its threshold."
        ),
    ] = None,
    draw: Annotated[
        str,
        typer.Option(help="Draw each scene's machine from these tolerances; none: as drawn up."),
    ] = "workshop",
    commission: Annotated[
        bool,
        typer.Option(
            "--commission",
            help="Score once more with what each machine's commissioning finds, 8 simulated minutes a machine.",
        ),
    ] = False,
    json: Json = False,
) -> None:
    """Score the detectors of contact loss on drawn machines that drill and walk: every loss,
    touchdown and wrong second.
    """
    from testbed.benchmarks.contact_loss.benchmark import ContactLoss

    chosen = None if draw == "none" else draw
    benchmark = ContactLoss(hours, tune, chosen, tuple(detector or ()), commission)
    show(benchmark, out, jobs, json)


@benchmarks.command()
def soak(
    out: Out,
    trials: Annotated[
        int, typer.Option(min=1, help="Trials of each kind; of those that take long, fewer.")
    ] = 1000,
    seed: Annotated[int, typer.Option(min=0, help="Seed of the first trial of a kind.")] = 0,
    hours: Annotated[
        float, typer.Option(min=0.0, max=25.0, help="Simulated hours of drilling in one run.")
    ] = 12.0,
    only: Annotated[
        list[str] | None,
        typer.Option(help="A kind, as 'killed run'; may be repeated. [all]"),
    ] = None,
    jobs: Jobs = 1,
    json: Json = False,
) -> None:
    """Try the testbed with bad intent: spoilt files, random actions, kills, full disks, clocks that
    jump, two owners, half a day in one run; what fell over, hung or was lost.
    """
    from testbed.benchmarks.soak.benchmark import Soak

    show(Soak(trials, seed, hours, tuple(only or ())), out, jobs, json)


@benchmarks.command()
def paper(
    out: Out,
    figures: Annotated[
        list[str] | None,
        typer.Argument(metavar="[FIGURE]...", help="4 to 12, II to IV; all if none."),
    ] = None,
    machine: Annotated[
        str,
        typer.Option(help="Set of the machine's numbers: inferred, original or overlapped."),
    ] = "inferred",
    jobs: Jobs = 1,
    json: Json = False,
) -> None:
    """Run the paper's experiments and set its claims beside what is measured."""
    from testbed.benchmarks.paper.benchmark import Paper

    show(Paper(tuple(figures or ()), machine), out, jobs, json)


@lab.command()
def climbs(
    out: Out,
    seeds: Annotated[int, typer.Option(help="Last seed of each case.")] = 20,
    first_seed: Annotated[int, typer.Option(help="First seed of each case.")] = 1,
    way: Annotated[float, typer.Option(min=0.01, help="How far up the slope, m.")] = 10.0,
    case: Annotated[
        list[str] | None, typer.Option(help="A case, as 'plane 45'; may be repeated. [all]")
    ] = None,
    gait: Annotated[
        list[str] | None,
        typer.Option(help="FILE.py:Class that climbs beside the shipped gait; may be repeated."),
    ] = None,
    jobs: Jobs = 1,
    json: Json = False,
) -> None:
    """Climb ten metres up every slope, on planes and on rough rock, several seeds each, every seed
    on its own drawn machine.
    """
    from testbed.benchmarks.climbs.climbs import CASES, Climbs

    cases, own = tuple(case or CASES), tuple(gait or ())
    show(Climbs(seeds, first_seed, way, cases, own), out, jobs, json)


@lab.command("control-tasks")
def control_tasks(
    out: Out,
    task: Annotated[
        list[str] | None, typer.Option(help="keep or drill-hole; may be repeated. [all]")
    ] = None,
    cases: Annotated[int, typer.Option(min=1, help="Held-out cases of each task.")] = 20,
    first_seed: Annotated[
        int, typer.Option(min=0, help="Seed of the first case; those below 100000 are for tuning.")
    ] = 100_000,
    oracle_episodes: Annotated[
        int, typer.Option(min=1, help="Plans that the oracle tries on each case.")
    ] = 32,
    policy: Annotated[
        list[str] | None,
        typer.Option(help="A policy.npz of `testbed train`, of the one task; may be repeated."),
    ] = None,
    jobs: Jobs = 1,
    json: Json = False,
) -> None:
    """Say how much there is to win in the tasks of control, and who wins it: rules, models,
    policies, an oracle.
    """
    from testbed.benchmarks.control_tasks.benchmark import ControlTasks
    from testbed.benchmarks.control_tasks.tasks import TASKS

    chosen = tuple(task or TASKS)
    made = ControlTasks(chosen, cases, first_seed, oracle_episodes, tuple(policy or ()))
    show(made, out, jobs, json)


@lab.command("expected-loads")
def expected_loads(
    out: Out,
    cases: Annotated[int, typer.Option(min=1, help="How many random stands.")] = 400,
    jobs: Jobs = 1,
    json: Json = False,
) -> None:
    """Compare expected foot loads with the simulated truth in quiet stands."""
    from testbed.benchmarks.climbs.expected_loads import ExpectedLoadStands

    show(ExpectedLoadStands(cases), out, jobs, json)


@lab.command("quiet-stand")
def quiet_stand(
    out: Out,
    seconds: Annotated[float, typer.Option(min=3.0, help="Simulated seconds.")] = 60.0,
    jobs: Jobs = 1,
    json: Json = False,
) -> None:
    """Say what a quiet stand's foot loads owe to the engine and what to the machine."""
    from testbed.benchmarks.climbs.quiet_stand import QuietStand

    show(QuietStand(seconds), out, jobs, json)


@lab.command("paper-sensitivity")
def paper_sensitivity(out: Out, jobs: Jobs = 1, json: Json = False) -> None:
    """Say which number of the inferred circuit each of the paper's figures fixes, and which it
    leaves open.
    """
    from testbed.benchmarks.paper.sensitivity import Sensitivity

    show(Sensitivity(), out, jobs, json)


@lab.command("robot-diagnosis")
def robot_diagnosis(
    out: Out,
    runs: Annotated[int, typer.Option(min=1, help="How many random runs.")] = 60,
    first_seed: Annotated[int, typer.Option(min=0, help="Seed of the first run.")] = 2000,
    recordings: Annotated[
        Path | None, typer.Option(help="Folder where simulated runs are kept and taken from.")
    ] = None,
    second: Annotated[bool, typer.Option(help="Let a second motion decide close cases.")] = True,
    closed: Annotated[bool, typer.Option(help="Judge what was found on another motion.")] = True,
    jobs: Jobs = 1,
    json: Json = False,
) -> None:
    """Test the whole robot's diagnosis blind: drawn machines that hide one effect, two, one without
    a name, or none.
    """
    from testbed.benchmarks.diagnosis.robot_benchmark import RobotBlindTest
    from testbed.benchmarks.diagnosis.robot_trials import Asked

    show(RobotBlindTest(runs, first_seed, Asked(recordings, second, closed)), out, jobs, json)


@lab.command()
def quotes(
    root: Annotated[Path, typer.Argument(help="The project's folder.")] = Path(),
) -> None:
    """Put the numbers of committed results into README and docs (docs/quotes.yaml lists them)."""
    from testbed.benchmarks.quotes import refresh

    for page in refresh(root):
        print(page)


@lab.command("warning-numbers")
def warning_numbers(
    folder: Annotated[Path, typer.Argument(help="Folder that `testbed contact-loss` has written.")],
    split: Annotated[str, typer.Option(help="tuning or scoring.")] = "tuning",
) -> None:
    """Say what each number of the early warning is worth: it and its neighbours on scenes that are
    kept.
    """
    from testbed.benchmarks.contact_loss.warning_numbers import report

    for line in report(folder, split):
        print(line, flush=True)


@lab.command("train-detector")
def train_detector(
    folder: Annotated[
        Path, typer.Argument(help="Folder that `testbed contact-loss --tune` has written.")
    ],
    out: Annotated[Path, typer.Option(help="Weights to write, .npz.")],
    epochs: Annotated[int, typer.Option(min=1, help="Times through all cases.")] = 15,
) -> None:
    """Train the learned detector of contact loss on the tuning scenes alone."""
    from testbed.benchmarks.contact_loss.training import train_on

    for line in train_on(folder, out, epochs):
        print(line, flush=True)


Folders = Annotated[list[Path], typer.Argument(metavar="DIR...", help="Folders of trials.")]
File = Annotated[Path | None, typer.Option(help="File to write. [the shipped one]")]


@lab.command("fit-diagnosis")
def fit_diagnosis(folders: Folders, out: File = None) -> None:
    """Fit the numbers of the diagnosis to rigs of `testbed evaluate-diagnosis`, development rigs
    from then on.
    """
    from testbed.benchmarks.diagnosis.calibration import fit_file

    print(fit_file(folders, out))


@lab.command("bench-diagnosis")
def bench_diagnosis(
    out: Out,
    rigs: Annotated[int, typer.Option(min=1, help="How many simulated benches and drives.")] = 60,
    jobs: Jobs = 1,
    first_seed: Annotated[
        int, typer.Option(min=0, help="Seed of the first rig; the others follow it.")
    ] = 500,
    json: Json = False,
) -> None:
    """Test the diagnosis of benches and drives on simulated ones, with laws that no name covers
    among them.
    """
    from testbed.benchmarks.diagnosis.bench_trials import BenchTest

    show(BenchTest(rigs, first_seed), out, jobs, json)


@lab.command("fit-bench-diagnosis")
def fit_bench_diagnosis(folders: Folders, out: File = None) -> None:
    """Fit the numbers of the diagnosis of benches and drives to rigs of `testbed lab
    bench-diagnosis`.
    """
    from testbed.benchmarks.diagnosis.bench_trials import fit_file

    print(fit_file(folders, out))


@lab.command("fit-robot-diagnosis")
def fit_robot_diagnosis(folders: Folders, out: File = None) -> None:
    """Fit the numbers of the robot's diagnosis to runs of `testbed lab robot-diagnosis`."""
    from testbed.benchmarks.diagnosis.robot_calibration import fit_file

    print(fit_file(folders, out))


benchmarks.add_typer(lab, name="lab")
