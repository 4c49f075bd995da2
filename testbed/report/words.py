"""What things are called, and what the words mean: one list for console, report and
documentation.
"""

from __future__ import annotations

from functools import cache
from pathlib import Path
from typing import NamedTuple

from testbed.formats.yaml_files import read_mapping

PAPER = (
    "S. Nabulsi, J. F. Sarria, H. Montes, M. A. Armada: High-Resolution Indirect Feet-Ground Interaction "
    "Measurement for Hydraulic-Legged Robots, IEEE Transactions on Instrumentation and Measurement, 2009, "
    "doi:10.1109/TIM.2009.2017650"
)
"""The publication that the testbed is built around."""

METHOD_NAME = {
    "one_chamber": "one chamber (1)",
    "two_chamber": "two chambers (3)",
    "friction": "less friction (7)",
    "kbf": "filtered (6)",
    "modified_kbf": "modified filter (6)",
    "own": "own",
}
"""Name of an estimate in a recording -> what people read."""
LEG_NAME = {"fl": "front left", "fr": "front right", "rl": "rear left", "rr": "rear right"}


class Word(NamedTuple):
    """A word or a few of one kind, and what is meant by it."""

    word: str
    meaning: str


@cache
def words(*topics: str) -> tuple[Word, ...]:
    """The words of these topics of words.yaml, of all for none."""
    given = {"paper": PAPER, **METHOD_NAME}
    by_topic = read_mapping(Path(__file__).with_name("words.yaml"))
    return tuple(
        Word(word.format(**given), meaning.format(**given))
        for topic in topics or by_topic
        for word, meaning in by_topic[topic].items()
    )


def method_name(method: str) -> str:
    """What a person calls an estimate; a user's own keeps its name."""
    return METHOD_NAME.get(method, method.replace("_", " "))
