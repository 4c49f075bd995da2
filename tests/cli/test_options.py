"""Options that commands share, and how an answer is shown."""

from __future__ import annotations

import inspect
import json
from typing import Any

import pytest
import typer
from typer.testing import CliRunner

from testbed.cli import COMMANDS, LAB, app
from testbed.cli.options import Changes, Shipped, spread
from testbed.report.console import answer


def told(*arguments: str) -> tuple[str, Changes, bool]:
    """What a command with changes is called with."""
    seen: list[Any] = []

    @spread
    def command(scenario: Shipped, changes: Changes, quick: bool = False) -> None:
        seen.append((scenario, changes, quick))

    program = typer.Typer()
    program.command()(command)
    done = CliRunner().invoke(program, arguments)
    assert done.exit_code == 0, done.output
    return tuple(seen[0])


def test_every_change_of_a_scenario_is_an_option_of_its_own() -> None:
    assert told("stand_flat") == ("stand_flat", Changes(), False)
    found = told(
        "x", "--set", "a.b=1", "--seed", "7", "--set", "c=2", "--duration", "1.5", "--quick"
    )
    assert found == ("x", Changes(["a.b=1", "c=2"], 7, 1.5), True)


def test_changes_are_those_of_the_scenario_that_is_loaded() -> None:
    scenario = Changes(["terrain.slope_deg=12"], 5, 0.25).of("stand_flat")
    assert (scenario.terrain.slope_deg, scenario.seed, scenario.duration_s) == (12, 5, 0.25)


def test_a_command_stands_once_in_the_table_and_is_called_as_its_function() -> None:
    table = COMMANDS | LAB
    assert len(set(table.values())) == len(table) == len(COMMANDS) + len(LAB)
    for name, function in table.items():
        words = function.__name__.strip("_").replace("_", "-")
        assert words == name, f"{function} is not where its name says"
        assert inspect.getdoc(function)
    program: Any = typer.main.get_command(app)
    assert set(program.commands) == {*COMMANDS, "lab"}
    assert set(program.commands["lab"].commands) == set(LAB)


@pytest.mark.parametrize("as_json", [True, False])
def test_an_answer_is_json_or_all_its_tables_and_lines(
    as_json: bool, capsys: pytest.CaptureFixture[str]
) -> None:
    tree = {"a": 1, "b": [2.5, None]}
    answer(as_json, tree, ("Title", ("name", "value"), [["a", "1"]]), "the end")
    said = capsys.readouterr().out
    if as_json:
        assert json.loads(said) == tree
    else:
        assert said == "name\tvalue\na\t1\nthe end\n"
