"""The detectors' thresholds: each one's own, set on the tuning scenes by `testbed contact-loss --tune`."""

from __future__ import annotations

from collections.abc import Mapping

from testbed.estimation.detectors.table import DETECTORS

FORMAT = "roboclimber-thresholds/1"


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
