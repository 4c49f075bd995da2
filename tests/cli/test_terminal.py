"""No word of a file commands the terminal on which it is shown: control sequences, and signs that
turn the direction of reading, are spelt out.
"""

from __future__ import annotations

import json
import subprocess
import sys
from pathlib import Path

import pytest

from testbed.cli import main
from testbed.errors import printable
from testbed.report.console import answer

HOSTILE = ("\x1b[31mred", "\x1b]0;title\x07", "\x9b2J", "safe\u202efdp.exe", "back\rover", "\x7f")


def _commands(text: str) -> list[str]:
    return [one for one in text if not one.isprintable() and one not in "\n\t"]


@pytest.mark.parametrize("word", HOSTILE)
def test_printable_spells_out_what_commands_a_terminal(word: str) -> None:
    shown = printable(f"{word}\tand\nmore")
    assert _commands(f"{word}") and not _commands(shown)
    assert shown.endswith("\tand\nmore")


def test_printable_leaves_words_of_any_language_alone() -> None:
    assert printable("Böschung 85° – 斜面") == "Böschung 85° – 斜面"


def test_a_key_that_commands_the_terminal_is_refused_in_plain_letters(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    file = tmp_path / "hostile.yaml"
    file.write_text('"\\e[31mkey": 1\n')
    monkeypatch.setattr("sys.argv", ["testbed", "run", str(file)])
    with pytest.raises(SystemExit) as ended:
        main()
    said = capsys.readouterr().err
    assert ended.value.code == 2
    assert "\\x1b[31mkey" in said and not _commands(said)


@pytest.mark.parametrize("word", HOSTILE)
def test_answers_hold_no_commands_and_json_keeps_the_word(
    word: str, capsys: pytest.CaptureFixture[str]
) -> None:
    answer(False, {}, ("a title", ["head"], [[word]]), word)
    assert not _commands(capsys.readouterr().out)
    answer(True, {"word": word})
    text = capsys.readouterr().out
    assert not _commands(text) and json.loads(text) == {"word": word}


@pytest.mark.parametrize("closed", ["1>&-", "2>&-", "1>&- 2>&-"])
def test_closed_outputs_take_what_is_said_to_nowhere(closed: str) -> None:
    command = f"{sys.executable} -m testbed parameters --json {closed}"
    done = subprocess.run(["bash", "-c", command], stdout=subprocess.PIPE, check=False)
    assert done.returncode == 0
    assert bool(done.stdout) == ("1>&-" not in closed)
