"""Pages of the site that are made from the code: formats, commands, effects, words; equations as
MathML.

MkDocs calls `on_files`, `on_page_markdown` and `on_page_content`. Nothing here needs a network, nor
does the site.
"""

from __future__ import annotations

import io
import re
from collections.abc import Callable, Iterable, Iterator, Sequence
from itertools import groupby
from pathlib import Path
from typing import Any

ROOT = Path(__file__).parents[1]
Maker = Callable[[], str]
MOST_NAMES = 4


def cell(text: Any) -> str:
    """Text as a cell of a Markdown table."""
    return str(text).replace("|", "\\|").replace("<", "&lt;").replace("\n", " ") or " "


def table(heads: Sequence[str], rows: Iterable[Sequence[Any]], code: Sequence[int] = (0,)) -> str:
    """A Markdown table; columns of `code` are set as code."""
    lines = ["| " + " | ".join(heads) + " |", "|" + "---|" * len(heads)]
    for row in rows:
        cells = [
            f"`{text}`" if k in code and str(text) else cell(text) for k, text in enumerate(row)
        ]
        lines.append("| " + " | ".join(cells) + " |")
    return "\n".join(lines) + "\n"


# ---- formats -------------------------------------------------------------------------------------


def scenario_page() -> str:
    """Every field of a scenario, section by section."""
    from testbed.scenario.scenario import Scenario

    return _sections(
        "Scenario",
        "A YAML file, `roboclimber-scenario/1`; `testbed scenario-schema` prints the same. Every field has a default but "
        "`format`; relative file names count from the scenario's folder. What is accepted has an effect, anything else is "
        "refused with one line. `testbed run NAME --set a.b=c` changes a field.",
        Scenario,
        "```yaml\nformat: roboclimber-scenario/1\nterrain: {slope_deg: 45, friction: 0.6}\ntask: {kind: crawl, steps: 4}\n"
        "events: [{kind: cut_rope, at_s: 30, rope: left}]\nexpect: {verdict: stood}\n```",
    )


def sweep_page() -> str:
    """Every field of a sweep."""
    from testbed.scenario.sweep import Sweep

    text = (
        "A YAML file, `roboclimber-sweep/1`: one scenario, many changes of it, each with every seed. "
        "See [sweeps](../guides/sweeps.md)."
    )
    return _sections("Sweep", text, Sweep, "")


def _sections(title: str, text: str, model: Any, example: str) -> str:
    """A page of all fields of a checked model, one table for each first part of the path."""
    from testbed.formats.schema import HEADS, rows

    groups: dict[str, list[Sequence[str]]] = {}
    for row in rows(model):
        first = re.split(r"[. \[]", row.path, maxsplit=1)[0]
        groups.setdefault(first if first != row.path else "top level", []).append(row)
    parts = [f"# {title}\n", text, "", example]
    for name, fields in groups.items():
        parts += [f"\n## {name}\n", table(HEADS, fields)]
    return "\n".join(parts)


def recording_page() -> str:
    """Every field of a recording.yaml and every quantity, by kind of rig."""
    from testbed.formats.schema import HEADS
    from testbed.recording.schema import tree

    parts = [
        "# Recording and rig\n",
        "A folder with `recording.yaml` beside `data.parquet` (or `data.csv`). `testbed recording-schema` prints the same; "
        "`testbed check FOLDER` says what is wrong with one; `testbed import` makes one from CSV, Parquet or MCAP.\n",
        "A **rig** is a folder `RIG/identify/<name>/` for fitting and choosing and `RIG/verify/<name>/` for judging: other "
        "motions, other loads, other oil temperatures. Nothing is fitted or chosen on `verify`.\n",
    ]
    for rig, found in tree().items():
        fields = [
            [row[head] for head in ("path", "default", "allowed", "meaning")]
            for row in found["fields"]
        ]
        quantities = [
            [q["quantity"], ", ".join(q["units"]), "yes" if q["needed"] else "", q["meaning"]]
            for q in found["quantities"]
        ]
        parts += [
            f"\n## rig: {rig}\n",
            table(HEADS, fields),
            "\nQuantities under `channels`:\n",
            table(("quantity", "units", "needed", "meaning"), quantities),
        ]
    return "\n".join(parts)


