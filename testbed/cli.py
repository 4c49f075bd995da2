"""The command line: one thin command each; every import that costs time happens inside its command."""

from __future__ import annotations

import sys
from pathlib import Path
from typing import Annotated

import typer

app = typer.Typer(
    name="testbed",
    help="ROBOCLIMBER testbed: simulate, record, estimate and explain a hydraulic climbing robot.",
    no_args_is_help=True,
    add_completion=False,
    rich_markup_mode=None,
    pretty_exceptions_enable=False,
)

Json = Annotated[bool, typer.Option("--json", help="Print the answer as JSON on standard output.")]


@app.callback()
def _root(
    debug: Annotated[bool, typer.Option("--debug", help="Show the traceback of a fault.")] = False,
) -> None:
    """ROBOCLIMBER testbed: simulate, record, estimate and explain a hydraulic climbing robot."""


@app.command()
def run(
    scenario: Annotated[str, typer.Argument(help="Scenario file, or the name of a shipped one.")],
    out: Annotated[Path | None, typer.Option(help="Output folder. [runs/<name>-<seed>]")] = None,
    seed: Annotated[int | None, typer.Option(help="Seed instead of the scenario's.")] = None,
    duration: Annotated[float | None, typer.Option(help="Simulated seconds instead of the scenario's.")] = None,
    set_: Annotated[list[str] | None, typer.Option("--set", help="Change a value: a.b=c. May be repeated.")] = None,
    model: Annotated[Path | None, typer.Option(help="Model file that the estimators believe.")] = None,
    gui: Annotated[bool, typer.Option("--gui", help="Show the engine's window.")] = False,
    json: Json = False,
) -> None:
    """Simulate a scenario, record it and write its report."""
    from testbed.evaluation.run import run_scenario
    from testbed.parameters.scenario import load_scenario
    from testbed.report.console import print_run, run_progress, waiting

    loaded = load_scenario(scenario, set_ or [], seed, duration)
    with run_progress(loaded.duration_s, loaded.name) as progress:
        result = run_scenario(loaded, out, model, gui, progress)
    from testbed.report.run_report import write_report

    with waiting("writing the report"):
        report = write_report(result.folder)
    print_run(result.summary, result.folder, report, json)
    if result.interrupted:
        raise typer.Exit(130)


@app.command()
def estimate(
    recording: Annotated[Path, typer.Argument(help="Folder of a recording: one leg, or a run of the robot.")],
    out: Annotated[Path, typer.Option(help="Table to write: .parquet or .csv.")],
    model: Annotated[Path | None, typer.Option(help="Model file (a robot's recording carries its own).")] = None,
    causal: Annotated[bool, typer.Option("--causal", help="Use only what came before each sample.")] = False,
    json: Json = False,
) -> None:
    """Write the external force of a recording.

    One leg: a value and the set that friction leaves open. A run of the robot: the same for each foot.
    """
    from testbed.evaluation.estimates import estimate_file
    from testbed.report.console import print_json

    done = estimate_file(recording, model, out, causal)
    if json:
        print_json(done)
    else:
        print(f"{done['rows']} rows of {', '.join(done['columns'])}: {done['out']}")


@app.command()
def bench(
    json: Json = False,
    scenario: Annotated[list[str] | None, typer.Option(help="Time this whole scenario (repeat for more).")] = None,
) -> None:
    """Measure the speed against the bare engine.

    Whole loop and bare engine take turns in one process.
    """
    if scenario:
        return _bench_scenarios(scenario, json)
    from testbed.evaluation.bench import bench as measured
    from testbed.report.console import print_json, print_table, waiting

    with waiting("measuring"):
        found = measured()
    if json:
        print_json(found)
    else:
        print_table("Speed", ["figure", "value"], [[name, f"{value:.4g}"] for name, value in found.items()])


