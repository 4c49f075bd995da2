"""Commands about models: what a machine is believed to be, and how that is found."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from testbed.cli.options import Dask, Gui, Json, Seed, Set, Shipped


def machine(
    folder: Annotated[
        str, typer.Argument(help="Folder of a machine, or the name of a shipped one.")
    ],
    draw: Annotated[
        bool, typer.Option("--draw", help="Draw its robot.urdf anew from its numbers.")
    ] = False,
    json: Json = False,
) -> None:
    """Check the folder of a machine of your own: what it weighs, reaches and can lift.

    Draws its URDF where it has none.
    """
    from testbed.report.console import answer
    from testbed.workflows.machines import HEADS, check_machine

    found = check_machine(folder, draw)
    rows = [[name, str(value), unit] for name, (value, unit) in found["figures"].items()]
    answer(json, found, (found["name"], HEADS, rows), found["folder"])


def parameters(json: Json = False) -> None:
    """List every number of the machine."""
    from testbed.machine.build import build_machine
    from testbed.report.console import answer, parameters_shown

    leaves = list(build_machine().leaves())
    tree = {path: vars(quantity) for path, quantity in leaves}
    answer(json, tree, *parameters_shown(leaves))


def effects(json: Json = False) -> None:
    """List every effect that a model may lack: parameters, units, bounds, places, equation and what
    shows it.
    """
    from testbed.report.console import answer
    from testbed.report.effects_list import TABLE_HEADS, table, tree

    answer(json, tree(), ("Effects that a model may lack", TABLE_HEADS, table()))


def calibrate(
    recordings: Annotated[
        list[Path], typer.Argument(metavar="RECORDING...", help="Folders of one rig's recordings.")
    ],
    json: Json = False,
) -> None:
    """Calibrate the pressure sensors: a and b of p = k (a V + b) with their uncertainty."""
    from testbed.estimation.calibration import calibrate as fit
    from testbed.recording.axis import read_recording
    from testbed.report.console import answer, calibration_shown

    result = fit([read_recording(folder) for folder in recordings])
    answer(json, result.tree(), *calibration_shown(result))


def identify(
    rig: Annotated[Path, typer.Argument(metavar="RIG", help="Folder with identify/.")],
    out: Annotated[Path, typer.Option(help="Model file to write.")],
    json: Json = False,
) -> None:
    """Identify friction (5): eight parameters with 90 % intervals, and what the motion cannot
    show.
    """
    from testbed.recording.leg_model import write_model
    from testbed.report.console import answer, identification_shown
    from testbed.workflows.identify import identify as identified
    from testbed.workflows.own_files import check_answer

    check_answer(out)
    result = identified(rig)
    write_model(out, result.model)
    answer(json, result.tree(), *identification_shown(result), f"model in {out}")


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
    set_: Set = None,
    seed: Seed = None,
    json: Json = False,
) -> None:
    """Let the robot calibrate and weigh itself: each foot in the air, the body up, down and to the
    sides, the ropes.

    From that alone: zeros, friction, weight, centre of mass, how the inertial unit is mounted,
    ropes and load pins.
    """
    from testbed.report.console import answer, waiting
    from testbed.workflows import commission as work

    with waiting("commissioning"):
        result = work.commission_any(given, out, set_ or [], seed)
    answer(
        json, result, work.table(result), f"not shown: {len(result['not_shown'])} numbers; {out}"
    )


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
        list[Path] | None,
        typer.Option(help="A further run of the same robot, judged together; may be repeated."),
    ] = None,
    sound: Annotated[
        Path | None,
        typer.Option(help="A run of the same robot from before, when nothing was wrong with it."),
    ] = None,
    moved: Annotated[
        bool, typer.Option("--moved", help="It stood elsewhere in that run, on other ground.")
    ] = False,
    json: Json = False,
) -> None:
    """Say which effect a measured machine has and its model lacks, add it, and report the error
    before and after.

    RIG is one axis' recordings or a run of the whole robot; of a run it says which leg too.
    """
    from testbed.report.console import answer, working
    from testbed.workflows.diagnose import Wanted, diagnose_folder

    with working("diagnosing") as tell:
        wanted = Wanted(model, suggest, tuple(also or ()), sound, moved)
        done = diagnose_folder(rig, out, wanted, tell)
    answer(json, done.tree, (done.title, *done.table), done.page)


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
    from testbed.report.console import answer, working
    from testbed.workflows.loop import SCENARIOS, close_loop, table

    with working("closing the loop") as tell:
        result = close_loop(out, scenario or SCENARIOS, tell)
    answer(json, result, ("The loop on the whole robot", *table(result)), out / "loop.html")


# Commands about learned controllers.


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
    method: Annotated[
        str,
        typer.Option(
            help="ppo: a policy from nothing (needs the extra rl); evolution: a correction of a tuned rule,"
            " in one process, of keep alone."
        ),
    ] = "ppo",
) -> None:
    """Train a policy; Ctrl-C saves, the same command goes on."""
    from testbed.benchmarks.control_tasks.evolution import evolve
    from testbed.envs.training import train as trained
    from testbed.errors import InputError, check_one_of
    from testbed.report.console import counting_progress

    check_one_of(method, ("ppo", "evolution"), "--method", "no such method")
    if method == "evolution" and (workers > 1 or dask is not None):
        refused = "--workers" if dask is None else "--dask"
        raise InputError("is made in one process", field=refused, allowed="--method ppo with it")
    with counting_progress(steps, task) as progress:
        if method == "evolution":
            print(evolve(task, out, steps, seed, progress))
        else:
            print(trained(task, out, steps, seed, workers, progress, dask))


def play(
    policy: Annotated[
        Path,
        typer.Argument(
            help="A policy.npz or policy.zip of `testbed train`: of both only arrays are read, never code."
        ),
    ],
    scenario: Shipped,
    seed: Annotated[int, typer.Option(help="Seed of the episode.")] = 0,
    gui: Gui = False,
    video: Annotated[Path | None, typer.Option(help="Film it: .mp4, .gif or .webp.")] = None,
    json: Json = False,
) -> None:
    """Let a trained policy act on a scenario for one episode."""
    from testbed.envs.policies import play as played
    from testbed.report.console import answer

    found = played(policy, scenario, seed, gui, video)
    answer(
        json, found, ("One episode", ["figure", "value"], [[k, str(v)] for k, v in found.items()])
    )