def series_page() -> str:
    """Every column of data.parquet and truth.parquet."""
    from testbed.recording.rows import DataRow, TruthRow

    parts = [
        "# Series of a run\n",
        "Columns of `data.parquet` (what the machine's electronics know) and `truth.parquet` (what only a simulator knows). "
        "Of many neighbours of one meaning the first and the last are named.\n",
    ]
    for title, row in (("data.parquet", DataRow), ("truth.parquet", TruthRow)):
        parts += [f"\n## {title}\n", table(("column", "unit", "meaning"), _columns(row))]
    return "\n".join(parts)


def _columns(row: Any) -> Iterator[tuple[str, str, str]]:
    """(names, unit, meaning): neighbours of one meaning stand in one line."""
    for (unit, meaning), group in groupby(row.columns(), key=lambda c: (c.unit, c.meaning)):
        names = [column.name for column in group]
        many = len(names) > MOST_NAMES
        yield (f"{names[0]}` … `{names[-1]}" if many else "` `".join(names)), unit, meaning


def model_page() -> str:
    """Every field of both kinds of model file."""
    from testbed.formats.schema import HEADS, rows
    from testbed.recording.leg_model import LegModel
    from testbed.recording.robot_model import RobotModelFile

    return "\n".join(
        [
            "# Model\n",
            "A YAML file, `roboclimber-model/1`: the published model with its numbers, plus named effects. `identify`, "
            "`diagnose` and `commission` write one; `--model` takes it everywhere.\n",
            "\n## One leg, a cylinder or a drive\n",
            table(HEADS, rows(LegModel)),
            "\n## The whole robot (`rig: robot`)\n",
            table(HEADS, rows(RobotModelFile)),
            "\nParameters of the effects: [effects](../reference/effects.md). Numbers of the machine: [machine](machine.md).\n",
        ]
    )


def machine_page() -> str:
    """Every number of the machine with unit, mark and source."""
    from testbed.machine.build import build_machine
    from testbed.machine.provenance import MARKS

    def shown(value: Any) -> str:
        if isinstance(value, (tuple, list)):
            return ", ".join(map(shown, value))
        return f"{value:.6g}" if isinstance(value, float) else str(value)

    rows = [
        (path, shown(q.value), q.unit, q.mark, q.source) for path, q in build_machine().leaves()
    ]
    marks = table(("mark", "meaning"), MARKS.items())
    return (
        "# Machine\n\nEvery number of the shipped machine, as `testbed parameters` prints it. A scenario changes one under "
        "`hydraulics.parameters`, a model under `model.parameters`.\n\n"
        + marks
        + "\n"
        + table(("number", "value", "unit", "mark", "source"), rows)
    )


def command_page() -> str:
    """Every command with its arguments and options, read off the program itself."""
    import typer

    from testbed.cli import app
    from testbed.cli.examples import EXAMPLES

    parts = [
        "# Commands\n",
        "Exit status: 0 done, 1 a fault of ours, 2 bad input (one line that names file, field, value and what is allowed), "
        "3 a run did what it was told and an `expect` was not met, 130 interrupted. `--debug` before a command shows the "
        "traceback of a fault.\n",
    ]

    def describe(command: Any, name: str) -> None:
        commands = getattr(command, "commands", None)
        if commands:
            for key in commands:
                describe(commands[key], f"{name} {key}")
            return
        arguments = [p for p in command.params if p.param_type_name == "argument"]
        options = [p for p in command.params if p.param_type_name == "option" and p.name != "help"]
        usage = " ".join([name, *(p.metavar or str(p.name).upper() for p in arguments)])
        parts.append(
            f"\n## {name}\n\n```sh\n{usage}{' [OPTIONS]' if options else ''}\n"
            f"testbed {EXAMPLES[str(command.name)]}  # an example\n```\n\n{command.help or ''}\n"
        )
        rows = [
            (p.metavar or str(p.name).upper(), getattr(p, "help", "") or "", "") for p in arguments
        ]
        rows += [
            (", ".join([*p.opts, *p.secondary_opts]), p.help or "", _default(p)) for p in options
        ]
        if rows:
            parts.append(table(("option", "meaning", "default"), rows))

    describe(typer.main.get_command(app), "testbed")
    return "\n".join(parts)