def _bench_scenarios(names: list[str], json: bool) -> None:
    from testbed.evaluation.bench_scenarios import scenario_speeds
    from testbed.report.console import print_json, print_table, waiting

    with waiting("measuring"):
        found = scenario_speeds(names)
    if json:
        return print_json(found)
    rows = [[f"{v:.3g}" if isinstance(v, float) else v for v in row.values()] for row in found]
    print_table("Speed of whole scenarios", list(found[0]), rows)


@app.command("scenario-schema")
def scenario_schema(json: Json = False) -> None:
    """List every field of a scenario file."""
    from testbed.report.console import print_json, print_table

    if json:
        from testbed.parameters.scenario import Scenario

        print_json(Scenario.model_json_schema())
        return
    from testbed.parameters.scenario_schema import rows

    print_table("Fields of a scenario file", ["field", "default", "allowed", "meaning"], [list(r) for r in rows()])


@app.command()
def parameters(json: Json = False) -> None:
    """List every number of the machine."""
    from testbed.parameters.provenance import roboclimber
    from testbed.report.console import print_json, print_parameters

    leaves = list(roboclimber().leaves())
    if json:
        print_json({path: vars(quantity) for path, quantity in leaves})
    else:
        print_parameters(leaves)


@app.command()
def view(
    folder: Annotated[Path, typer.Argument(metavar="RUN", help="Folder of a run.")],
    open_: Annotated[bool, typer.Option("--open/--no-open", help="Open the report in a browser.")] = True,
) -> None:
    """Open a run's report.

    A killed run gets its report now. Prints where the report is.
    """
    from testbed.report.run_report import write_report

    report = folder / "report.html"
    if not report.is_file():
        report = write_report(folder)
    print(report)
    if open_ and sys.stdout.isatty():
        import webbrowser

        webbrowser.open(report.resolve().as_uri())


@app.command()
def calibrate(
    recordings: Annotated[list[Path], typer.Argument(metavar="RECORDING...", help="Folders of one rig's recordings.")],
    json: Json = False,
) -> None:
    """Calibrate the pressure sensors: a and b of p = k (a V + b) with their uncertainty."""
    from testbed.estimation.calibration import calibrate as fit
    from testbed.parameters.recording import read_recording
    from testbed.report.console import print_calibration, print_json

    result = fit([read_recording(folder) for folder in recordings])
    if json:
        print_json(result.tree())
    else:
        print_calibration(result)


@app.command()
def identify(
    rig: Annotated[Path, typer.Argument(metavar="RIG", help="Folder with identify/ and verify/.")],
    out: Annotated[Path, typer.Option(help="Model file to write.")],
    json: Json = False,
) -> None:
    """Identify friction (5): eight parameters with 90 % intervals, and what the motion cannot show."""
    from testbed.estimation.friction_identification import identify_rig
    from testbed.parameters.leg_model import write_model
    from testbed.parameters.recording import read_rig
    from testbed.report.console import print_identification, print_json

    result = identify_rig(read_rig(rig))
    write_model(out, result.model)
    if json:
        print_json(result.tree())
    else:
        print_identification(result, out)


@app.command("identify-measured")
def identify_measured(
    folder: Annotated[Path, typer.Argument(metavar="FOLDER", help="Folder of rigs, each with identify/ and verify/.")],
    json: Json = False,
) -> None:
    """Identify every rig below a folder and judge it on its other recordings: relative force errors, one table."""
    from dataclasses import asdict

    from testbed.evaluation.measured_rigs import mark_all, table
    from testbed.report.console import print_json, print_table, waiting

    with waiting("identifying"):
        found = mark_all(folder)
    if json:
        print_json([asdict(m) for m in found])
    else:
        print_table("Relative force error on what was not identified on", *table(found))


@app.command()
def filters(
    out: Annotated[Path, typer.Option(help="Folder for filters.json.")],
    steps: Annotated[int, typer.Option(min=10, help="True steps in the trial of lock-out and delay.")] = 10_000,
    json: Json = False,
) -> None:
    """Compare the force filters: six scenes, six rivals, lock-out and delay of true steps, in one table."""
    from testbed.evaluation.filters_benchmark import run_benchmark, table
    from testbed.report.console import print_json, print_table, waiting

    with waiting("six scenes, seven filters"):
        answer = run_benchmark(out, steps=steps)
    if json:
        print_json(answer)
    else:
        print_table("Root mean square error of the filters", *table(answer))


