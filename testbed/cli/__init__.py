"""The command line: one thin command each; every import that costs time happens inside its
command.
"""

from __future__ import annotations

import sys
from functools import cache
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from testbed.cli.benchmarks import benchmarks
from testbed.cli.export import exports
from testbed.cli.machines import machines
from testbed.cli.options import Dask, Json
from testbed.cli.states import states
from testbed.errors import naming
from testbed.formats.sockets import user_code

if TYPE_CHECKING:
    from testbed.scenario.scenario import Scenario
    from testbed.workflows.live import Live

app = typer.Typer(
    name="testbed",
    help="ROBOCLIMBER testbed: simulate, record, estimate and explain a hydraulic climbing robot.",
    add_completion=False,
    rich_markup_mode=None,
    pretty_exceptions_enable=False,
)


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
    duration: Annotated[
        float | None, typer.Option(help="Simulated seconds instead of the scenario's.")
    ] = None,
    set_: Annotated[
        list[str] | None, typer.Option("--set", help="Change a value: a.b=c. May be repeated.")
    ] = None,
    model: Annotated[
        Path | None, typer.Option(help="Model file that the estimators believe.")
    ] = None,
    gui: Annotated[bool, typer.Option("--gui", help="Show the engine's window.")] = False,
    live: Annotated[
        bool,
        typer.Option(
            "--live", help="Show it in a browser while it happens: pause, push, cut ropes."
        ),
    ] = False,
    json: Json = False,
) -> None:
    """Simulate a scenario, record it and write its report."""
    from contextlib import ExitStack

    from testbed.report.console import print_run, run_progress, run_status, waiting
    from testbed.resources import scenario as scenario_path
    from testbed.scenario.scenario import load_scenario
    from testbed.simulation.run import run_scenario
    from testbed.workflows.drawers import drawers

    loaded = load_scenario(scenario, set_ or [], seed, duration)
    with drawers(loaded.duration_s) as helpers:
        with naming(scenario_path(scenario)), ExitStack() as shown:
            watch = shown.enter_context(_in_the_browser(loaded)) if live else None
            progress = shown.enter_context(run_progress(loaded.duration_s, loaded.name))
            result = run_scenario(loaded, out, model, gui, progress, watch=watch)
        from testbed.workflows.report import write_report

        with waiting("writing the report"):
            report = write_report(result.folder, helpers)
    print_run(result.summary, result.folder, report, json)
    raise typer.Exit(run_status(result.summary))


def _in_the_browser(scenario: Scenario) -> Live:
    """A live page of a run of this scenario, opened where somebody sits before the terminal."""
    from testbed.workflows.live import Live

    page = Live(scenario)
    print(f"live: {page.address}", file=sys.stderr)
    if sys.stdout.isatty():
        import webbrowser

        webbrowser.open(page.address)
    return page


@app.command()
def estimate(
    recording: Annotated[
        Path, typer.Argument(help="Folder of a recording: one leg, or a run of the robot.")
    ],
    out: Annotated[Path, typer.Option(help="Table to write: .parquet or .csv.")],
    model: Annotated[
        Path | None, typer.Option(help="Model file (a robot's recording carries its own).")
    ] = None,
    causal: Annotated[
        bool, typer.Option("--causal", help="Use only what came before each sample.")
    ] = False,
    estimator: Annotated[
        str | None,
        typer.Option(help="Of a robot: an estimator by name, or FILE.py:Class. [own]"),
    ] = None,
    json: Json = False,
) -> None:
    """Write the external force of a recording.

    One leg: a value and the set that friction leaves open. A run of the robot: the same for each
    foot.
    """
    from testbed.report.console import print_json
    from testbed.workflows.estimate import estimate_file

    done = estimate_file(recording, model, out, causal, estimator)
    if json:
        print_json(done)
    else:
        print(f"{done['rows']} rows of {', '.join(done['columns'])}: {done['out']}")


@app.command()
def commission(
    given: Annotated[
        list[str],
        typer.Argument(
            metavar="SCENARIO_OR_RECORDING...",
            help="Scenario of the programme (commissioning_flat), or a recording of it and one of the ropes' "
            "(commissioning_slope).",
        ),
    ],
    out: Annotated[Path, typer.Option(help="Model file to write, for --model.")],
    set_: Annotated[
        list[str] | None, typer.Option("--set", help="Change a value: a.b=c. May be repeated.")
    ] = None,
    seed: Annotated[int | None, typer.Option(help="Seed instead of the scenario's.")] = None,
    json: Json = False,
) -> None:
    """Let the robot calibrate and weigh itself: each foot in the air, the body up, down and to the
    sides, the ropes.

    From that alone: zeros, friction, weight, centre of mass, how the inertial unit is mounted,
    ropes and load pins.
    """
    from testbed.report.console import print_json, print_table, waiting
    from testbed.workflows import commission as work

    with waiting("commissioning"):
        result = work.commission_any(given, out, set_ or [], seed)
    if json:
        print_json(result)
        return
    print_table(*work.table(result))
    print(f"not shown: {len(result['not_shown'])} numbers; {out}")


