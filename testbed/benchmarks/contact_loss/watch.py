"""One scene of the contact-loss benchmark: simulated once, all detectors on the same rows.

What is kept of it holds what the thresholds of all detectors are set and scored with, and the loads (means of 5 ms)
that the early warning is judged on: neither other thresholds nor another warning need the scenes simulated again.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray

from testbed.benchmarks.contact_loss.loads import KEPT, means, off_ground, packed
from testbed.benchmarks.contact_loss.scenes import SETTLE_S, Moves, Scene, draw
from testbed.benchmarks.contact_loss.score import LOSS_N, score_scene
from testbed.control.gait import Layered
from testbed.errors import SimulationFault
from testbed.estimation.detectors.base import scores_over, start
from testbed.estimation.detectors.sample import Watch
from testbed.estimation.detectors.table import detector_of
from testbed.machine.names import LEGS
from testbed.recording.rows import DataRow

Array = NDArray[np.float64]
BLOCK_ROWS = 1000
ORACLE = "oracle"
ORACLE_LAG_S, ORACLE_NOISE_N = 1.0 / (2.0 * np.pi * 250.0), 37.0
"""The oracle knows the true load, through the transducers' bandwidth, with their noise through the areas, sampled."""


class Watching:
    """All detectors over a run, block by block; keeps their scores, and the loads that the warning looks at.

    `belief`: the run's ChainBelief, shape (1,).
    """

    def __init__(self, belief: NDArray[Any], dt_s: float, detectors: Mapping[str, Any]) -> None:
        self._watch, self._dt_s, self._detectors = Watch(belief), dt_s, detectors
        for detector in detectors.values():
            start(detector, dt_s)
        self._loads: list[NDArray[np.int16]] = []
        self._parts: list[NDArray[np.float32]] = []

    def take(self, rows: NDArray[Any]) -> None:
        """The next rows (n,) of DataRow."""
        samples = self._watch.samples(rows)
        kept = [scores_over(detector, samples) for detector in self._detectors.values()]
        self._parts.append(np.stack(kept, axis=1).astype(np.float32))
        own, derived = samples["row"]["estimate"]["own"], samples["derived"]
        loads = np.stack([own, derived["carried"], derived["balance"]], axis=1)
        self._loads.append(means(loads, self._dt_s))

    def loads(self, true_n: Array) -> dict[str, NDArray[np.int16]]:
        """Loads by kind (m, 4) for the early warning, with the true normal force (n, 4) of the run."""
        kinds = [*np.concatenate(self._loads).swapaxes(0, 1), means(true_n, self._dt_s)]
        return dict(zip(KEPT, kinds, strict=True))

    def scores(self) -> dict[str, NDArray[np.float32]]:
        """Every detector's scores (n, 4)."""
        whole = np.concatenate(self._parts)
        return {name: whole[:, k] for k, name in enumerate(self._detectors)}


def run_scene(scene: Scene, names: Iterable[str]) -> dict[str, Any]:
    """Simulate a scene and score the detectors of these names on it: what is kept of it."""
    from testbed.world.simulation import Simulation

    drawn = draw(scene)
    simulation = Simulation(drawn.scenario)
    try:
        simulation.machine.gait = Layered(simulation.machine.gait, (Moves(drawn),))
        detectors = {name: detector_of(name, "--detector") for name in names}
        watch = Watching(simulation.machine.chain.belief, simulation.dt, detectors)
        truth, carrying, fault = _rows(simulation, watch)
    finally:
        simulation.close()
    found = {
        "scene": vars(scene),
        "slope_deg": drawn.scenario.terrain.slope_deg,
        "undeclared": [u.effect for u in drawn.scenario.undeclared],
        "verdict": simulation.verdict,
        "fault": fault,
        "simulated_s": round(len(truth) * simulation.dt, 3),
        "off_s": _off_s(truth[:, :4], carrying, simulation.dt),
        "off": off_ground(truth[:, :4], carrying, simulation.dt),
    }
    scored = _scored(truth, carrying, watch, simulation, drawn, scene.seed)
    return found | scored | {"loads": packed(watch.loads(truth[:, :4]))}


def _off_s(normal_n: Array, carrying: NDArray[np.bool_], dt_s: float) -> float:
    """Seconds that feet meant to carry bore less than 300 N, all four added up."""
    off = (normal_n < LOSS_N) & carrying
    return round(float(off[round(SETTLE_S / dt_s) :].sum()) * dt_s, 3)


def _rows(simulation: Any, watch: Watching) -> tuple[Array, NDArray[np.bool_], str]:
    """Normal force (n, 4) and foot load (n, 4) side by side, which feet are meant to carry, and what broke down."""
    names, given = simulation.truth_columns, simulation.data_columns
    wanted = [
        names.index(f"{kind}_{leg}") for kind in ("contact_normal", "foot_load") for leg in LEGS
    ]
    carry = [given.index(f"carrying_{leg}") for leg in LEGS]
    truth, carrying, fault = (
        [np.empty((0, len(wanted)))],
        [np.empty((0, len(carry)), dtype=bool)],
        "",
    )
    while not simulation.finished:
        try:
            data, true = simulation.run_block(BLOCK_ROWS)
        except SimulationFault as error:
            fault = str(error)
            break
        watch.take(data.view(DataRow.dtype)[:, 0])
        truth.append(true[:, wanted])
        carrying.append(data[:, carry] > 0.5)
    return np.concatenate(truth), np.concatenate(carrying), fault


def _scored(
    truth: Array,
    carrying: NDArray[np.bool_],
    watch: Watching,
    simulation: Any,
    drawn: Any,
    seed: int,
) -> dict[str, Any]:
    dt, scores = simulation.dt, watch.scores()
    scores[ORACLE] = _oracle(truth[:, 4:], dt, seed)
    tree = score_scene(truth[:, :4], carrying, scores, dt, SETTLE_S).as_dict()
    kinds = [(e["t"], str(e["kind"])) for e in simulation.events]
    events = [(t, kind.removeprefix("drill_")) for t, kind in kinds if kind.startswith("drill_")]
    for loss in tree["losses"]:
        at = loss["start_s"]
        loss["phase"] = next((kind for t, kind in reversed(events) if t <= at), "idle")
        loss["cause"] = next((u.kind for u in reversed(drawn.upsets) if u.start_s <= at), "none")
    return tree


def _oracle(load_n: Array, dt_s: float, seed: int) -> NDArray[np.float32]:
    from scipy.signal import lfilter

    keep = float(np.exp(-dt_s / ORACLE_LAG_S))
    late = lfilter([1.0 - keep], [1.0, -keep], load_n, axis=0)
    noise = np.random.default_rng([seed, 7]).normal(0.0, ORACLE_NOISE_N, load_n.shape)
    return np.asarray(-(late + noise), dtype=np.float32)
