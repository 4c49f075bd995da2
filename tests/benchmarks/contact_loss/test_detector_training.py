"""What a case of the learned detector's training counts, and what networks beside each other
answer.
"""

from __future__ import annotations

from itertools import pairwise

import numpy as np
import pytest

from testbed.benchmarks.contact_loss.recordings import Tape
from testbed.benchmarks.contact_loss.training import (
    BESIDE_LOSS,
    LOSS_WEIGHT_S,
    SAFE_WEIGHT,
    side_by_side,
    weights_of,
)
from testbed.estimation.contact_losses import LossRule
from testbed.estimation.detectors.sample import Sample

DT = 1e-3


@pytest.mark.parametrize(("bore_n", "counts"), [(5000.0, 1.5), (1200.0, 1.5), (500.0, 0.5)])
def test_a_loss_counts_by_what_the_foot_bore_and_a_short_one_not_less(
    bore_n: float, counts: float
) -> None:
    normal = np.full((4000, 4), 5000.0)
    normal[:, 0] = bore_n
    normal[3000:3100, 0] = 0.0
    samples = Sample.zeros(len(normal))
    samples["row"]["t"], samples["row"]["carrying"] = np.arange(len(normal)) * DT, 1.0
    weight = weights_of(Tape(samples, normal, normal, normal, LossRule(10_000.0), DT))
    assert weight[3000:3100, 0] == pytest.approx(counts * (1.0 + LOSS_WEIGHT_S / 0.1))
    assert weight[2000, 0] == (SAFE_WEIGHT if bore_n > 2500.0 else 1.0)
    assert weight[:, 1] == pytest.approx(SAFE_WEIGHT)


def test_contact_beside_a_loss_counts_less_and_between_two_close_ones_as_well() -> None:
    normal = np.full((4000, 4), 1200.0)
    normal[1000:1100, 0] = normal[1300:1400, 0] = normal[3000:3100, 0] = 0.0
    samples = Sample.zeros(len(normal))
    samples["row"]["t"], samples["row"]["carrying"] = np.arange(len(normal)) * DT, 1.0
    weight = weights_of(Tape(samples, normal, normal, normal, LossRule(10_000.0), DT))[:, 0]
    (_, before), (_, between), (_, touchdown) = BESIDE_LOSS.values()
    assert weight[950] == pytest.approx(before) and weight[850] == 1.0
    assert weight[1150] == pytest.approx(between) and weight[1250] == pytest.approx(
        between * before
    )
    assert weight[1410] == pytest.approx(touchdown) and weight[1500] == weight[2500] == 1.0


def test_networks_side_by_side_answer_the_mean_of_all_also_beside_earlier_ones() -> None:
    rng = np.random.default_rng(3)
    sizes = (5, 4, 3, 1)
    nets = [
        [(rng.normal(size=(b, a)), rng.normal(size=b)) for a, b in pairwise(sizes)]
        for _ in range(4)
    ]
    view = rng.normal(size=5)

    def answer(layers: list[tuple[np.ndarray, np.ndarray]]) -> float:
        (w0, b0), (w1, b1), (w2, b2) = layers
        return float((w2 @ np.tanh(w1 @ np.tanh(w0 @ view + b0) + b1) + b2)[0])

    joined = side_by_side([side_by_side(nets[:2]), side_by_side(nets[2:])])
    assert answer(joined) == pytest.approx(np.mean([answer(net) for net in nets]))
