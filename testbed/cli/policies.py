"""Commands about learned controllers."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from testbed.cli.options import Dask, Gui, Json, Shipped


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
    from testbed.report.console import counting_progress

    with counting_progress(steps, task) as progress:
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
    from testbed.envs.playing import play as played
    from testbed.report.console import answer

    found = played(policy, scenario, seed, gui, video)
    answer(
        json, found, ("One episode", ["figure", "value"], [[k, str(v)] for k, v in found.items()])
    )
