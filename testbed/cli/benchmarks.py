"""The commands that measure the testbed itself: each makes a benchmark with its options; the
harness does the rest.
"""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Any

import typer

from testbed.cli.options import Json, Work, spread

Drawn = Annotated[
    str,
    typer.Option(
        help="Each run's machine is drawn from these tolerances: workshop; none: as drawn up."
    ),
]
WORKSHOP = "workshop"


def tolerances_named(draw: str) -> str | None:
    """The tolerances of that name. Raises InputError where there are none."""
    from testbed.errors import InputError

    if draw not in (WORKSHOP, "none"):
        raise InputError("no such tolerances", field="--draw", value=draw, allowed="workshop, none")
    return None if draw == "none" else draw


def bench(
    json: Json = False,
    scenario: Annotated[
        list[str] | None, typer.Option(help="Time this whole scenario (repeat for more).")
    ] = None,
    command: Annotated[
        list[str] | None,
        typer.Option(help="Time `testbed run` of this scenario, report and all (repeat for more)."),
    ] = None,
    workers: Annotated[
        list[int] | None,
        typer.Option(help="Time environments in so many processes beside one (repeat for more)."),
    ] = None,
) -> None:
    """Measure the speed against the bare engine.

    Whole loop and bare engine take turns in one process; a whole command has processes of its own.
    """
    from testbed.benchmarks.speed import bench as whole
    from testbed.benchmarks.speed import whole_runs
    from testbed.benchmarks.speed.workers import worker_speeds, workers_table
    from testbed.errors import InputError
    from testbed.report.console import answer, waiting

    if sum(bool(asked) for asked in (scenario, command, workers)) > 1:
        raise InputError("one of --scenario, --command and --workers at a time")
    found: Any
    with waiting("measuring"):
        if workers:
            found = worker_speeds(workers)
            shown = workers_table(found)
        elif command:
            found = whole_runs.command_speeds(command)
            shown = whole_runs.command_table(found)
        elif scenario:
            found = whole_runs.scenario_speeds(scenario)
            shown = whole_runs.scenario_table(found)
        else:
            found = whole.bench()
            shown = whole.table(found)
    answer(json, found, shown)


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
    from testbed.report.console import answer, waiting

    with waiting("identifying"):
        found = mark_all(folder, diagnose)
    answer(json, [asdict(m) for m in found], table(found))


@spread
def filters(
    work: Work,
    steps: Annotated[
        int, typer.Option(min=10, help="True steps in the trial of lock-out and delay.")
    ] = 10_000,
) -> None:
    """Compare the force filters: six scenes, six rivals, lock-out and delay of true steps, in one
    table.
    """
    from testbed.benchmarks.filters.benchmark import Filters

    work.show(Filters(steps=steps))


@spread
def estimators(
    work: Work,
    few: Annotated[bool, typer.Option("--few", help="One run of each kind only.")] = False,
    kind: Annotated[
        list[str] | None,
        typer.Option(help="Runs of this kind alone (stand, walk, liar, ...); may be repeated."),
    ] = None,
    draw: Drawn = WORKSHOP,
    estimator: Annotated[
        list[str] | None,
        typer.Option(
            help="An estimator of your own beside the shipped ones, FILE.py:Class; may be repeated."
        ),
    ] = None,
) -> None:
    """Compare all force estimators: the paper's ladder, ours idea by idea, and the floor that the
    sensors set.
    """
    from testbed.benchmarks.estimators.benchmark import Estimators

    benchmark = Estimators(few, tolerances_named(draw), tuple(estimator or ()), tuple(kind or ()))
    work.show(benchmark)


@spread
def machines(
    work: Work,
    machines: Annotated[int, typer.Option(min=1, help="Drawn machines.")] = 8,
    first_seed: Annotated[int, typer.Option(min=0, help="Seed of the first one.")] = 2000,
    commission: Annotated[
        bool, typer.Option(help="Let each machine commission itself first, ten simulated minutes.")
    ] = True,
    recordings: Annotated[
        Path | None,
        typer.Option(help="Keep runs and models in this folder, and take them from there."),
    ] = None,
    ideas: Annotated[
        int,
        typer.Option(min=0, help="Machines on which each idea of the estimate is left out too."),
    ] = 8,
    machine: Annotated[
        str, typer.Option(help="Which they are drawn from: roboclimber, climber_8t, quarter_model.")
    ] = "roboclimber",
    stuck_seals: Annotated[
        float,
        typer.Option(
            min=0,
            max=1,
            help="Seals are stuck at the start of a run, each with up to this share of its"
            " break-away force and either way; 0: all begin loose.",
        ),
    ] = 1.0,
) -> None:
    """Judge the whole-body estimate on drawn machines: perfect, commissioned and drawing-board
    belief, idea by idea.
    """
    from testbed.benchmarks.machines.benchmark import DrawnMachines

    benchmark = DrawnMachines(
        machines, first_seed, WORKSHOP, commission, recordings, ideas, machine, stuck_seals
    )
    work.show(benchmark)