def _default(option: Any) -> str:
    value = option.default
    return "" if value is None or callable(value) or value is False or value == [] else str(value)


def effect_page() -> str:
    """Every effect with all that it says of itself."""
    from testbed.report.effects_list import tree

    parts = [
        "# Effects\n",
        "What a model may lack, as `testbed effects` prints it. A scenario hides one under `undeclared:`, a diagnosis names "
        "one, a model file knows one.\n",
    ]
    for e in tree():
        bounds = [
            (p["name"], p["unit"], f"{p['bounds'][0]:g} to {p['bounds'][1]:g}", p["text"])
            for p in e["parameters"]
        ]
        known = [who for who, knows in e["known_to"].items() if knows]
        parts += [
            f"\n## {e['name']}\n",
            f"{_sentence(e['text'])}\n",
            f"```text\n{e['equation']}\n```\n",
        ]
        parts.append(table(("parameter", "unit", "bounds", "meaning"), bounds))
        parts.append(
            f"\nPlaces: {_places(e['places'])}. Answered by: {', '.join(known) or 'nobody yet'}."
        )
        if e["rigs"]:
            parts.append(
                f" Shown by recordings of {', '.join(e['rigs'])} with {', '.join(e['needs'])}."
            )
        if e["telling_motion"]:
            parts.append(f" What shows it best: {e['telling_motion']}.")
        if e["alike"]:
            parts.append(
                " Easily taken for "
                + "; ".join(f"`{k}` ({v})" for k, v in e["alike"].items())
                + "."
            )
        parts.append("\n")
    return "\n".join(parts)


def _sentence(text: str) -> str:
    return text[:1].upper() + text[1:] + "."


def _places(places: Sequence[str]) -> str:
    from testbed.machine.names import AXES

    others = [place for place in places if place not in AXES]
    return ", ".join((["any cylinder"] if set(AXES) <= set(places) else []) + others) or "the bench"


def word_page() -> str:
    """The key that every page carries."""
    from testbed.report.page import words

    parts = ["# Words\n", "What they mean, on every page and on the console.\n"]
    groups = (
        ("Machine", words("machine")),
        ("Estimates", words("estimate")),
        ("Contact and stability", words("safety")),
        ("Diagnosis", words("naming", "diagnosis")),
    )
    for title, entries in groups:
        parts += [f"\n## {title}\n", table(("word", "meaning"), entries, code=())]
    return "\n".join(parts)


def api_page() -> str:
    """The front door: every name of `testbed`, from where it is defined."""
    import testbed

    homes = {name: home for home, names in testbed._HOMES.items() for name in names}
    parts = [
        "# Python API\n",
        "`import testbed` gives all of these; each is loaded when it is first asked for.\n",
    ]
    for name in testbed.__all__:
        parts.append(f"\n::: testbed.{homes[name]}.{name}\n")
    return "\n".join(parts)


def _of_the_root(name: str) -> Maker:
    """A file of the repository's root, its links into docs/ set right."""

    def text() -> str:
        found = (ROOT / name).read_text(encoding="utf-8")
        return re.sub(
            r"\]\((?:docs/|(examples|testbed|scenarios)[^)]*)",
            lambda m: "](" if not m[1] else f"](#{m[1]}",
            found,
        )

    return text


