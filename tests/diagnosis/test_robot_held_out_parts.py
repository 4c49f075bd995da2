"""What one part of a recording alone may have of an effect's shape: by densities of Gaussians."""

from __future__ import annotations

from dataclasses import replace
from types import SimpleNamespace
from typing import Any, cast

import numpy as np
import pytest
from scipy.stats import multivariate_normal

from testbed.diagnosis.robot.evidence import PIECE_S, RawGroup
from testbed.diagnosis.robot.groups import Balances, Candidate
from testbed.diagnosis.robot.held_out_parts import PARTS, Alone, parts_of
from testbed.diagnosis.robot.hypotheses import ALONE
from testbed.effects import by_name
from testbed.effects.signature import Change
from tests.diagnosis.ledgers import ledger_of

LEFT, RIGHT = "sensor.gain_a@fl_vertical", "sensor.gain_a@fr_vertical"
ROWS, SPREAD = 40, 20.0


def group(missing: np.ndarray, white: float = 1.0, lasting: float = 0.0) -> RawGroup:
    """Five rows in each of eight pieces, which two gains show: the left one as a constant."""
    columns = {2: np.ones(ROWS), 5: np.random.default_rng(7).normal(size=ROWS)}
    return RawGroup(
        missing=missing,
        time_s=np.repeat(np.arange(0.0, 8.0 * PIECE_S, PIECE_S), 5),
        noise=white**2 * np.eye(ROWS),
        tolerated=lasting * np.ones((ROWS, 1)),
        rows_of=lambda change: sum(
            (columns[i] * force[0] for i, force in change.force.items()), np.zeros(ROWS)
        ),
    )


def balances(raw: RawGroup) -> Balances:
    """Those of one group and both gains."""
    changes = {LEFT: Change(force={2: np.ones(1)}), RIGHT: Change(force={5: np.ones(1)})}
    effect = by_name("sensor.gain_a")
    found = {
        name: Candidate(effect, name.partition("@")[2], {"gain_error": change})
        for name, change in changes.items()
    }
    groups = {"forces": raw.whitened({name: one.signature for name, one in found.items()})}
    said = SimpleNamespace(raw={"forces": raw}, groups=groups, candidates=found)
    return cast(Balances, cast(Any, said))


@pytest.mark.parametrize("others", [(), (RIGHT,)])
def test_a_shape_in_one_part_alone_has_the_evidence_of_two_gaussian_densities(
    others: tuple[str, ...],
) -> None:
    raw = group(np.random.default_rng(3).normal(size=ROWS) * 4.0, 1.5, 2.0)
    width = {name: np.array([SPREAD]) for name in (LEFT, RIGHT)}
    found = Alone(balances(raw), width).log_factors(LEFT, others, np.ones(1, dtype=bool))
    beside = SPREAD * raw.rows_of(Change(force={5: np.ones(1)}))
    sound = raw.noise + raw.tolerated @ raw.tolerated.T
    sound = sound + (np.outer(beside, beside) if others else 0.0)
    zero = np.zeros(ROWS)
    for part in range(PARTS):
        own = SPREAD * (parts_of(raw.time_s) == part)
        exact = multivariate_normal.logpdf(raw.missing, zero, sound + np.outer(own, own))
        exact -= multivariate_normal.logpdf(raw.missing, zero, sound)
        assert found[part] == pytest.approx(float(exact), rel=1e-8)


def test_what_lasts_beside_a_tolerance_that_lasts_is_in_no_part_alone() -> None:
    """A constant of three such tolerances: its evidence is theirs, and a part alone has none."""
    ledger = ledger_of({"forces": group(np.full(ROWS, 30.0), 0.1, 10.0)}, (LEFT,), SPREAD)
    whole = ledger.hypothesis((LEFT,)).log_factor
    assert ledger.foreseen((LEFT,)) == pytest.approx(whole, abs=0.6)
    jump = np.where(parts_of(group(np.zeros(ROWS)).time_s) == 1, 30.0, 0.0)
    once = ledger_of({"forces": replace(group(jump, 3.0))}, (LEFT,), SPREAD)
    assert once.hypothesis((LEFT,)).log_factor > 10.0
    assert once.foreseen((LEFT,)) < once.hypothesis((LEFT,)).log_factor - ALONE
