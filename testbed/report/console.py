"""What the command line shows: progress, tables, JSON."""

from __future__ import annotations

import json
import sys
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Any

from testbed.errors import printable
from testbed.report.page import method_name

if TYPE_CHECKING:
    from testbed.estimation.calibration import Calibrated
    from testbed.estimation.friction.identification import Identification
    from testbed.machine.provenance import Quantity
    from testbed.recording.checker.finding import Checked


LEAST_SLIP_M = 1e-3
"""Slips below it are not reported."""
DOUBT_MEANS = "pressures contradict weight, ropes or drill as believed"

SURPRISING = 2.25
"""From this `surprise` on it is reported. On 360 runs of sound drawn machines it is at most 1.9."""


def print_json(value: object) -> None:
    """One JSON value on standard output."""
    from testbed.formats.files import plain

    text = json.dumps(plain(value), indent=2, ensure_ascii=False)
    if text != printable(text):
        text = json.dumps(plain(value), indent=2)
    print(text)


def print_table(title: str, heads: Sequence[str], rows: Iterable[Sequence[str]]) -> None:
    """A table on standard output: aligned for people, tab-separated when piped."""
    if not sys.stdout.isatty():
        for row in [heads, *rows]:
            print(printable("\t".join(row)))
        return
    from rich.console import Console
    from rich.table import Table

    table = Table(title=title, title_justify="left", box=None, pad_edge=False)
    for head in heads:
        table.add_column(head, overflow="fold")
    for row in rows:
        table.add_row(*map(printable, row))
    Console(markup=False, highlight=False).print(table)


def answer(as_json: bool, tree: object, *shown: Any) -> None:
    """What a command found: `tree` as JSON, else all that is `shown`.

    A tuple is a table (title, heads, rows), anything else a line.
    """
    if as_json:
        print_json(tree)
        return
    for part in shown:
        if isinstance(part, tuple):
            print_table(*part)
        else:
            print(printable(str(part)))


def parameters_shown(leaves: Iterable[tuple[str, Quantity]]) -> list[Any]:
    """Every number of the machine, and what its mark means."""
    from testbed.machine.provenance import MARKS

    rows = [
        [path, _number(quantity.value), quantity.unit, quantity.mark, quantity.source]
        for path, quantity in leaves
    ]
    table = ("The machine's numbers", ["parameter", "value", "unit", "mark", "source"], rows)
    if not sys.stdout.isatty():
        return [table]
    return [table, "\nMarks: " + "; ".join(f"{mark} {what}" for mark, what in MARKS.items())]


def _number(value: Any) -> str:
    if isinstance(value, (tuple, list)):
        return ", ".join(_number(part) for part in value)
    return f"{value:.6g}" if isinstance(value, float) else str(value)


@contextmanager
def run_progress(duration_s: float, name: str) -> Iterator[Callable[[float, str], None] | None]:
    """A progress bar over simulated seconds on standard error; None when that is not a terminal."""
    if not sys.stderr.isatty():
        yield None
        return
    from rich.console import Console
    from rich.progress import BarColumn, Progress, TextColumn, TimeRemainingColumn

    columns = (
        TextColumn("{task.description}"),
        BarColumn(),
        TextColumn("{task.completed:.0f} of {task.total:g} s simulated"),
        TimeRemainingColumn(),
        TextColumn("{task.fields[word]}"),
    )
    with Progress(*columns, console=Console(stderr=True), transient=True) as bar:
        task = bar.add_task(name, total=duration_s, word="preparing (the first run compiles)")
        yield lambda now_s, word: bar.update(task, completed=now_s, word=word)


@contextmanager
def waiting(word: str) -> Iterator[None]:
    """A moving sign on standard error while something takes its time; nothing when that is not a
    terminal.
    """
    if not sys.stderr.isatty():
        yield
        return
    from rich.console import Console

    with Console(stderr=True).status(word):
        yield


