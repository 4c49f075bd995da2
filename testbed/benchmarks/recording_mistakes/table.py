"""The table of mistakes: what is planted into which recordings, and what a checker should say."""

from __future__ import annotations

import re
from collections.abc import Sequence
from functools import cache
from pathlib import Path
from typing import Annotated, Any, Literal

from testbed.benchmarks.recording_mistakes.planting import BLIND, PLANTERS, Plant
from testbed.benchmarks.recording_mistakes.sample import REFERENCE, Sample
from testbed.errors import check_one_of
from testbed.formats.checked import Checked, checked
from testbed.formats.checked import Sequence as Listed
from testbed.formats.yaml_files import read_mapping
from testbed.recording.checker.finding import Finding

FILE = Path(__file__).with_name("mistakes.yaml")

Outcome = Literal["named", "among others", "otherwise", "missed"]
OUTCOMES: tuple[Outcome, ...] = ("named", "among others", "otherwise", "missed")
"""Right channel and kind; those among several that the finding leaves open; found, but something
else is blamed; no complaint."""
Names = Annotated[tuple[str, ...], Listed]


class Mistake(Checked):
    """One mistake of the table."""

    name: str
    """in words"""
    plant: dict[str, dict[str, Any]]
    """planter -> what it is given"""
    needs: Names = ()
    """quantities that have to be recorded"""
    kinds: Names = ()
    """of rig; empty: all"""
    blames: Names = ()
    """channels one of which has to be named"""
    says: str = ""
    """what has to be said, a regular expression"""
    blind: Names = ()
    """what a recording may lack so that it cannot show the mistake"""
    sound: bool = False
    """nothing is wrong: no complaint, and the same numbers in SI"""

    def planter(self) -> Plant:
        """The change that plants it."""
        ((name, given),) = self.plant.items()
        return PLANTERS[name](**given)

    def applies(self, sample: Sample) -> bool:
        """Whether a recording has what is spoilt."""
        kind = sample.head["rig"]
        declared = self.plant.get("declared", {}).get("number")
        there = declared is None or sample.axis is not None or sample.head["known"].get(declared)
        return bool((not self.kinds or kind in self.kinds) and there and sample.has(*self.needs))

    def hidden_by(self, sample: Sample, spoilt: Sample) -> str | None:
        """What a recording, or it with the mistake, lacks so that it cannot show it; None where it
        can.
        """
        return next((lack for lack in self.blind if BLIND[lack](sample, spoilt)), None)

    def outcome(self, sample: Sample, found: Sequence[Finding]) -> Outcome:
        """What complaints `found` about a sample with this mistake are worth."""
        if not found:
            return "missed"
        here = [_channel(sample, name) for name in self.blames]
        for finding in found:
            first = finding.what.split("(or ")[0].split("; or ")[0]
            blamed = any(name in finding.channel for name in here)
            if blamed and re.search(self.says, f"{first} {finding.advice}"):
                return "named"
        for finding in found:
            text = f"{finding.channel} {finding.what} {finding.advice}"
            if any(name in text for name in here) and re.search(self.says, text):
                return "among others"
        return "otherwise"


def _channel(sample: Sample, name: str) -> str:
    """The channel that findings name for what the table names."""
    if name == "time" or "." in name:
        return name
    found = sample.channel(name) or name
    return REFERENCE if found == REFERENCE else found


@cache
def mistakes() -> dict[str, tuple[Mistake, ...]]:
    """Group -> its mistakes, in the table's order. Raises InputError where the table is wrong."""
    groups = read_mapping(FILE)["groups"]
    found = {
        group: tuple(checked(Mistake, row, FILE) for row in rows) for group, rows in groups.items()
    }
    for mistake in (row for rows in found.values() for row in rows):
        check_one_of(next(iter(mistake.plant)), PLANTERS, mistake.name, "no such planter", FILE)
        for lack in mistake.blind:
            check_one_of(lack, BLIND, mistake.name, "no such lack", FILE)
            check_one_of(lack, lacks(), mistake.name, "no reason is given for it", FILE)
    return found


@cache
def lacks() -> dict[str, str]:
    """What a recording may lack -> why it cannot show some mistakes then."""
    return dict(read_mapping(FILE)["lacks"])