@app.command()
def detect(
    recording: Annotated[
        Path, typer.Argument(help="Folder of a recording: a foot, one leg, or a run of the robot.")
    ],
    out: Annotated[Path, typer.Option(help="Table to write: .parquet or .csv.")],
    detector: Annotated[
        str | None,
        typer.Option(
            help="A detector by name, or FILE.py:Class. [robot: learned; else single_force]"
        ),
    ] = None,
    force: Annotated[
        str | None,
        typer.Option(help="Column with the force, N; of a robot also the part before _<leg>."),
    ] = None,
    reference: Annotated[
        str | None,
        typer.Option(help="Column to score against: a measured force, N, or a contact."),
    ] = None,
    scale: Annotated[
        str | None,
        typer.Option(
            help="Nominal load of a foot, N [declared, else estimated]; or N,SHARE,SECONDS: a foot that bears less "
            "than this share of it, for so long at least, has lost its contact. [N,0.03,0.02]"
        ),
    ] = None,
    model: Annotated[
        Path | None, typer.Option(help="Model file that the force is estimated with.")
    ] = None,
    json: Json = False,
) -> None:
    """Say of every foot of a recording when it was in contact, and how well that follows a
    reference.

    Any scale: bounds are shares of the nominal load and multiples of the noise.
    """
    from testbed.report.console import print_json, print_table
    from testbed.workflows.detect import Options, detect_file, scale_options, table

    options = Options(detector, force, reference, model, **scale_options(scale))
    done = detect_file(recording, out, options)
    if json:
        print_json(done)
    else:
        print_table(*table(done))
        print(done["out"])


@app.command("scenario-schema")
def scenario_schema(json: Json = False) -> None:
    """List every field of a scenario file."""
    from testbed.formats.schema import HEADS, rows
    from testbed.report.console import print_json, print_table
    from testbed.scenario.scenario import Scenario

    if json:
        print_json(Scenario.model_json_schema())
    else:
        print_table("Fields of a scenario file", HEADS, [list(r) for r in rows(Scenario)])


@app.command()
def check(
    recording: Annotated[Path, typer.Argument(help="Folder of a recording of any rig.")],
    json: Json = False,
) -> None:
    """Say what is wrong with a recording, or that nothing is.

    Clock, sensors, and signs and scales against the machine's laws. Exit status 2 where it cannot
    be used.
    """
    from testbed.recording.checker.check import check_recording
    from testbed.report.console import print_checked

    found = check_recording(recording)
    print_checked(found, json)
    if not found.usable:
        raise typer.Exit(2)


@app.command("import")
def import_(
    file: Annotated[Path, typer.Argument(help="Table: .csv (any separator), .parquet or .mcap.")],
    map_: Annotated[
        Path,
        typer.Option(
            "--map",
            metavar="MAP",
            help="YAML: quantity -> {column, unit, scale, offset}; rig, known.",
        ),
    ],
    out: Annotated[Path, typer.Option(help="Folder for the recording.")],
    json: Json = False,
) -> None:
    """Make a recording from another tool's table, and say what is wrong with it."""
    from testbed.recording.importer.importer import import_file
    from testbed.report.console import print_checked

    print_checked(import_file(file, map_, out), json)


@app.command("recording-schema")
def recording_schema(json: Json = False) -> None:
    """List every field of a recording.yaml and every quantity of its channels, for every kind of
    rig.
    """
    from testbed.recording.schema import TABLE_HEADS, table, tree
    from testbed.report.console import print_json, print_table

    if json:
        print_json(tree())
    else:
        print_table("Fields of a recording", TABLE_HEADS, table())


@app.command("effects")
def list_effects(json: Json = False) -> None:
    """List every effect that a model may lack: parameters, units, bounds, places, equation and what
    shows it.
    """
    from testbed.report.console import print_json, print_table
    from testbed.report.effects_list import TABLE_HEADS, table, tree

    if json:
        print_json(tree())
    else:
        print_table("Effects that a model may lack", TABLE_HEADS, table())


@app.command()
def parameters(json: Json = False) -> None:
    """List every number of the machine."""
    from testbed.machine.build import build_machine
    from testbed.report.console import print_json, print_parameters

    leaves = list(build_machine().leaves())
    if json:
        print_json({path: vars(quantity) for path, quantity in leaves})
    else:
        print_parameters(leaves)