def summary_rows(summary: Mapping[str, Any]) -> Iterator[tuple[str, str]]:
    """The numbers of a summary that a person wants first: (name, value with unit)."""
    ended = " (interrupted)" if summary.get("interrupted") else ""
    yield "verdict", f"{summary['verdict']}{ended}"
    wall_s = summary["wall_s"]
    taken = "" if wall_s is None else f" in {wall_s:.1f} s"
    yield "simulated", f"{summary['simulated_s']:.1f} s{taken}"
    if "progress" in summary:
        yield "task", _task(summary)
    for method, value in summary.get("force_rms_n", {}).items():
        yield f"force error, {method_name(method)}", _newton(value)
    expected = [error for error in summary.get("expected_rms_n", {}).values() if error is not None]
    if expected:
        yield "expected load error, worst leg", _newton(max(expected))
    doubted_s = summary.get("balance_doubted_s", 0.0)
    if doubted_s > 0.0:
        yield "the body's balance", f"doubted for {doubted_s:.1f} s ({DOUBT_MEANS})"
    surprise = summary.get("surprise", 1.0)
    if surprise >= SURPRISING:
        yield (
            "the machine",
            f"seems {surprise**0.5:.1f} times as far from its belief as its stated uncertainty",
        )
    named = (summary.get("residuals") or {}).get("stands_out")
    if named:
        way = "short of" if named["error_n"] > 0 else "above"
        error = _newton(abs(named["error_n"]))
        yield "stands out", f"{named['leg']}, {error} {way} the expected load"
    if summary.get("detector"):
        yield from _detector_rows(summary["detector"], summary["contact_losses_not_meant"])
    if "lowest_stability_margin" in summary:
        yield from _motion_rows(summary)
    yield from _slip_rows(summary)
    expectations = summary.get("expectations")
    if expectations is not None:
        yield "expectations", "met" if expectations["met"] else "; ".join(expectations["unmet"])


def _detector_rows(detector: Mapping[str, Any], not_meant: int) -> Iterator[tuple[str, str]]:
    yield "contact losses", f"{detector['losses']} ({not_meant} not meant)"
    wrong_s = detector.get("missed_s", 0.0) + detector.get("false_flight_s", 0.0)
    alarms = _count(detector["false_alarms"], "false alarm")
    yield (
        "detector",
        f"{detector['missed']} missed, {alarms}, wrong for {wrong_s:.2f} leg-seconds",
    )
    delay = detector["delay_median_s"]
    if delay is not None:
        yield "detector's delay, median", f"{1000 * delay:.0f} ms"


def _motion_rows(summary: Mapping[str, Any]) -> Iterator[tuple[str, str]]:
    yield "lowest stability margin", f"{summary['lowest_stability_margin']:.3f}"
    if "lowest_wrench_margin_n" in summary:
        yield "smallest push that is too much", _newton(summary["lowest_wrench_margin_n"])
        yield "least work that tips it", _in_thousands(summary["lowest_energy_margin_j"], "J")
    yield "largest tilt", f"{summary['tilt_max_deg']:.2f} deg"
    yield "way up the slope", f"{round(1000 * summary['climbed_m']) + 0:d} mm"
    ropes = summary["rope_tension_max_n"]
    if any(ropes.values()):
        pulls = ", ".join(f"{side} {_newton(rope)}" for side, rope in ropes.items())
        yield "rope tension, highest", pulls


def _slip_rows(summary: Mapping[str, Any]) -> Iterator[tuple[str, str]]:
    """How far feet slid and rope ran through its clamps, where it is a millimetre and more."""
    slips = {"feet slid": "foot_slip_m", "rope that ran through its clamps": "rope_slip_m"}
    for words, key in slips.items():
        slip_m = summary.get(key) or 0.0
        if slip_m >= LEAST_SLIP_M:
            yield words, f"{1000 * slip_m:.0f} mm"


def _count(number: int, noun: str) -> str:
    return f"{number} {noun}" + ("" if number == 1 else "s")


def _newton(value: float | None) -> str:
    return "unknown" if value is None else _in_thousands(value, "N")


def _in_thousands(value: float, unit: str) -> str:
    """A whole number with a space between its thousands."""
    return f"{value:,.0f} {unit}".replace(",", " ")


def run_status(summary: Mapping[str, Any]) -> int:
    """Exit status of a run: 130 stopped from outside, 3 where what its scenario expects was not
    met, 0 else.
    """
    if summary.get("interrupted"):
        return 130
    expectations = summary.get("expectations") or {"met": True}
    return 0 if expectations["met"] else 3


