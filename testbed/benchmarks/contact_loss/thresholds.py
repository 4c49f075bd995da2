"""The detectors' thresholds: shipped ones, set on the tuning scenes by `testbed contact-loss --tune`."""

from __future__ import annotations

from pathlib import Path

from testbed.errors import InputError
from testbed.estimation.detectors.table import DETECTORS
from testbed.formats.yaml_files import read_yaml

SHIPPED = Path(__file__).parents[2] / "estimation" / "detectors" / "thresholds.yaml"
FORMAT = "roboclimber-thresholds/1"


def read_thresholds(path: Path = SHIPPED) -> dict[str, float]:
    """Threshold of every detector. Raises InputError where the file lacks one."""
    tree = read_yaml(path)
    values = (
        tree.get("thresholds") if isinstance(tree, dict) and tree.get("format") == FORMAT else None
    )
    if not isinstance(values, dict):
        raise InputError("is no file of thresholds", file=path, field="format", allowed=FORMAT)
    for detector in DETECTORS:
        if not isinstance(values.get(detector.name), (int, float)):
            raise InputError(
                "is missing", file=path, field=f"thresholds.{detector.name}", allowed="a number"
            )
    return {name: float(value) for name, value in values.items()}


def thresholds_text(thresholds: dict[str, float], hours: float) -> str:
    """The file's text."""
    lines = [
        f"format: {FORMAT}",
        f"# testbed contact-loss --tune --hours {hours:g} --out DIR",
        "thresholds:",
    ]
    return (
        "\n".join([*lines, *(f"  {name}: {value:.6g}" for name, value in thresholds.items())])
        + "\n"
    )
