"""The motion that a robot's diagnosis asks for where it cannot decide, as a scenario to run."""

from __future__ import annotations

import json
from collections.abc import Callable
from contextlib import suppress
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import TYPE_CHECKING, Any

from testbed.errors import InputError
from testbed.formats.files import write_text

if TYPE_CHECKING:
    from testbed.diagnosis.robot.diagnose import RobotDiagnosis
    from testbed.diagnosis.robot.hypotheses import Ledger

SECONDS = 16.0
"""How long a motion of the catalogue takes."""
AS_BELIEVED = ("undeclared=[]", 'machine={"draw": null}')
"""A rehearsal knows nothing of what the world hides."""
NOTHING_EXPECTED = ("expect={}", "mutation=null")
"""What the first motion was expected to do is nothing that the second must."""


def suggest_motion(
    found: RobotDiagnosis, run: Path, file: Path, tell: Callable[[str], None]
) -> dict[str, Any] | None:
    """Rehearse the catalogue of motions as the run in `run` stood, and write the scenario of the
    one that promises most into `file`; None, and no file, where nothing is to be parted.

    Raises InputError where the run has no scenario beside it.
    """
    from testbed.diagnosis.robot.hypotheses import Ledger
    from testbed.diagnosis.robot.motions import motion_named, motions, promises, rivals
    from testbed.formats.yaml_files import yaml_text
    from testbed.scenario.scenario import load_scenario

    two = rivals(found.verdict.hypotheses)
    if two is None:
        return None
    stood = run / "scenario.yaml"
    if not stood.is_file():
        raise InputError(
            "is not there: a motion is suggested as a change of it", file=stood, field="--suggest"
        )
    rehearsed = {}
    for motion in motions():
        tell(f"rehearsing: {motion.text}")
        with suppress(InputError):  # from here it cannot make this one
            rehearsed[motion.name] = _rehearsal(stood, motion.overrides())
    promised = promises(Ledger(found.balances), two, rehearsed)
    if not promised:
        raise InputError("no motion of the catalogue can be made from here", field="--suggest")
    best = motion_named(max(promised, key=promised.__getitem__))
    said = [f"description={json.dumps(best.text)}", *NOTHING_EXPECTED]
    scenario = load_scenario(stood, [*best.overrides(), *said], duration=SECONDS)
    write_text(file, yaml_text(json.loads(scenario.model_dump_json(exclude_defaults=True))))
    return {
        "parts": [list(names) for names in two],
        "motion": best.name,
        "text": best.text,
        "promised": promised,
    }


def _rehearsal(stood: Path, overrides: list[str]) -> Ledger:
    """The ledger of a motion of the believed machine."""
    from testbed.diagnosis.robot.hypotheses import Ledger
    from testbed.recording.robot import read_robot
    from testbed.scenario.scenario import load_scenario
    from testbed.simulation.run import run_scenario
    from testbed.workflows.diagnose import balances_of_run

    scenario = load_scenario(stood, [*AS_BELIEVED, *overrides], duration=SECONDS)
    with TemporaryDirectory() as folder:
        run_scenario(scenario, Path(folder) / "run")
        return Ledger(balances_of_run(read_robot(Path(folder) / "run"), None, {}))