@app.command()
def estimators(
    out: Annotated[Path, typer.Option(help="Folder for estimators.json, estimators.html and the runs; resumed.")],
    few: Annotated[bool, typer.Option("--few", help="One run of each kind only.")] = False,
    json: Json = False,
) -> None:
    """Compare all force estimators: the paper's ladder, ours idea by idea, and the floor that the sensors set."""
    from testbed.evaluation.estimators import run as run_all
    from testbed.evaluation.estimators import trials
    from testbed.report.console import print_json, print_table
    from testbed.report.estimators_page import table, write_estimators
    from testbed.report.progress import counting_progress

    with counting_progress(len(trials(few)), "runs") as progress:
        found = run_all(out, progress, few)
    answer, page = write_estimators(found, out)
    if json:
        print_json(answer)
    else:
        print_table("Root mean square errors, N", *table(answer))
        print(page)


@app.command()
def distribution(
    out: Annotated[Path, typer.Option(help="Folder for distribution.json and the single cases.")],
    jobs: Annotated[int, typer.Option(help="Processes.")] = 1,
    cases: Annotated[int, typer.Option(help="How many of the held-out cases.")] = 1000,
    seeds: Annotated[int, typer.Option(help="From how many held-out sets, as many of each.")] = 1,
    controller: Annotated[
        list[str] | None, typer.Option(help="Controller, file.py:Class or policy.npz; may be repeated. [those shipped]")
    ] = None,
    json: Json = False,
) -> None:
    """Compare the force-distributing controllers on held-out cases against an oracle that knows the truth.

    Finished cases are kept: started again, it goes on.
    """
    from testbed.evaluation.distribution import benchmark, check, table, write
    from testbed.evaluation.distribution_compare import rows
    from testbed.report.console import print_json, print_table
    from testbed.report.distribution_figure import write_figure
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


@app.command()
def diagnose(
    rig: Annotated[Path, typer.Argument(metavar="RIG", help="Folder with identify/ and verify/, or a robot's run.")],
    out: Annotated[Path, typer.Option(help="Folder for findings.json, three model files and report.html.")],
    model: Annotated[Path | None, typer.Option(help="Model to start from: what does it still lack?")] = None,
    suggest: Annotated[Path | None, typer.Option(help="Write a motion that parts ambiguous effects (.csv).")] = None,
    json: Json = False,
) -> None:
    """Say which effect a measured machine has and its model lacks, add it, and report the error before and after.

    RIG is one axis' recordings or a run of the whole robot; of a run it says which leg too.
    """
    from testbed.report.console import print_json, print_table
    from testbed.report.diagnosing import diagnose_folder
    from testbed.report.progress import working

    with working("diagnosing") as tell:
        done = diagnose_folder(rig, out, model, suggest, tell)
    if json:
        print_json(done.tree)
    else:
        print_table(done.title, *done.table)
        print(done.page)


@app.command()
def loop(
    out: Annotated[Path, typer.Option(help="Folder for the runs, loop.json and loop.html; resumed if it exists.")],
    scenario: Annotated[list[str] | None, typer.Option(help="A scenario; may be repeated. [the five shipped]")] = None,
    json: Json = False,
) -> None:
    """Close the loop on the whole robot: run, diagnose, believe the model, run again, compare the foot-force error."""
    from testbed.diagnosis.findings import prepare
    from testbed.report.console import print_json, print_table
    from testbed.report.loop import SCENARIOS, close_loop, table
    from testbed.report.progress import working

    prepare(out)
    with working("closing the loop") as tell:
        result = close_loop(out, scenario or SCENARIOS, tell)
    if json:
        print_json(result)
    else:
        print_table("The loop on the whole robot", *table(result))
        print(out / "loop.html")


