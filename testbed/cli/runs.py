"""Commands that simulate, and that show what was simulated."""

from __future__ import annotations

import sys
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from testbed.cli.options import Changes, Dask, Gui, Json, Model, Shipped, Work, spread
from testbed.errors import naming

if TYPE_CHECKING:
    from testbed.scenario.scenario import Scenario
    from testbed.workflows.live import Live

Out = Annotated[
    Path | None,
    typer.Option(help="Output folder; an earlier run in it is replaced. [runs/<name>-<seed>]"),
]


@spread
def run(
    scenario: Shipped,
    changes: Changes,
    out: Out = None,
    model: Model = None,
    gui: Gui = False,
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
    from testbed.simulation.run import Recording, run_scenario
    from testbed.workflows.report import drawers

    loaded = changes.of(scenario)
    with drawers(loaded) as helpers:
        with naming(scenario_path(scenario)), ExitStack() as shown:
            watch = shown.enter_context(_in_the_browser(loaded)) if live else None
            progress = shown.enter_context(run_progress(loaded.duration_s, loaded.name))
            recording = Recording(when_recorded=helpers.begin if helpers is not None else None)
            result = run_scenario(
                loaded, out, model, gui, progress, watch=watch, recording=recording
            )
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


@spread
def save(
    scenario: Shipped,
    changes: Changes,
    at: Annotated[float, typer.Option(help="Simulated time of the state, s.")],
    out: Annotated[Path, typer.Option(help="File of the state: .npz.")],
    model: Model = None,
) -> None:
    """Simulate a scenario up to an instant and save everything that goes on from there, to the last
    bit.
    """
    from testbed.errors import InputError
    from testbed.formats.files import check_file
    from testbed.report.console import waiting
    from testbed.simulation.live_run import simulate

    check_file(out, (".npz",))
    loaded = changes.of(scenario)
    if not 0.0 <= at <= loaded.duration_s:
        allowed = f"0 to {loaded.duration_s:g} s, the scenario's duration (--duration)"
        raise InputError("is out of range", field="--at", value=at, allowed=allowed)
    with waiting(f"simulating {at:g} s"), simulate(loaded, model=model) as run:
        run.step(round(at / run.dt_s))
        if round((at - run.t_s) / run.dt_s) > 0:
            verdict = f"{run.summary()['verdict']} at {run.t_s:g} s, and the run has ended"
            raise InputError(verdict, field="--at", value=at, allowed=f"less than {run.t_s:g} s")
        print(f"{run.t_s:g} s: {run.save().write(out)}")


def resume(
    state: Annotated[Path, typer.Argument(help="A saved state: .npz.")],
    out: Out = None,
    duration: Annotated[
        float | None, typer.Option(help="When it ends, s, instead of the scenario's.")
    ] = None,
    happen: Annotated[
        list[str] | None,
        typer.Option(help='Let an event happen now: "{kind: cut_rope, rope: left}".'),
    ] = None,
    model: Model = None,
    json: Json = False,
) -> None:
    """Go on from a saved state, record it and write its report."""
    from testbed.errors import InputError
    from testbed.formats.checked import checked
    from testbed.formats.yaml_files import parse_yaml
    from testbed.report.console import print_run, run_progress, run_status
    from testbed.scenario.scenario import Scenario
    from testbed.simulation.run import Beginning, run_scenario
    from testbed.workflows.report import write_report
    from testbed.world.saved import read_state

    found = read_state(state)
    fields = dict(found.scenario) | ({} if duration is None else {"duration_s": duration})
    scenario = checked(Scenario, fields, state)
    events = [parse_yaml(text, "--happen") for text in happen or []]
    for event in events:
        if not isinstance(event, dict) or "kind" not in event:
            raise InputError(
                "is no event", field="--happen", value=event, allowed="{kind: cut_rope, rope: left}"
            )
    with run_progress(scenario.duration_s, scenario.name) as progress:
        result = run_scenario(
            scenario, out, model, progress=progress, beginning=Beginning(found, events)
        )
    print_run(result.summary, result.folder, write_report(result.folder), json)
    raise typer.Exit(run_status(result.summary))


@spread
def sweep(
    file: Annotated[
        str,
        typer.Argument(
            metavar="SWEEP",
            help="Sweep file, or the name of a shipped one; with --vary a scenario.",
        ),
    ],
    changes: Changes,
    work: Work,
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
) -> None:
    """Run a scenario many times: grids, lists and Latin hypercubes of changes, each with every
    seed; resumable.
    """
    from testbed.formats.files import write_text
    from testbed.report.console import answer, counting_progress
    from testbed.report.sweep_page import page
    from testbed.scenario.sweep import FromOutside, load_sweep, sweep_of
    from testbed.simulation.sweep import Share, merge_sweeps, run_sweep, table
    from testbed.simulation.workers import Workers

    share, workers = (
        Share.of(shard),
        Workers(work.jobs, dask) if dask else Workers.from_environment(work.jobs),
    )
    given = FromOutside(changes.set_ or (), changes.seed, changes.duration)
    loaded, runs = sweep_of(file, vary, given) if vary else load_sweep(file, given)
    out = work.out
    if merge:
        results = merge_sweeps(runs, merge, out)
    else:
        with counting_progress(len(runs), "runs") as progress:
            results = run_sweep(loaded, runs, out, workers, share, progress)
    write_text(out / "sweep.html", page(loaded.description or file, results, len(runs)))
    shown = (f"{len(results)} of {len(runs)} runs", *table(results))
    answer(work.json, results, shown, out / "sweep.html")


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
        from testbed.report.console import working
        from testbed.workflows.export import film

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


def export(
    run: Annotated[Path, typer.Argument(help="Folder of a run.")],
    out: Annotated[Path, typer.Option(help="File: .csv (PlotJuggler) or .mcap (Foxglove).")],
    rate: Annotated[float, typer.Option(help="Rows a second, at most.")] = 100.0,
    json: Json = False,
) -> None:
    """Write a run as CSV for PlotJuggler, or as MCAP that Foxglove opens (extra mcap)."""
    from testbed.report.console import answer, waiting
    from testbed.workflows.export import export_run

    with waiting("writing"):
        done = export_run(run, out, rate)
    answer(json, done, f"{done['rows']} rows: {done['out']}")


def scenario_schema(json: Json = False) -> None:
    """List every field of a scenario file."""
    from testbed.formats.schema import HEADS, rows
    from testbed.report.console import answer
    from testbed.scenario.scenario import Scenario

    answer(
        json,
        Scenario.model_json_schema(),
        ("Fields of a scenario file", HEADS, [list(r) for r in rows(Scenario)]),
    )