@app.command()
def view(
    folders: Annotated[
        list[Path], typer.Argument(metavar="RUN...", help="Folder of a run, or of two to compare.")
    ],
    out: Annotated[
        Path | None, typer.Option(help="Page that compares two runs. [comparison.html]")
    ] = None,
    open_: Annotated[
        bool, typer.Option("--open/--no-open", help="Open it in a browser, or in the viewer.")
    ] = True,
    scene: Annotated[
        bool,
        typer.Option(
            "--scene", help="The run in three dimensions instead: scene.rrd (needs the extra view)."
        ),
    ] = False,
    video: Annotated[
        Path | None,
        typer.Option(help="Film the run instead: .mp4 (needs the extra video), .gif or .webp."),
    ] = None,
) -> None:
    """Open a run's report, the run in three dimensions, a film of it, or a page that compares two
    runs.

    A killed run gets its report now. Prints where the file is.
    """
    from testbed.errors import InputError

    shown = open_ and sys.stdout.isatty()
    if len(folders) == 1 and out is not None:
        raise InputError(
            "would have no effect", field="--out", value=out, allowed="it with two runs"
        )
    if (scene or video) and len(folders) > 1:
        field = "--scene" if scene else "--video"
        raise InputError("shows one run", field=field, value=len(folders), allowed="1 RUN")
    if video is not None:
        from testbed.report.progress import working
        from testbed.workflows.film import film

        with working("filming") as tell:
            print(film(folders[0], video, tell))
        return
    if scene:
        from testbed.report.scene3d import show, write_scene

        made = write_scene(folders[0])
        print(made)
        if shown:
            show(made)
        return
    from testbed.workflows.report import write_comparison, write_report

    report = folders[0] / "report.html"
    if len(folders) > 1:
        report = write_comparison(folders, out or Path("comparison.html"))
    elif not report.is_file():
        report = write_report(folders[0])
    print(report)
    if shown:
        import webbrowser

        webbrowser.open(report.resolve().as_uri())


@app.command()
def calibrate(
    recordings: Annotated[
        list[Path], typer.Argument(metavar="RECORDING...", help="Folders of one rig's recordings.")
    ],
    json: Json = False,
) -> None:
    """Calibrate the pressure sensors: a and b of p = k (a V + b) with their uncertainty."""
    from testbed.estimation.calibration import calibrate as fit
    from testbed.recording.axis import read_recording
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
    """Identify friction (5): eight parameters with 90 % intervals, and what the motion cannot
    show.
    """
    from testbed.formats.files import check_file
    from testbed.recording.leg_model import write_model
    from testbed.report.console import print_identification, print_json
    from testbed.workflows.identify import identify as identified

    check_file(out)
    result = identified(rig)
    write_model(out, result.model)
    if json:
        print_json(result.tree())
    else:
        print_identification(result, out)


@app.command()
def diagnose(
    rig: Annotated[
        Path,
        typer.Argument(metavar="RIG", help="Folder with identify/ and verify/, or a robot's run."),
    ],
    out: Annotated[
        Path, typer.Option(help="Folder for findings.json, three model files and report.html.")
    ],
    model: Annotated[
        Path | None, typer.Option(help="Model to start from: what does it still lack?")
    ] = None,
    suggest: Annotated[
        Path | None,
        typer.Option(
            help="Write a motion that parts ambiguous effects: .csv of an axis, .yaml of a robot."
        ),
    ] = None,
    also: Annotated[
        Path | None, typer.Option(help="A second run of the same robot, judged together.")
    ] = None,
    json: Json = False,
) -> None:
    """Say which effect a measured machine has and its model lacks, add it, and report the error
    before and after.

    RIG is one axis' recordings or a run of the whole robot; of a run it says which leg too.
    """
    from testbed.report.console import print_json, print_table
    from testbed.report.progress import working
    from testbed.workflows.diagnose import Wanted, diagnose_folder

    with working("diagnosing") as tell:
        done = diagnose_folder(rig, out, Wanted(model, suggest, also), tell)
    if json:
        print_json(done.tree)
    else:
        print_table(done.title, *done.table)
        print(done.page)


@app.command()
def loop(
    out: Annotated[
        Path,
        typer.Option(help="Folder for the runs, loop.json and loop.html; resumed if it exists."),
    ],
    scenario: Annotated[
        list[str] | None, typer.Option(help="A scenario; may be repeated. [stand_undeclared_two]")
    ] = None,
    json: Json = False,
) -> None:
    """Close the loop on the whole robot: run, diagnose, believe what was found, compare on another
    scenario.
    """
    from testbed.report.console import print_json, print_table
    from testbed.report.progress import working
    from testbed.workflows.loop import SCENARIOS, close_loop, table

    with working("closing the loop") as tell:
        result = close_loop(out, scenario or SCENARIOS, tell)
    if json:
        print_json(result)
    else:
        print_table("The loop on the whole robot", *table(result))
        print(out / "loop.html")


