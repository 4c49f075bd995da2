"""The command line: one table of all commands, a file for each family of them.

Commands are thin, and every import that costs time happens inside its command.
"""

from __future__ import annotations

import atexit
import gc
import os
import signal
import sys
from collections.abc import Callable
from functools import cache
from typing import Annotated, Any

import typer

from testbed.cli import benchmarks, lab, models, recordings, runs
from testbed.cli.examples import epilog
from testbed.cli.listed import CommandList
from testbed.formats.sockets import user_code


def _family(commands: dict[str, Callable[..., None]], **options: Any) -> typer.Typer:
    """Commands by name as one program, or as the part of one."""
    family = typer.Typer(cls=CommandList, **options)
    for name, command in commands.items():
        family.command(name, epilog=epilog(name))(command)
    return family


COMMANDS: dict[str, Callable[..., None]] = {
    "run": runs.run,
    "save": runs.save,
    "resume": runs.resume,
    "sweep": runs.sweep,
    "view": runs.view,
    "export": runs.export,
    "scenario-schema": runs.scenario_schema,
    "check": recordings.check,
    "import": recordings.import_,
    "recording-schema": recordings.recording_schema,
    "estimate": recordings.estimate,
    "detect": recordings.detect,
    "machine": models.machine,
    "parameters": models.parameters,
    "effects": models.effects,
    "calibrate": models.calibrate,
    "identify": models.identify,
    "commission": models.commission,
    "diagnose": models.diagnose,
    "loop": models.loop,
    "train": models.train,
    "play": models.play,
    "bench": benchmarks.bench,
    "identify-measured": benchmarks.identify_measured,
    "filters": benchmarks.filters,
    "estimators": benchmarks.estimators,
    "machines": benchmarks.machines,
    "distribution": benchmarks.distribution,
    "evaluate-diagnosis": benchmarks.evaluate_diagnosis,
    "hydraulics": benchmarks.hydraulics,
    "contact-loss": benchmarks.contact_loss,
    "soak": benchmarks.soak,
    "paper": benchmarks.paper,
}
"""Every command and the function that does it; the help lists them in this order."""
LAB: dict[str, Callable[..., None]] = {
    "climbs": lab.climbs,
    "control-tasks": lab.control_tasks,
    "expected-loads": lab.expected_loads,
    "quiet-stand": lab.quiet_stand,
    "stand-friction": lab.stand_friction,
    "wrong-beliefs": lab.wrong_beliefs,
    "paper-sensitivity": lab.paper_sensitivity,
    "robot-diagnosis": lab.robot_diagnosis,
    "other-laws": lab.other_laws,
    "robot-close": lab.robot_close,
    "plain-effects": lab.plain_effects,
    "bench-diagnosis": lab.bench_diagnosis,
    "kept-back-runs": lab.kept_back_runs,
    "recording-mistakes": lab.recording_mistakes,
    "declared-numbers": lab.declared_numbers,
    "quotes": lab.quotes,
    "warning-numbers": lab.warning_numbers,
    "train-detector": lab.train_detector,
    "fit-diagnosis": lab.fit_diagnosis,
    "fit-bench-diagnosis": lab.fit_bench_diagnosis,
    "fit-robot-diagnosis": lab.fit_robot_diagnosis,
}
"""The commands below `testbed lab`."""

app = _family(
    COMMANDS,
    name="testbed",
    help="ROBOCLIMBER testbed: simulate, record, estimate and explain a hydraulic climbing robot.",
    add_completion=False,
    rich_markup_mode=None,
    pretty_exceptions_enable=False,
)
app.add_typer(_family(LAB, name="lab", help=lab.__doc__))


@app.callback()
def _root(
    debug: Annotated[bool, typer.Option("--debug", help="Show the traceback of a fault.")] = False,
) -> None:
    """ROBOCLIMBER testbed: simulate, record, estimate and explain a hydraulic climbing robot."""


OBJECTS_A_LOOK = 50_000
"""New objects after which Python looks for those that nothing needs any more: with its own 700 a
start spends a tenth of its time on looking through modules that stay.
"""
INTERRUPTED = 130
"""Exit status after Ctrl-C, as shells have it."""


@cache
def _command() -> Any:
    """All commands, read once from the functions' signatures."""
    return typer.main.get_command(app)


def main() -> None:
    """Entry point: exit status 0 done, 3 done but an `expect` was not met, 2 bad input, 1 a fault
    of ours, 130 interrupted.
    """
    debug = "--debug" in sys.argv
    gc.set_threshold(OBJECTS_A_LOOK, 10, 10)
    atexit.register(gc.freeze)  # the system takes all memory back: nobody need look through it
    for stream in ("stdout", "stderr"):  # closed by who called it: what is said goes nowhere
        if getattr(sys, stream) is None:
            setattr(sys, stream, open(os.devnull, "w"))  # noqa: SIM115  (as long as the process)
    os.environ.setdefault("ARROW_DEFAULT_MEMORY_POOL", "system")  # Arrow's own keeps what it took
    arguments = [a for a in sys.argv[1:] if a != "--debug"] or ["--help"]
    try:
        with user_code():
            status = _command()(arguments, prog_name="testbed", standalone_mode=False)
    except (KeyboardInterrupt, typer.Abort) as stop:
        told = stop.args or getattr(stop.__cause__, "args", ())  # typer's own hides what was said
        print("; ".join(["testbed: interrupted", *map(str, told)]), file=sys.stderr)
        status = INTERRUPTED
    except BrokenPipeError:  # the reader of a pipe has seen enough
        sys.stdout = None
        status = 0
    except Exception as error:
        if debug:
            raise
        status = _report(error)
    if status == INTERRUPTED:
        signal.signal(signal.SIGINT, signal.SIG_IGN)  # it ends: a further one is not another fault
    sys.exit(status if isinstance(status, int) else 0)


def _report(error: Exception) -> int:
    """One line on standard error; returns the exit status."""
    from testbed.errors import InputError, SimulationFault, disk_refusal, place_refusal, printable

    error = disk_refusal(error) or place_refusal(error) or error
    if isinstance(error, InputError):
        line, status = str(error), 2
    elif hasattr(error, "format_message"):  # the command line itself could not be read
        line, status = str(error.format_message()), 2
    elif isinstance(error, SimulationFault):
        line, status = str(error), 1
    else:
        line = f"a fault of ours: {type(error).__name__}: {error} (--debug shows where)"
        status = 1
    print("testbed:", printable(" ".join(line.split())), file=sys.stderr)
    return status
