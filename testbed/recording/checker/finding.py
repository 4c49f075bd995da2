"""One thing that is wrong with a recording, and all of them together."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, Literal

Severity = Literal["error", "warning", "note"]
ORDER: tuple[Severity, ...] = ("error", "warning", "note")
HEADS = ("severity", "channel", "when, s", "what", "evidence", "what to do")


@dataclass(frozen=True)
class Finding:
    """What is wrong, where and when, with the numbers that show it and what to do about it.

    `error`: the recording cannot be used as it is. `warning`: some of it cannot, or only with care.
    `note`: good to know. `from_s`, `to_s`: None where it concerns the whole recording.
    """

    severity: Severity
    channel: str
    what: str
    evidence: str
    advice: str
    from_s: float | None = None
    to_s: float | None = None

    def when(self) -> str:
        """The stretch of time in words, empty for the whole recording."""
        if self.from_s is None:
            return ""
        later = self.to_s is not None and self.to_s != self.from_s
        return f"{self.from_s:.4g}" + (f" to {self.to_s:.4g}" if later else "")


@dataclass(frozen=True)
class Checked:
    """The findings on one recording, the worst first."""

    recording: str
    findings: tuple[Finding, ...]

    @property
    def usable(self) -> bool:
        """Whether nothing stands against using it."""
        return all(finding.severity != "error" for finding in self.findings)

    def tree(self) -> dict[str, Any]:
        """As JSON carries it."""
        return {
            "recording": self.recording,
            "usable": self.usable,
            "findings": [vars(finding) for finding in self.findings],
        }

    def rows(self) -> list[list[str]]:
        """Table rows under HEADS."""
        return [
            [
                finding.severity,
                finding.channel,
                finding.when(),
                finding.what,
                finding.evidence,
                finding.advice,
            ]
            for finding in self.findings
        ]


def sorted_findings(found: Sequence[Finding]) -> tuple[Finding, ...]:
    """The worst first, otherwise in the order in which they were found."""
    return tuple(sorted(found, key=lambda f: ORDER.index(f.severity)))
