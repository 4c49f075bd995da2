"""A run at an instant: all that goes on from there, bit for bit, as an object and as a file.

A state holds the engine's bodies with their contacts, the world outside the engine, estimators,
gait and layers, detectors, drill, judge, and the random generators. It does not hold what the
scenario says: a state goes back into a run of the same scenario, with the same model and the same
classes of a user's own. The file is a ZIP of arrays (.npz) and is read without pickle.
"""

from __future__ import annotations

import hashlib
import json
import zipfile
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from testbed.errors import InputError
from testbed.formats.files import check_file, plain, whole
from testbed.formats.snapshot import Snapshot, capture, constants, put_back
from testbed.machine.model import Machine
from testbed.world.engine import Engine

if TYPE_CHECKING:
    from testbed.world.simulation import Simulation

FORMAT = "roboclimber-state/2"
ALLOWED = "a file of `testbed save`"
NOT_COMPARED = ("name", "description", "duration_s", "expect", "mutation")
"""Fields of a scenario that a state does not depend on."""
BROKEN = (OSError, EOFError, ValueError, KeyError, TypeError, AttributeError, zipfile.BadZipFile)
"""What reading a damaged file raises."""
constant = constants(
    Engine,
    Machine,
    rooms=("testbed.scenario.scenario", "testbed.scenario.machines", "testbed.robot."),
)
"""What every run of a scenario builds for itself and never changes; the engine saves its own
state.
"""


@dataclass(frozen=True)
class State:
    """A run at an instant. Made by `save`, given to `restore`; `write` and `read_state` keep it in
    a file.
    """

    t_s: float
    """Simulated time at which it was taken."""
    identity: Mapping[str, Any]
    """The scenario and the model that it belongs to; `told` in a file."""
    scenario: Mapping[str, Any]
    """The whole scenario, as a file could say it."""
    engine: Mapping[str, NDArray[Any]]
    parts: Snapshot

    def write(self, path: str | Path) -> Path:
        """Write the state as `path` (.npz), whole or not at all. Raises InputError where that
        cannot be.
        """
        file = check_file(path, (".npz",), field="state")
        head = {
            "format": FORMAT,
            "t_s": self.t_s,
            "told": self.identity,
            "scenario": self.scenario,
            "nodes": self.parts.nodes,
            "arrays": len(self.parts.arrays),
        }
        arrays: dict[str, Any] = {
            f"array_{index}": array for index, array in enumerate(self.parts.arrays)
        }
        arrays |= {f"engine_{name}": array for name, array in self.engine.items()}
        with whole(file) as hidden, hidden.open("wb") as stream:
            np.savez_compressed(stream, head=np.array(json.dumps(head)), **arrays)
        return file


def read_state(path: str | Path) -> State:
    """The state in a file. Raises InputError where it is none, or damaged."""
    file = Path(path)
    if not file.is_file():
        problem = "is not a file" if file.exists() else "no such file"
        raise InputError(problem, file=file, allowed=ALLOWED)
    try:
        with np.load(file, allow_pickle=False) as found:
            head = json.loads(str(found["head"]))
            if head.get("format") != FORMAT:
                raise InputError(
                    "is no saved state",
                    file=file,
                    field="format",
                    value=head.get("format"),
                    allowed=FORMAT,
                )
            arrays = [found[f"array_{index}"] for index in range(int(head["arrays"]))]
            engine = {
                name.removeprefix("engine_"): found[name]
                for name in found.files
                if name.startswith("engine_")
            }
        parts = Snapshot(head["nodes"], arrays)
        return State(float(head["t_s"]), head["told"], head["scenario"], engine, parts)
    except BROKEN as error:
        raise InputError(
            "is no saved state, or a damaged one", file=file, allowed=ALLOWED
        ) from error


def save(simulation: Simulation, *others: Any) -> State:
    """The state of a run between two steps, and that of `others` that ride along.

    Raises InputError where a class of the user's own holds what no state can hold.
    """
    return State(
        t_s=simulation.t_s,
        identity=_identity(simulation),
        scenario=plain(simulation.scenario.model_dump(mode="json")),
        engine=simulation.machine.engine.state(),
        parts=capture([simulation, *others], constant),
    )


def restore(state: State, simulation: Simulation, *others: Any) -> None:
    """Bring a run of the same scenario to a saved state.

    Raises InputError where it is of another scenario or model, or has other parts of the user's
    own.
    """
    now = _identity(simulation)
    for field, value in now.items():
        if state.identity.get(field) != value:
            raise InputError(
                f"belongs to another run: its {field} differs" + _where(state.identity, now, field),
                field="state",
                allowed="a run of the same scenario and model",
            )
    simulation.machine.engine.put_state(state.engine)
    put_back(state.parts, [simulation, *others], constant)


def _identity(simulation: Simulation) -> dict[str, Any]:
    """What a state must have in common with the run that it goes into."""
    scenario = simulation.scenario.model_dump(mode="json", exclude=set(NOT_COMPARED))
    belief = np.ascontiguousarray(simulation.machine.chain.belief)
    return {"scenario": plain(scenario), "model": hashlib.sha256(belief.tobytes()).hexdigest()}


def _where(identity: Mapping[str, Any], now: Mapping[str, Any], field: str) -> str:
    """The sections in which two scenarios differ, in words."""
    then, here = identity.get(field), now[field]
    if not isinstance(then, Mapping) or not isinstance(here, Mapping):
        return ""
    return " in " + ", ".join(key for key in here if then.get(key) != here[key])
