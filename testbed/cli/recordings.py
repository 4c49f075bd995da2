"""Commands about recordings of any rig: taken in, checked, estimated from, judged."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from testbed.cli.options import Json, Table


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


def recording_schema(json: Json = False) -> None:
    """List every field of a recording.yaml and every quantity of its channels, for every kind of
    rig.
    """
    from testbed.recording.schema import TABLE_HEADS, table, tree
    from testbed.report.console import answer

    answer(json, tree(), ("Fields of a recording", TABLE_HEADS, table()))


def estimate(
    recording: Annotated[
        Path, typer.Argument(help="Folder of a recording: one leg, or a run of the robot.")
    ],
    out: Table,
    model: Annotated[
        Path | None, typer.Option(help="Model file (a robot's recording carries its own).")
    ] = None,
    causal: Annotated[
        bool, typer.Option("--causal", help="Use only what came before each sample.")
    ] = False,
    estimator: Annotated[
        str | None, typer.Option(help="Of a robot: an estimator by name, or FILE.py:Class. [own]")
    ] = None,
    json: Json = False,
) -> None:
    """Write the external force of a recording.

    One leg: a value and the set that friction leaves open. A run of the robot: the same for each
    foot.
    """
    from testbed.report.console import answer
    from testbed.workflows.estimate import estimate_file

    done = estimate_file(recording, model, out, causal, estimator)
    said = f"{done['rows']} rows of {', '.join(done['columns'])}: {done['out']}"
    answer(json, done, "\n".join(filter(None, (said, done["note"]))))


def detect(
    recording: Annotated[
        Path, typer.Argument(help="Folder of a recording: a foot, one leg, or a run of the robot.")
    ],
    out: Table,
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
        str | None, typer.Option(help="Column to score against: a measured force, N, or a contact.")
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
    from testbed.report.console import answer
    from testbed.workflows.detect import Options, detect_file, scale_options, table

    options = Options(detector, force, reference, model, **scale_options(scale))
    done = detect_file(recording, out, options)
    answer(json, done, table(done), done["out"])