@app.command()
def sweep(
    file: Annotated[
        str,
        typer.Argument(
            metavar="SWEEP",
            help="Sweep file, or the name of a shipped one; with --vary a scenario.",
        ),
    ],
    out: Annotated[
        Path, typer.Option(help="Folder for the runs and results; goes on where it was.")
    ],
    jobs: Annotated[int, typer.Option(min=1, help="Processes.")] = 1,
    vary: Annotated[
        list[str] | None,
        typer.Option(
            help="Of a scenario: path=1,2,3 (grid) or path=low:high:samples (Latin hypercube)."
        ),
    ] = None,
    dask: Dask = None,
    shard: Annotated[
        str | None, typer.Option(metavar="I/N", help="Make the i-th of n parts only.")
    ] = None,
    merge: Annotated[
        list[Path] | None,
        typer.Option(help="Make no run: gather those of other folders. May be repeated."),
    ] = None,
    json: Json = False,
) -> None:
    """Run a scenario many times: grids, lists and Latin hypercubes of changes, each with every
    seed; resumable.
    """
    from testbed.formats.files import write_text
    from testbed.report.console import print_json, print_table
    from testbed.report.progress import counting_progress
    from testbed.report.sweep_page import page
    from testbed.scenario.sweep import load_sweep, sweep_of
    from testbed.simulation.sweep import Share, merge_sweeps, run_sweep, table
    from testbed.simulation.workers import Workers

    share, workers = Share.of(shard), Workers(jobs, dask) if dask else Workers.told(jobs)
    loaded, runs = sweep_of(file, vary) if vary else load_sweep(file)
    if merge:
        results = merge_sweeps(runs, merge, out)
    else:
        with counting_progress(len(runs), "runs") as progress:
            results = run_sweep(loaded, runs, out, workers, share, progress)
    write_text(out / "sweep.html", page(loaded.description or file, results, len(runs)))
    if json:
        print_json(results)
    else:
        print_table(f"{len(results)} of {len(runs)} runs", *table(results))
        print(out / "sweep.html")


@app.command()
def train(
    task: Annotated[
        str, typer.Argument(help="An environment's name: stand, climb, drill-hole, keep, ...")
    ],
    out: Annotated[
        Path,
        typer.Option(help="Folder for policy, checkpoints and episodes; goes on where it was."),
    ],
    steps: Annotated[int, typer.Option(min=1, help="Steps of the environment in all.")] = 200_000,
    seed: Annotated[
        int | None,
        typer.Option(min=0, help="Seed of a new training; one that goes on keeps its own. [0]"),
    ] = None,
    workers: Annotated[int, typer.Option(min=1, help="Processes, or environments.")] = 1,
    dask: Dask = None,
) -> None:
    """Train a policy by reinforcement learning (needs the extra rl); Ctrl-C saves, the same command
    goes on.
    """
    from testbed.envs.training import train as trained
    from testbed.report.progress import counting_progress

    with counting_progress(steps, task) as progress:
        print(trained(task, out, steps, seed, workers, progress, dask))


@app.command()
def play(
    policy: Annotated[
        Path,
        typer.Argument(
            help="A policy.npz or policy.zip of `testbed train`: of both only arrays are read, never code."
        ),
    ],
    scenario: Annotated[str, typer.Argument(help="Scenario file, or the name of a shipped one.")],
    seed: Annotated[int, typer.Option(help="Seed of the episode.")] = 0,
    gui: Annotated[bool, typer.Option("--gui", help="Show the engine's window.")] = False,
    video: Annotated[Path | None, typer.Option(help="Film it: .mp4, .gif or .webp.")] = None,
    json: Json = False,
) -> None:
    """Let a trained policy act on a scenario for one episode."""
    from testbed.envs.playing import play as played
    from testbed.report.console import print_json, print_table

    found = played(policy, scenario, seed, gui, video)
    if json:
        print_json(found)
    else:
        print_table("One episode", ["figure", "value"], [[k, str(v)] for k, v in found.items()])


app.add_typer(benchmarks)
app.add_typer(states)
app.add_typer(exports)
app.add_typer(machines)


@cache
def _command() -> Any:
    """All commands, read once from the functions' signatures."""
    return typer.main.get_command(app)


def main() -> None:
    """Entry point: exit status 0 done, 3 done but an `expect` was not met, 2 bad input, 1 a fault
    of ours, 130 interrupted.
    """
    debug = "--debug" in sys.argv
    arguments = [a for a in sys.argv[1:] if a != "--debug"] or ["--help"]
    try:
        with user_code():
            status = _command()(arguments, prog_name="testbed", standalone_mode=False)
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
    from testbed.errors import InputError, SimulationFault, unwritten

    error = unwritten(error) or error
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