@app.command("evaluate-diagnosis")
def evaluate_diagnosis(
    out: Annotated[Path, typer.Option(help="Folder for evaluation.json and the single rigs; resumed if it exists.")],
    rigs: Annotated[int, typer.Option(help="How many random rigs.")] = 200,
    jobs: Annotated[int, typer.Option(help="Processes.")] = 1,
    json: Json = False,
) -> None:
    """Test the diagnosis blind on random rigs of an independent simulator."""
    from testbed.evaluation.diagnosis_trials import run as run_trials
    from testbed.report.console import print_json, print_table
    from testbed.report.diagnosis_evaluation import table, write_evaluation
    from testbed.report.progress import counting_progress

    with counting_progress(rigs, "rigs") as progress:
        trials = run_trials(out, rigs, jobs, progress)
    result, page = write_evaluation(trials, out)
    if json:
        print_json(result)
    else:
        print_table("Blind test of the diagnosis", *table(result))
        print(page)


@app.command()
def hydraulics(
    out: Annotated[Path, typer.Option(help="Folder for hydraulics.json and hydraulics.csv.")],
    manoeuvres: Annotated[int, typer.Option(min=1, max=1000, help="Random manoeuvres.")] = 30,
    seconds: Annotated[float, typer.Option(min=1.0, help="Simulated seconds for the balances.")] = 600.0,
    json: Json = False,
) -> None:
    """Check the compiled hydraulics: against an independent solver, and its books of oil and energy."""
    from testbed.evaluation.hydraulics_check import Difference, run_check, table
    from testbed.report.console import print_json, print_table
    from testbed.report.progress import counting_progress

    with counting_progress(manoeuvres, "manoeuvres") as progress:
        answer = run_check(out, manoeuvres, seconds, progress)
    if json:
        print_json(answer)
        return
    found = [Difference(**{k: v for k, v in d.items() if k != "holds"}) for d in answer["manoeuvres"]]
    print_table("Force of the kernel less the reference's", *table(found))
    for name in ("balance", "balance_starved", "creep", "creep_tight"):
        print_table(name, ["figure", "value"], [[k, f"{v:.6g}"] for k, v in answer[name].items()])


@app.command("contact-loss")
def contact_loss(
    out: Annotated[Path, typer.Option(help="Folder for contact_loss.json, .html and scenes; goes on where it was.")],
    hours: Annotated[float, typer.Option(help="Hours of drilling without losses; losses are scaled with them.")] = 8.0,
    jobs: Annotated[int, typer.Option(min=1, help="Processes.")] = 1,
    tune: Annotated[bool, typer.Option("--tune", help="Run the tuning scenes and set thresholds.yaml.")] = False,
    json: Json = False,
) -> None:
    """Score the detectors of contact loss on drilling with and without true losses: delay, recall, false alarms."""
    from testbed.evaluation.contact_loss import count_scenes, run
    from testbed.evaluation.contact_loss_summary import table
    from testbed.report.console import print_json, print_table
    from testbed.report.contact_loss_page import write_contact_loss
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


@app.command()
def sweep(
    file: Annotated[str, typer.Argument(metavar="SWEEP", help="Sweep file, or the name of a shipped one.")],
    out: Annotated[Path, typer.Option(help="Folder for the runs and results; goes on where it was.")],
    jobs: Annotated[int, typer.Option(min=1, help="Processes.")] = 1,
    json: Json = False,
) -> None:
    """Run a scenario many times: a grid or list of changes, each with every seed; resumable."""
    from testbed.evaluation.sweep import run_sweep, table
    from testbed.parameters.sweep import load_sweep
    from testbed.report.console import print_json, print_table
    from testbed.report.progress import counting_progress

    loaded, runs = load_sweep(file)
    with counting_progress(len(runs), "runs") as progress:
        results = run_sweep(loaded, runs, out, jobs, progress)
    if json:
        print_json(results)
    else:
        print_table(f"{len(results)} runs", *table(results))
        print(out / "results.csv")


