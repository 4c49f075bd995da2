"""Trains the learned detector on the tuning scenes that `testbed contact-loss --tune --out OUT`
recorded.

    testbed lab train-detector OUT --out learned.npz

Each scene is seen with the drawing board's belief and, where its machine was commissioned there
(`--commission`), once more with what that found. Every twentieth view of every foot is a case; its
answer is whether the foot is in contact (estimation/contact_losses.py). What is easy or long counts
less: cases of well-loaded feet SAFE_WEIGHT, and a loss, however short, at least as much as
LOSS_WEIGHT_S of its own cases; by what the foot bore before it counts LOST_WEIGHT. Contact beside a
loss counts less (BESIDE_LOSS): a word that says lost there is no false alarm, or a short one. Noise
on the views keeps the network from learning scenes by heart. Plain gradient descent with momentum
and scale (Adam) on the logistic loss, in NumPy; the same scenes, the same weights. So are MEMBERS
networks trained from different beginnings; what they answer together, their mean, is better than
any of them. Members of an earlier training may stay beside new ones (`--beside`).
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from testbed.benchmarks.contact_loss.benchmark import model_file
from testbed.benchmarks.contact_loss.recordings import Tape, facts_of, read_tape
from testbed.benchmarks.contact_loss.scenes import SETTLE_S, Scene
from testbed.benchmarks.contact_loss.score import CLASSES, Reference
from testbed.errors import InputError
from testbed.estimation.contact_losses import intervals
from testbed.estimation.detectors.foot_view import VIEW, FootMemory, ViewNumbers, views_over
from testbed.estimation.detectors.learned import MEMBERS, NARROW_OF_ONE, WIDE_OF_ONE, Learned
from testbed.formats.arrays import Array, Flags
from testbed.formats.networks import read_network, write_network
from testbed.formats.records import SET
from testbed.machine.names import LEGS

Layers = list[tuple[Array, Array]]
EVERY = 20
BATCH, STEP, DECAY = 1024, 3.0e-3, 1.0e-5
LITTLE = 1.0e-6
SAFE_SHARE, SAFE_WEIGHT = 0.25, 0.15
"""Cases of feet that bear more than this share of the nominal load, and what they count."""
LOSS_WEIGHT_S = 0.2
LOST_WEIGHT = {"near": 0.5, "light": 1.5, "loaded": 1.5}
"""Cases of a lost foot by what it bore before (score.py): a foot on the edge has little to lose,
and its words are most of the false alarms. With all at 1, networks of two thirds of 148 tuning
scenes found on the third left out 53 and 74 % of the losses of light and loaded feet at 2 to 15
false alarms an hour, with these 56 and 77 %, and near ones alike.
"""
BESIDE_LOSS = {"before": (0.1, 0.2), "between": (0.3, 0.3), "touchdown": (0.02, 0.3)}
"""Cases of a foot in contact so long before a loss, between two losses no further apart, or so long
after its touchdown, s, and by how much they count less.
"""
NOISE = 0.6
"""Standard deviation of the noise on the views, in their own standard deviations."""


def tuning_tapes(folder: Path) -> list[Path]:
    """Folders of the tuning scenes that a benchmark's folder holds. Raises InputError where there
    is none.
    """
    found = sorted(folder.glob("scenes/tuning-*/truth.parquet"))
    chosen = [file.parent for file in found if "-supervised-" not in file.parent.name]
    if not chosen:
        allowed = "a folder that `testbed contact-loss --tune` has written"
        raise InputError("holds no tuning scenes", file=folder, allowed=allowed)
    return chosen


def _beliefs(place: Path, folder: Path) -> Iterator[Tape]:
    """A scene as the drawing board has it and, where there is one, as its machine's model file has
    it; none of one that ended before it is scored.
    """
    facts = facts_of(place)
    if facts["simulated_s"] <= SETTLE_S:
        return
    model = model_file(folder / "machines", Scene(**facts["scene"]).machine_seed)
    for belief in (None, model) if model.is_file() else (None,):
        yield read_tape(place, belief)


def cases_of(tape: Tape) -> tuple[NDArray[Any], Array, Array]:
    """Views (m, len(VIEW)) of all feet of a scene, 1 where the foot is lost (m,), and what each
    case counts (m,).
    """
    count = len(tape.samples) // EVERY
    views = np.empty((count, len(LEGS), len(VIEW)), dtype=np.float32)
    memories, scale = FootMemory.zeros(len(LEGS)), ViewNumbers.one(**Learned.scale)
    views_over(np.asarray(tape.samples), scale, memories, tape.dt_s, EVERY, views)
    at = slice(EVERY - 1, count * EVERY, EVERY)
    late = tape.time_s[at] >= SETTLE_S
    lost, weight = ~tape.carries[at], weights_of(tape)[at]
    found = views[late].reshape(-1, len(VIEW)), lost[late].ravel().astype(float)
    return *found, weight[late].ravel()


def weights_of(tape: Tape) -> Array:
    """What each sample of each foot counts, (n, 4)."""
    meant = tape.samples["row"]["carrying"] > SET
    reference = Reference.of(tape.normal_n, meant, tape.time_s, tape.rule)
    lost = np.array([LOST_WEIGHT[word] for word in CLASSES])[reference.load_class]
    safe = tape.normal_n > SAFE_SHARE * tape.rule.nominal_load_n
    weight = np.where(safe, SAFE_WEIGHT, 1.0)
    for foot, carries in enumerate(tape.carries.T):
        losses = intervals(~carries, tape.time_s)
        for start, end in losses:
            longer = 1.0 + LOSS_WEIGHT_S / ((end - start) * tape.dt_s)
            weight[start:end, foot] = lost[start, foot] * longer
        weight[:, foot] *= _beside_losses(losses, carries, tape.dt_s)
    return weight


def _beside_losses(losses: list[tuple[int, int]], carries: Flags, dt_s: float) -> Array:
    """By how much each sample (n,) of a foot in contact counts less (BESIDE_LOSS); 1 elsewhere."""
    less, touched = np.ones(len(carries)), None
    samples = {word: round(time_s / dt_s) for word, (time_s, _) in BESIDE_LOSS.items()}
    share = {word: factor for word, (_, factor) in BESIDE_LOSS.items()}
    for start, end in losses:
        less[max(start - samples["before"], 0) : start] *= share["before"]
        if touched is not None and start - touched < samples["between"]:
            less[touched:start] *= share["between"]
        less[end : end + samples["touchdown"]] *= share["touchdown"]
        touched = end
    return np.where(carries, less, 1.0)


def train(
    views: Array,
    lost: Array,
    weight: Array,
    epochs: int,
    tell: Callable[[str], None],
    seed: int = 0,
) -> Layers:
    """Weights and biases of the three layers; the views' own scale is folded into the first."""
    rng = np.random.default_rng(seed)
    counts = (weight / weight.mean()).astype(np.float32)
    middle, spread = views.mean(axis=0), views.std(axis=0) + LITTLE
    scaled = ((views - middle) / spread).astype(np.float32)
    sizes = (len(VIEW), WIDE_OF_ONE, NARROW_OF_ONE, 1)
    weights = [rng.normal(0.0, a**-0.5, (b, a)) for a, b in pairwise(sizes)]
    values = [v.astype(np.float32) for w in weights for v in (w, np.zeros(len(w)))]
    means, squares = ([np.zeros_like(v) for v in values] for _ in range(2))
    steps, n = epochs * (len(scaled) // BATCH), 0
    for epoch in range(epochs):
        loss = 0.0
        for batch in np.array_split(rng.permutation(len(scaled)), len(scaled) // BATCH):
            n += 1
            step_size = 0.5 * STEP * (1.0 + np.cos(np.pi * min(n / steps, 1.0)))
            noise = NOISE * rng.standard_normal(scaled[batch].shape, dtype=np.float32)
            cost, slopes = _slopes(values, scaled[batch] + noise, lost[batch], counts[batch])
            loss += cost * len(batch) / len(scaled)
            for value, slope, mean, square in zip(values, slopes, means, squares, strict=True):
                mean += 0.1 * (slope + DECAY * value - mean)
                square += 0.001 * (slope**2 - square)
                size = np.sqrt(square / (1.0 - 0.999**n)) + 1e-8
                value -= (step_size * (mean / (1.0 - 0.9**n)) / size).astype(np.float32)
        tell(f"epoch {epoch + 1}: loss {loss:.4f}")
    layers = [(values[k].astype(float), values[k + 1].astype(float)) for k in (0, 2, 4)]
    weight, bias = layers[0]
    layers[0] = (weight / spread, bias - weight @ (middle / spread))
    return layers


def side_by_side(members: list[Layers]) -> Layers:
    """Networks of the same sizes as one whose answer is the mean of theirs."""
    from scipy.linalg import block_diag

    first, second, last = ([member[k] for member in members] for k in range(3))
    return [
        (np.concatenate([w for w, _ in first]), np.concatenate([b for _, b in first])),
        (block_diag(*(w for w, _ in second)), np.concatenate([b for _, b in second])),
        (
            np.concatenate([w for w, _ in last], axis=1) / len(members),
            np.mean([b for _, b in last], axis=0),
        ),
    ]


def _slopes(values: list[Any], views: Any, lost: Array, counts: Any) -> tuple[float, list[Any]]:
    """Mean logistic loss of a batch whose cases count so much, and its slope by every value."""
    seen = [views]
    for k in (0, 2):
        seen.append(np.tanh(seen[-1] @ values[k].T + values[k + 1]))
    odds = (seen[-1] @ values[4].T + values[5])[:, 0]
    loss = float(np.mean(counts * (np.logaddexp(0.0, odds) - lost * odds)))
    error = counts * (1.0 / (1.0 + np.exp(-odds)) - lost)
    back = (error / len(lost))[:, None].astype(np.float32)
    slopes: list[Any] = []
    for k in (4, 2, 0):
        slopes[:0] = [back.T @ seen[k // 2], back.sum(axis=0)]
        if k:
            back = (back @ values[k]) * (1.0 - seen[k // 2] ** 2)
    return loss, slopes


def train_on(folder: Path, out: Path, epochs: int, beside: Path | None = None) -> Iterable[str]:
    """Train on a benchmark's tuning scenes and write the weights; yields its report, line by line.
    `beside`: weights of half as many members, which stay.

    Raises InputError where there are no scenes, `beside` holds no network, or `out` cannot be
    written.
    """
    kept = [] if beside is None else [list(read_network(beside)[0].layers)]
    places = tuning_tapes(folder)
    made = [cases_of(tape) for place in places for tape in _beliefs(place, folder)]
    views, lost, weight = (np.concatenate(part) for part in zip(*made, strict=True))
    yield f"{len(places)} scenes, {len(made)} tapes, {len(lost)} cases, {lost.mean():.3f} of them lost"
    members: list[Layers] = []
    for seed in range(MEMBERS // (1 + len(kept))):
        progress_lines: list[str] = []
        members.append(train(views, lost, weight, epochs, progress_lines.append, seed))
        yield from progress_lines
    layers = side_by_side([*kept, side_by_side(members)])
    arrays = {f"weight_{k}": w.astype(np.float32) for k, (w, _) in enumerate(layers)}
    arrays |= {f"bias_{k}": b.astype(np.float32) for k, (_, b) in enumerate(layers)}
    note = f"testbed lab train-detector, {len(places)} tuning scenes, {epochs} epochs"
    write_network(out, arrays, made_by=note)
