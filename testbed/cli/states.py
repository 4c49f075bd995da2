"""Commands about saved states: simulate up to an instant and save it, go on from one."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from testbed.cli.options import Json

states = typer.Typer()
Set = Annotated[
    list[str] | None, typer.Option("--set", help="Change a value: a.b=c. May be repeated.")
]
Model = Annotated[Path | None, typer.Option(help="Model file that the estimators believe.")]


@states.command()
def save(
    scenario: Annotated[str, typer.Argument(help="Scenario file, or the name of a shipped one.")],
    at: Annotated[float, typer.Option(help="Simulated time of the state, s.")],
    out: Annotated[Path, typer.Option(help="File of the state: .npz.")],
    seed: Annotated[int | None, typer.Option(help="Seed instead of the scenario's.")] = None,
    set_: Set = None,
    model: Model = None,
) -> None:
    """Simulate a scenario up to an instant and save everything that goes on from there, to the last
    bit.
    """
    from testbed.formats.files import check_file
    from testbed.report.console import waiting
    from testbed.scenario.scenario import load_scenario
    from testbed.simulation.live_run import simulate

    check_file(out, (".npz",))
    loaded = load_scenario(scenario, set_ or [], seed)
    with waiting(f"simulating {at:g} s"), simulate(loaded, model=model) as run:
        run.step(round(at / run.dt_s))
        print(f"{run.t_s:g} s: {run.save().write(out)}")


@states.command()
def resume(
    state: Annotated[Path, typer.Argument(help="A saved state: .npz.")],
    out: Annotated[Path | None, typer.Option(help="Output folder. [runs/<name>-<seed>]")] = None,
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
    told = dict(found.scenario) | ({} if duration is None else {"duration_s": duration})
    scenario = checked(Scenario, told, state)
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