@spread
def distribution(
    work: Work,
    cases: Annotated[int, typer.Option(help="How many of the held-out cases.")] = 1000,
    seeds: Annotated[int, typer.Option(help="From how many held-out sets, as many of each.")] = 1,
    draw: Drawn = WORKSHOP,
    controller: Annotated[
        list[str] | None,
        typer.Option(
            help="Controller, file.py:Class or policy.npz; may be repeated. [those shipped]"
        ),
    ] = None,
) -> None:
    """Compare the force-distributing controllers on held-out cases against an oracle that knows the
    truth.
    """
    from testbed.benchmarks.distribution.benchmark import ForceDistribution
    from testbed.control.distribution.controllers import CONTROLLERS

    names = tuple(controller or CONTROLLERS)
    work.show(ForceDistribution(cases, seeds, names, tolerances_named(draw)))


@spread
def evaluate_diagnosis(
    work: Work,
    rigs: Annotated[int, typer.Option(min=1, help="How many random rigs.")] = 200,
    first_seed: Annotated[
        int, typer.Option(min=0, help="Seed of the first rig; the others follow it.")
    ] = 1000,
) -> None:
    """Test the diagnosis blind on random rigs of an independent simulator."""
    from testbed.benchmarks.diagnosis.benchmark import BlindTest

    work.show(BlindTest(rigs, first_seed))


@spread
def hydraulics(
    work: Work,
    manoeuvres: Annotated[int, typer.Option(min=1, max=1000, help="Random manoeuvres.")] = 30,
    seconds: Annotated[
        float, typer.Option(min=1.0, help="Simulated seconds for the balances.")
    ] = 600.0,
) -> None:
    """Check the compiled hydraulics: against an independent solver, and its books of oil and
    energy.
    """
    from testbed.benchmarks.hydraulics.benchmark import Hydraulics

    work.show(Hydraulics(manoeuvres, seconds))


@spread
def contact_loss(
    work: Work,
    hours: Annotated[
        float,
        typer.Option(
            help="Hours that single feet spend in scoring scenes; four feet, so a quarter is simulated."
        ),
    ] = 1.0,
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
    draw: Drawn = WORKSHOP,
    commission: Annotated[
        bool,
        typer.Option(
            "--commission",
            help="Score once more with what each machine's commissioning finds, 8 simulated minutes a machine.",
        ),
    ] = False,
) -> None:
    """Score the detectors of contact loss on drawn machines that drill and walk: every loss,
    touchdown and wrong second.
    """
    from testbed.benchmarks.contact_loss.benchmark import ContactLoss

    own = tuple(detector or ())
    work.show(ContactLoss(hours, tune, tolerances_named(draw), own, commission))


@spread
def soak(
    work: Work,
    trials: Annotated[
        int, typer.Option(min=1, help="Trials of each kind; of those that take long, fewer.")
    ] = 1000,
    seed: Annotated[int, typer.Option(min=0, help="Seed of the first trial of a kind.")] = 0,
    hours: Annotated[
        float, typer.Option(min=0.0, max=25.0, help="Simulated hours of drilling in one run.")
    ] = 12.0,
    only: Annotated[
        list[str] | None, typer.Option(help="A kind, as 'killed run'; may be repeated. [all]")
    ] = None,
) -> None:
    """Try the testbed with bad intent: spoilt files, random actions, kills, full disks, clocks that
    jump, two owners, half a day in one run; what fell over, hung or was lost.
    """
    from testbed.benchmarks.soak.benchmark import Soak

    work.show(Soak(trials, seed, hours, tuple(only or ())))


@spread
def paper(
    work: Work,
    figures: Annotated[
        list[str] | None,
        typer.Argument(metavar="[FIGURE]...", help="4 to 12, II to IV; all if none."),
    ] = None,
    machine: Annotated[
        str, typer.Option(help="Set of the machine's numbers: inferred, original or overlapped.")
    ] = "inferred",
) -> None:
    """Run the paper's experiments and set its claims beside what is measured."""
    from testbed.benchmarks.paper.benchmark import Paper

    work.show(Paper(tuple(figures or ()), machine))
