"""The detectors' thresholds: each one's own, set on the tuning scenes by `testbed contact-loss --tune`."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from testbed.estimation.detectors.table import DETECTORS

FORMAT = "roboclimber-thresholds/1"


def rivals(own: Sequence[str] = ()) -> dict[str, str]:
    """Every detector of the benchmark by name, with what it does: those shipped, then classes of the user's own."""
    return {d.name: d.text for d in DETECTORS} | dict.fromkeys(own, "of your own")


def shipped_thresholds() -> dict[str, float]:
    """Threshold of every shipped detector, as its own file has it."""
    return {detector.name: float(detector.threshold) for detector in DETECTORS}


def thresholds_text(thresholds: Mapping[str, float], hours: float) -> str:
    """What a tuning found, as YAML."""
    lines = [
        f"format: {FORMAT}",
        f"# testbed contact-loss --tune --hours {hours:g} --out DIR",
        "thresholds:",
        *(f"  {name}: {value:.6g}" for name, value in thresholds.items()),
    ]
    return "\n".join(lines) + "\n"
