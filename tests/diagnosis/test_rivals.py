"""Names that a bench cannot tell from each other do not refuse each other, and share what is
believed of them; a share of an unsure friction is judged by what it is worth.
"""

from __future__ import annotations

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

from testbed.benchmarks.diagnosis.bench_rigs import make_bench
from testbed.benchmarks.diagnosis.bench_trials import BenchTest
from testbed.diagnosis.leg.bench_probabilities import (
    BenchCalibration,
    BenchSigns,
    calibration,
    distribution,
)
from testbed.diagnosis.leg.diagnose import diagnose
from testbed.diagnosis.leg.entries import worth_interval
from testbed.diagnosis.leg.points import FRICTION
from testbed.diagnosis.leg.rivals import share_of
from testbed.effects import by_name

ALONG = by_name("friction.position")
PRESSED = 51
"""A bench whose friction grows with the pressure, and so with the load, which is the same there."""


def test_a_draw_that_a_rival_wins_names_the_effect_again() -> None:
    won = {frozenset({"a"}): 0.5, frozenset({"b"}): 0.3, frozenset(): 0.2}
    assert share_of("a", {}, won) == pytest.approx(0.5)
    assert share_of("a", {"b": 0.1}, won) == pytest.approx(0.8)


def test_names_that_are_not_told_apart_share_what_is_believed_of_them() -> None:
    told = BenchSigns(0.0, 1.0, 0.0, 1.0, 0.0, 9.0, 1.0, 0.0, ((("b",), 1.0),), ((("b",), 0.5),))
    found = distribution(told, ("a",), BenchCalibration({"one": 0.0}, 0.1, 0.0))
    assert sum(found.values()) == pytest.approx(1.0)
    assert found[("unnamed",)] == pytest.approx(0.5)
    assert found[("a",)] == pytest.approx(0.3)
    assert found[("b",)] == pytest.approx(0.15)


def test_no_answer_of_a_bench_is_surer_than_its_lapses() -> None:
    told = BenchSigns(99.0, 99.0, 0.0, 1.0, 0.0, 0.0, 0.0, 0.0, ())
    found = distribution(told, (), BenchCalibration({"one": 30.0}, 0.1, 0.05))
    assert found[("unnamed",)] == pytest.approx(0.95)


def test_a_share_of_an_unsure_friction_is_sure_where_their_product_is() -> None:
    """Coulomb friction of 20 N known to 12 N, a slope of 0.9 known to 0.5, and the two such that
    18 N is certain: only the allowance for another form of the law, 12 %, is left.
    """
    owned = [(ALONG.name, "slope"), *((FRICTION, name) for name in ALONG.relative_to)]
    coordinates = [SimpleNamespace(owner=owner, name=name) for owner, name in owned]
    way = np.array([0.5, -0.5 * 20.0 / 0.9, -0.5 * 20.0 / 0.9])
    fit = SimpleNamespace(
        coordinates=coordinates,
        theta=np.array([0.9, 20.0, 20.0]),
        covariance=np.outer(way, way),
    )
    found = worth_interval(fit, ALONG, 1.0, np.zeros((3, 3)))  # type: ignore[arg-type]
    assert found == pytest.approx((0.88 * 18.0, 1.12 * 18.0))
    pressing = by_name("friction.pressure")
    assert worth_interval(fit, pressing, 1.0, np.zeros((3, 3))) is None  # type: ignore[arg-type]


@pytest.mark.slow
def test_friction_by_pressure_or_load_is_named_though_neither_can_be_told_from_the_other() -> None:
    rig, hidden = make_bench(PRESSED)
    found = diagnose(rig)
    assert [entry.name for entry in found.entries] == [hidden.law] == ["friction.pressure"]
    assert "friction.load" in found.verdict.ambiguous["friction.pressure"]


def test_the_benchmark_of_benches_has_its_table() -> None:
    told = {"rig": "drive", "kind": "clean", "law": "", "verdict": "none", "names": []}
    bench = BenchTest(1, 0)
    (table,) = bench.tables(bench.summarise({"0": told}))
    assert table.rows == [["drive, clean", "1 of 1", "21 to 100 %"]]


def test_generic_terms_that_follow_the_noise_of_few_data_speak_for_no_law_without_a_name() -> None:
    few = BenchSigns(0.5, 3.0, 0.0, 1.0, -6.0, 0.0, 0.0, 0.0, ())
    helped_by_none = replace(few, generic_fall=0.0)
    found = distribution(few, (), calibration())
    assert found == distribution(helped_by_none, (), calibration()) and found[()] > 0.5
