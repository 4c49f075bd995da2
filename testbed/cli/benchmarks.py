"""The commands that measure the testbed itself: benchmarks, checks, the paper's experiments."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from testbed.cli.options import Json

benchmarks = typer.Typer()


@benchmarks.command()
def bench(
    json: Json = False,
    scenario: Annotated[
        list[str] | None, typer.Option(help="Time this whole scenario (repeat for more).")
    ] = None,
) -> None:
    """Measure the speed against the bare engine.

    Whole loop and bare engine take turns in one process.
    """
    if scenario:
        return _bench_scenarios(scenario, json)
    from testbed.benchmarks.speed.bench import bench as measured
    from testbed.report.console import print_json, print_table, waiting

    with waiting("measuring"):
        found = measured()
    if json:
        print_json(found)
    else:
        print_table(
            "Speed", ["figure", "value"], [[name, f"{value:.4g}"] for name, value in found.items()]
        )


def _bench_scenarios(names: list[str], json: bool) -> None:
    from testbed.benchmarks.speed.scenarios import scenario_speeds
    from testbed.report.console import print_json, print_table, waiting

    with waiting("measuring"):
        found = scenario_speeds(names)
    if json:
        return print_json(found)
    rows = [[f"{v:.3g}" if isinstance(v, float) else v for v in row.values()] for row in found]
    print_table("Speed of whole scenarios", list(found[0]), rows)


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
    """Identify every rig below a folder and judge it on its other recordings: relative force errors, one table."""
    from dataclasses import asdict

    from testbed.benchmarks.diagnosis.measured_rigs import mark_all, table
    from testbed.report.console import print_json, print_table, waiting

    with waiting("identifying"):
        found = mark_all(folder, diagnose)
    if json:
        print_json([asdict(m) for m in found])
    else:
        print_table("Relative force error on what was not identified on", *table(found))


@benchmarks.command()
def filters(
    out: Annotated[Path, typer.Option(help="Folder for filters.json.")],
    steps: Annotated[
        int, typer.Option(min=10, help="True steps in the trial of lock-out and delay.")
    ] = 10_000,
    json: Json = False,
) -> None:
    """Compare the force filters: six scenes, six rivals, lock-out and delay of true steps, in one table."""
    from testbed.benchmarks.filters.benchmark import run_benchmark, table
    from testbed.report.console import print_json, print_table, waiting

    with waiting("six scenes, seven filters"):
        answer = run_benchmark(out, steps=steps)
    if json:
        print_json(answer)
    else:
        print_table("Root mean square error of the filters", *table(answer))


@benchmarks.command()
def estimators(
    out: Annotated[
        Path,
        typer.Option(help="Folder for estimators.json, estimators.html and the runs; resumed."),
    ],
    few: Annotated[bool, typer.Option("--few", help="One run of each kind only.")] = False,
    json: Json = False,
) -> None:
    """Compare all force estimators: the paper's ladder, ours idea by idea, and the floor that the sensors set."""
    from testbed.benchmarks.estimators.benchmark import run as run_all
    from testbed.benchmarks.estimators.benchmark import trials
    from testbed.benchmarks.estimators.page import table, write_estimators
    from testbed.report.console import print_json, print_table
    from testbed.report.progress import counting_progress

    with counting_progress(len(trials(few)), "runs") as progress:
        found = run_all(out, progress, few)
    answer, page = write_estimators(found, out)
    if json:
        print_json(answer)
    else:
        print_table("Root mean square errors, N", *table(answer))
        print(page)


@benchmarks.command()
def distribution(
    out: Annotated[
        Path, typer.Option(help="Folder for distribution.json, .csv, .png and the single cases.")
    ],
    jobs: Annotated[int, typer.Option(help="Processes.")] = 1,
    cases: Annotated[int, typer.Option(help="How many of the held-out cases.")] = 1000,
    seeds: Annotated[int, typer.Option(help="From how many held-out sets, as many of each.")] = 1,
    controller: Annotated[
        list[str] | None,
        typer.Option(
            help="Controller, file.py:Class or policy.npz; may be repeated. [those shipped]"
        ),
    ] = None,
    json: Json = False,
) -> None:
    """Compare the force-distributing controllers on held-out cases against an oracle that knows the truth.

    Finished cases are kept: started again, it goes on.
    """
    from testbed.benchmarks.distribution.benchmark import benchmark, check, table, write
    from testbed.benchmarks.distribution.compare import rows
    from testbed.benchmarks.distribution.figure import write_figure
    from testbed.report.console import print_json, print_table
    from testbed.report.progress import counting_progress

    names = check(out, controller)
    with counting_progress(cases * seeds, "cases") as progress:
        result = benchmark(cases, jobs, names, progress, out / "cases", seeds)
    path = write(result, out)
    write_figure(result, out)
    if json:
        print_json(result)
    else:
        print_table("Force distribution", *table(result))
        if result["against_qp"]:
            print_table("Against the quadratic program", *rows(result["against_qp"]))
        print(path)