PAGES: dict[str, Maker] = {
    "formats/scenario.md": scenario_page,
    "formats/sweep.md": sweep_page,
    "formats/recording.md": recording_page,
    "formats/series.md": series_page,
    "formats/model.md": model_page,
    "formats/machine.md": machine_page,
    "reference/commands.md": command_page,
    "reference/effects.md": effect_page,
    "reference/words.md": word_page,
    "reference/api.md": api_page,
    "contributing.md": _of_the_root("CONTRIBUTING.md"),
    "changelog.md": _of_the_root("CHANGELOG.md"),
}
"""Path in the site -> what writes it."""


# ---- pictures ------------------------------------------------------------------------------------


def friction_picture() -> str:
    """Friction (5) of the shipped vertical cylinder over speed, and the set that is open at rest;
    SVG.
    """
    import numpy as np

    speed = np.linspace(1e-4, 0.08, 300)
    plus = 300.0 * speed / 0.08 + 500.0 + 300.0 * np.exp(-speed / 0.01)

    def draw(axes: Any) -> None:
        axes.plot(1e3 * speed, plus, color="#0072b2")
        axes.plot(-1e3 * speed, -plus, color="#0072b2")
        axes.plot(
            [0, 0], [-800, 800], color="#d55e00", lw=2.5, label="at rest: any force of this set"
        )
        axes.set_xlabel("speed of the piston [mm/s]")
        axes.set_ylabel("friction [N]")
        axes.set_title("(5), numbers for show: Coulomb 500 N, break-away 800 N")
        axes.legend(loc="lower right")

    return _drawn(draw, "friction")


def orifice_picture() -> str:
    """Flow through one valve edge over its pressure difference, at three openings; SVG."""
    import numpy as np

    drop = np.linspace(-90.0, 90.0, 400)

    def draw(axes: Any) -> None:
        for opening, colour in ((0.25, "#56b4e9"), (0.5, "#0072b2"), (1.0, "#1a1a1a")):
            axes.plot(
                drop,
                opening * np.sign(drop) * np.sqrt(np.abs(drop) / 35.0),
                color=colour,
                label=f"opening {opening:g}",
            )
        axes.set_xlabel("pressure difference over the edge [bar]")
        axes.set_ylabel("flow over rated flow [1]")
        axes.set_title("one edge, rated at 35 bar")
        axes.legend(loc="lower right")

    return _drawn(draw, "orifice")


def _drawn(draw: Callable[[Any], None], name: str) -> str:
    """A figure in the report's style as SVG text."""
    import matplotlib
    from matplotlib.figure import Figure

    from testbed.report.style import RC

    with matplotlib.rc_context(RC):
        figure = Figure(figsize=(5.0, 3.0), layout="constrained")
        draw(figure.subplots())
        buffer = io.StringIO()
        figure.savefig(buffer, format="svg", metadata={"Date": None, "Creator": None})
    return buffer.getvalue()


PICTURES: dict[str, Maker] = {
    "pictures/friction.svg": friction_picture,
    "pictures/orifice.svg": orifice_picture,
}


# ---- what MkDocs calls ---------------------------------------------------------------------------


def on_files(files: Any, config: Any) -> Any:
    """Add the pages and pictures that are made."""
    from mkdocs.structure.files import File

    for path, make in (PAGES | PICTURES).items():
        files.append(File.generated(config, path, content=make()))
    return files


def on_page_markdown(markdown: str, **_: Any) -> str:
    """A tutorial's blocks say which file they are: as a title."""
    return re.sub(r"^```(\w+) file=(\S+)$", r'```\1 title="\2"', markdown, flags=re.MULTILINE)


def on_page_content(html: str, **_: Any) -> str:
    """Equations as MathML, which browsers draw by themselves."""
    from html import unescape

    from latex2mathml.converter import convert

    def formula(found: re.Match[str]) -> str:
        text = unescape(found[2])
        block = text.startswith("\\[")
        return convert(text[2:-2].strip(), display="block" if block else "inline")

    return re.sub(r'<(div|span) class="arithmatex">(.*?)</\1>', formula, html, flags=re.DOTALL)