def _task(summary: Mapping[str, Any]) -> str:
    """What became of the task, in words."""
    done = summary["progress"]
    words = [] if done["done"] else ["unfinished"]
    if "parts_wanted" in done:
        words.append(f"{done['parts_done']} of {done['parts_wanted']} parts")
    if "steps_wanted" in done:
        words.append(f"{done['steps_made']} of {done['steps_wanted']} steps")
    if "hole_depth_wanted_m" in done:
        words.append(f"hole {done['hole_depth_m']:.2f} of {done['hole_depth_wanted_m']:.2f} m")
        words.append(f"at its end: {done['phase'].replace('_', ' ')}")
    return f"{summary['task']}: {', '.join(words) or 'done'}"


def print_run(summary: Mapping[str, Any], folder: Path, report: Path, as_json: bool) -> None:
    """The end of a run: the summary as a table (or JSON) and where the report is."""
    if as_json:
        print_json(summary)
        return
    rows = list(summary_rows(summary))
    width = max(len(name) for name, _ in rows)
    lines = [f"{summary['scenario']}, seed {summary['seed']}"]
    lines += [f"  {name:<{width}}  {value}" for name, value in rows]
    if summary.get("interrupted"):
        lines.append(f"Interrupted: what was recorded is readable in {folder}")
    print(printable("\n".join([*lines, f"Report: {report}"])))


def print_checked(result: Checked, as_json: bool) -> None:
    """What is wrong with a recording as a table (or JSON), or one line that nothing is."""
    from testbed.recording.checker.finding import HEADS

    shown: Any = f"{result.recording}: nothing is wrong with it"
    if result.findings:
        shown = f"{result.recording}: findings", HEADS, result.rows()
    answer(as_json, result.tree(), shown)


def calibration_shown(result: Calibrated) -> list[Any]:
    """Every sensor's a and b with one standard deviation, and what the fit rests on."""
    rows = []
    for name, sensor in result.sensors.items():
        a_sd, b_sd = (float(sensor.covariance[place, place]) ** 0.5 for place in (0, 1))
        span = f"{sensor.span_v[0]:.3f} to {sensor.span_v[1]:.3f}"
        rows.append(
            [
                name,
                f"{sensor.a:.5f}",
                f"{a_sd:.5f}",
                f"{sensor.b:.5f}",
                f"{b_sd:.5f}",
                span,
                sensor.warning,
            ]
        )
    heads = ["sensor", "a", "sd of a", "b, V", "sd of b, V", "seen, V", "note"]
    how = (
        "friction fitted"
        if result.friction_fitted
        else "hardly any sliding: friction counts as an error"
    )
    residual = f"residual {result.residual_n:.1f} N over {result.rows} rows"
    return [
        ("Calibration p = k (a V + b)", heads, rows),
        f"{residual}, {result.outliers} outliers left out, {how}",
    ]


def identification_shown(result: Identification) -> list[Any]:
    """The eight parameters with their intervals, and why some are not shown."""
    rows = [
        [
            parameter.name,
            f"{parameter.value:.5g}",
            f"{parameter.interval90[0]:.5g} to {parameter.interval90[1]:.5g}",
            parameter.unit,
            parameter.why,
        ]
        for parameter in result.parameters
    ]
    plus, minus = result.residual_n
    residual = f"residual {plus:.1f} N extending, {minus:.1f} N retracting"
    return [
        (
            "Friction (5)",
            ["parameter", "value", "90 % interval", "unit", "not shown because"],
            rows,
        ),
        *result.used,
        f"{residual}, over {result.rows} rows of {', '.join(result.recordings)}",
    ]


@contextmanager
def counting_progress(total: int, name: str) -> Iterator[Callable[[int], None] | None]:
    """A progress bar over a count on standard error; None when that is not a terminal."""
    if not sys.stderr.isatty():
        yield None
        return
    from rich.console import Console
    from rich.progress import Progress

    with Progress(console=Console(stderr=True), transient=True) as bar:
        task = bar.add_task(name, total=total)
        yield lambda done: bar.update(task, completed=done)


@contextmanager
def working(name: str) -> Iterator[Callable[[str], None]]:
    """A spinner that says what is being done; silent when standard error is not a terminal."""
    if not sys.stderr.isatty():
        yield lambda _: None
        return
    from rich.console import Console

    with Console(stderr=True).status(name) as status:
        yield lambda what: status.update(f"{name}: {what}")