@benchmarks.command("evaluate-diagnosis")
def evaluate_diagnosis(
    out: Annotated[
        Path,
        typer.Option(help="Folder for evaluation.json and the single rigs; resumed if it exists."),
    ],
    rigs: Annotated[int, typer.Option(min=1, help="How many random rigs.")] = 200,
    jobs: Annotated[int, typer.Option(min=1, help="Processes.")] = 1,
    first_seed: Annotated[
        int | None, typer.Option(min=0, help="Seed of the first rig; the others follow it.")
    ] = None,
    json: Json = False,
) -> None:
    """Test the diagnosis blind on random rigs of an independent simulator."""
    from testbed.benchmarks.diagnosis.page import table, write_evaluation
    from testbed.benchmarks.diagnosis.trials import FIRST_SEED
    from testbed.benchmarks.diagnosis.trials import run as run_trials
    from testbed.report.console import print_json, print_table
    from testbed.report.progress import counting_progress

    with counting_progress(rigs, "rigs") as progress:
        seed = FIRST_SEED if first_seed is None else first_seed
        trials = run_trials(out, rigs, jobs, progress, seed)
    result, page = write_evaluation(trials, out)
    if json:
        print_json(result)
    else:
        print_table("Blind test of the diagnosis", *table(result))
        print(page)


@benchmarks.command()
def hydraulics(
    out: Annotated[Path, typer.Option(help="Folder for hydraulics.json and hydraulics.csv.")],
    manoeuvres: Annotated[int, typer.Option(min=1, max=1000, help="Random manoeuvres.")] = 30,
    seconds: Annotated[
        float, typer.Option(min=1.0, help="Simulated seconds for the balances.")
    ] = 600.0,
    json: Json = False,
) -> None:
    """Check the compiled hydraulics: against an independent solver, and its books of oil and energy."""
    from testbed.benchmarks.hydraulics.check import Difference, run_check, table
    from testbed.report.console import print_json, print_table
    from testbed.report.progress import counting_progress

    with counting_progress(manoeuvres, "manoeuvres") as progress:
        answer = run_check(out, manoeuvres, seconds, progress)
    if json:
        print_json(answer)
        return
    found = [
        Difference(**{k: v for k, v in d.items() if k != "holds"}) for d in answer["manoeuvres"]
    ]
    print_table("Force of the kernel less the reference's", *table(found))
    for name in ("balance", "balance_starved", "creep", "creep_tight"):
        print_table(name, ["figure", "value"], [[k, f"{v:.6g}"] for k, v in answer[name].items()])


@benchmarks.command("contact-loss")
def contact_loss(
    out: Annotated[
        Path,
        typer.Option(help="Folder for contact_loss.json, .html and scenes; goes on where it was."),
    ],
    hours: Annotated[
        float, typer.Option(help="Hours of drilling without losses; losses are scaled with them.")
    ] = 8.0,
    jobs: Annotated[int, typer.Option(min=1, help="Processes.")] = 1,
    tune: Annotated[
        bool, typer.Option("--tune", help="Run the tuning scenes and set thresholds.yaml.")
    ] = False,
    json: Json = False,
) -> None:
    """Score the detectors of contact loss on drilling with and without true losses: delay, recall, false alarms."""
    from testbed.benchmarks.contact_loss.benchmark import count_scenes, run
    from testbed.benchmarks.contact_loss.page import write_contact_loss
    from testbed.benchmarks.contact_loss.summary import table
    from testbed.report.console import print_json, print_table
    from testbed.report.progress import counting_progress

    split = "tuning" if tune else "scoring"
    with counting_progress(count_scenes(split, hours), "scenes") as progress:
        found = run(out, hours, jobs, split, progress)
    result, page = write_contact_loss(found, hours, out, tune)
    if json:
        print_json(result)
    else:
        print_table("Contact loss", *table(result))
        print(page)


@benchmarks.command()
def paper(
    out: Annotated[Path, typer.Option(help="Folder for paper.html and paper.json.")],
    figures: Annotated[
        list[str] | None,
        typer.Argument(metavar="[FIGURE]...", help="4 to 12, II to IV; all if none."),
    ] = None,
    json: Json = False,
) -> None:
    """Run the paper's experiments and set its claims beside what is measured."""
    from testbed.benchmarks.paper.page import rows, write_paper
    from testbed.benchmarks.paper.run import chosen, run_figures
    from testbed.formats.files import make_folder
    from testbed.report.console import print_json, print_table
    from testbed.report.progress import counting_progress

    wanted = chosen(figures or [])
    make_folder(out)
    with counting_progress(len(wanted), "figures") as progress:
        experiments = run_figures(wanted, progress)
    claims, page = write_paper(experiments, out)
    if json:
        print_json(claims)
    else:
        print_table("The paper's claims", *rows(experiments))
        print(page)