@app.command()
def train(
    task: Annotated[str, typer.Argument(help="stand, climb, drill or force-distribution.")],
    out: Annotated[Path, typer.Option(help="Folder for policy, checkpoints and episodes; goes on where it was.")],
    steps: Annotated[int, typer.Option(help="Steps of the environment in all.")] = 200_000,
    seed: Annotated[int, typer.Option(help="Seed of the first start.")] = 0,
    workers: Annotated[int, typer.Option(help="Processes.")] = 1,
) -> None:
    """Train a policy by reinforcement learning (needs the extra rl)."""
    from testbed.envs.training import train as trained
    from testbed.report.progress import counting_progress

    with counting_progress(steps, task) as progress:
        print(trained(task, out, steps, seed, workers, progress))


@app.command()
def play(
    policy: Annotated[Path, typer.Argument(help="A policy.zip of `testbed train`.")],
    scenario: Annotated[str, typer.Argument(help="Scenario file, or the name of a shipped one.")],
    seed: Annotated[int, typer.Option(help="Seed of the episode.")] = 0,
    gui: Annotated[bool, typer.Option("--gui", help="Show the engine's window.")] = False,
    video: Annotated[Path | None, typer.Option(help="Write a .gif of the episode.")] = None,
    json: Json = False,
) -> None:
    """Let a trained policy act on a scenario for one episode."""
    from testbed.envs.training import play as played
    from testbed.report.console import print_json, print_table

    found = played(policy, scenario, seed, gui, video)
    if json:
        print_json(found)
    else:
        print_table("One episode", ["figure", "value"], [[k, str(v)] for k, v in found.items()])


@app.command()
def paper(
    out: Annotated[Path, typer.Option(help="Folder for paper.html and paper.json.")],
    figures: Annotated[
        list[str] | None, typer.Argument(metavar="[FIGURE]...", help="4 to 12, II to IV; all if none.")
    ] = None,
    json: Json = False,
) -> None:
    """Run the paper's experiments and set its claims beside what is measured."""
    from testbed.evaluation.paper.run import chosen, run_figures
    from testbed.report.console import print_json, print_table
    from testbed.report.paper_page import prepare, rows, write_paper
    from testbed.report.progress import counting_progress

    wanted = chosen(figures or [])
    prepare(out)
    with counting_progress(len(wanted), "figures") as progress:
        experiments = run_figures(wanted, progress)
    claims, page = write_paper(experiments, out)
    if json:
        print_json(claims)
    else:
        print_table("The paper's claims", *rows(experiments))
        print(page)


def main() -> None:
    """Entry point: exit status 0 done, 2 bad input (one line), 1 a fault of ours, 130 interrupted."""
    debug = "--debug" in sys.argv
    arguments = [a for a in sys.argv[1:] if a != "--debug"]
    try:
        status = app(arguments, prog_name="testbed", standalone_mode=False)
    except (KeyboardInterrupt, typer.Abort):
        print("testbed: interrupted", file=sys.stderr)
        status = 130
    except BrokenPipeError:  # the reader of a pipe has seen enough
        sys.stdout = None
        status = 0
    except Exception as error:
        if debug:
            raise
        status = _report(error)
    sys.exit(status if isinstance(status, int) else 0)


def _report(error: Exception) -> int:
    """One line on standard error; returns the exit status."""
    from testbed.errors import InputError, SimulationFault

    if isinstance(error, InputError):
        line, status = str(error), 2
    elif hasattr(error, "format_message"):  # the command line itself could not be read
        line, status = str(error.format_message()), 2
    elif isinstance(error, SimulationFault):
        line, status = str(error), 1
    else:
        line = f"a fault of ours: {type(error).__name__}: {error} (--debug shows where)"
        status = 1
    print("testbed:", " ".join(line.split()), file=sys.stderr)
    return status
