"""The paper's experiments: criteria judged as stated, JSON as promised, two figures run for
real.
"""

from __future__ import annotations

import json
import math
from pathlib import Path

import numpy as np
import pytest

from testbed.benchmarks.harness import as_json, write
from testbed.benchmarks.paper import benchmark
from testbed.benchmarks.paper.benchmark import Paper, chosen, experiment
from testbed.benchmarks.paper.experiment import (
    Claim,
    Experiment,
    Line,
    Panel,
    Result,
    described,
    evaluated,
)
from testbed.errors import InputError
from testbed.report.page import Table


def at_least(low: float, measured: float) -> Claim:
    return Claim("6", "c", low, math.inf, measured)


def at_most(high: float, measured: float) -> Claim:
    return Claim("9", "x", -math.inf, high, measured, "N")


def between(low: float, high: float, measured: float) -> Claim:
    return Claim("9", "y", low, high, measured, "N")


def test_a_claim_holds_inside_its_stated_range_bounds_included_and_nowhere_else() -> None:
    assert at_least(1.5, 1.5).holds and not at_least(1.5, 1.499).holds
    assert at_most(96.0, 96.0).holds and not at_most(96.0, 96.1).holds
    found = [between(1680.0, 2520.0, x).holds for x in (1679.0, 1680.0, 2100.0, 2520.0, 2521.0)]
    assert found == [False, True, True, True, False]


def test_a_number_that_could_not_be_measured_holds_nothing_and_is_null_in_json() -> None:
    claim = at_most(1.0, math.nan)
    assert not claim.holds
    assert claim.tree()["measured"] is None
    assert not at_least(1.0, math.inf).holds


def test_expected_is_the_bound_or_both_bounds() -> None:
    assert at_least(0.99, 1.0).expected == 0.99
    assert at_most(481.0, 1.0).expected == 481.0
    assert between(1680.0, 2520.0, 2000.0).expected == [1680.0, 2520.0]


def test_every_figure_has_one_criterion_a_claim_and_a_module_that_says_all_it_is_asked() -> None:
    for figure, words in described().items():
        module = Path(benchmark.__file__).with_name(f"figure_{int(figure):02d}.py").read_text()
        for stated in words["claims"].values():
            assert len({"at_least", "at_most", "between"} & set(stated)) == 1, stated
        for part in ("claims", "panels", "tables"):
            assert all(f'"{name}"' in module for name in words.get(part, {})), (figure, part)


def test_a_result_is_told_in_the_figures_words_with_its_own_numbers() -> None:
    line = Line(np.zeros(2), np.zeros(2), "A")
    rows = {"parts": [["peak", "2000"]]}
    made = evaluated("6", Result({"peak": 2415.5}, {"force": [line], "pressures": []}, rows))
    (claim,) = made.claims
    assert claim.criterion == "1785 to 2415" and not claim.holds and claim.unit == "N"
    assert made.panels[0].lines == [line] and made.panels[0].y_label == "F [N]"
    assert made.tables[0].rows == rows["parts"]
    with pytest.raises(KeyError):
        evaluated("6", Result({}, {"force": [], "pressures": []}, rows))


def test_figures_are_chosen_by_number_or_table_in_the_papers_order() -> None:
    assert chosen([]) == list(described())
    assert chosen(["12", "III", "06"]) == ["6", "8", "12"]
    with pytest.raises(InputError, match=r"10.*allowed: 4, 5"):
        chosen(["10"])


def test_paper_json_is_the_list_of_claims_and_the_page_needs_no_network(tmp_path: Path) -> None:
    x = np.arange(3.0)
    panel = Panel("a & b", "t [s]", "F [N]", [Line(x, x, "line")])
    table = Table("t", ["<head>"], [["cell"]])
    claims = [at_least(2.0, 1.0)]
    made = Experiment("6", "T", "says <so>", "set", claims, [panel], [table])
    write(Paper(), [made], tmp_path)
    assert json.loads((tmp_path / "paper.json").read_text()) == [
        {
            "figure": "6",
            "claim": "c",
            "expected": 2.0,
            "measured": 1.0,
            "unit": "1",
            "holds": False,
        }
    ]
    text = (tmp_path / "paper.html").read_text()
    assert "0 of 1 claims hold" in text and "says &lt;so&gt;" in text and "<svg" in text
    assert "<th>&lt;head&gt;</th>" in text
    assert "<script" not in text and 'src="http' not in text and "<link" not in text


def test_an_experiment_comes_back_from_json_as_it_was() -> None:
    line = Line(np.arange(3.0), np.arange(3.0), "line", 2, "--")
    claims = [at_most(1.0, math.inf), between(1.0, 2.0, 1.5)]
    tables = [Table("t", ["head"], [["cell"]])]
    made = Experiment(
        "9", "T", "says", "set", claims, [Panel("a", "b", "c", [line])], tables, ["n"]
    )
    back = Experiment.read(as_json(made))
    assert back.claims == made.claims and back.notes == made.notes
    assert back.tables == made.tables and back.panels[0].lines[0].y == [0.0, 1.0, 2.0]
    assert as_json(back) == as_json(made)


def test_the_straight_line_gives_back_a_and_b() -> None:
    from testbed.benchmarks.paper.figure_04 import K_PA_PER_V, straight_line

    volts = np.array([1.0, 2.0, 4.0])
    found = straight_line(volts, K_PA_PER_V * 3.84e-3 * (1.1 * volts - 0.2), 3.84e-3)
    assert (found.a, found.b, found.r2) == pytest.approx((1.1, -0.2, 1.0))


def test_a_stick_slip_is_a_stand_followed_by_more_than_twice_the_speed() -> None:
    from testbed.benchmarks.paper.stick_slip import stick_slips

    assert stick_slips(np.array([1.0, 0.0, 2.5, 2.5, 0.05, 1.5, 3.0]), 1.0) == 2
    assert stick_slips(np.array([1.0, 3.0, 1.0, 0.2]), 1.0) == 0


def test_the_drift_over_a_hold_is_its_last_second_less_its_first_half_second() -> None:
    from testbed.benchmarks.paper.figure_05 import RECORD_HZ, drift_n

    force = np.r_[
        np.full(RECORD_HZ, 500.0), np.linspace(500.0, 100.0, RECORD_HZ), np.full(RECORD_HZ, 100.0)
    ]
    assert drift_n(force, slice(0, len(force))) == pytest.approx(-400.0)


def test_the_published_modified_filter_locks_out_after_a_step_of_4_kn() -> None:
    from testbed.benchmarks.paper.figure_12 import locked_out

    assert locked_out(4000.0, 0)
    assert not locked_out(150.0, 0)


@pytest.mark.slow
def test_on_the_declared_machine_friction_is_found_in_the_air_and_taken_out_on_the_sinusoid(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """With transducers as straight as the identification takes them for."""
    monkeypatch.setattr("testbed.benchmarks.paper.leg.bend_transducers", lambda *_: None)
    eight, eleven = (experiment(figure, "declared") for figure in ("8", "11"))
    measured = {c.claim: c for e in (eight, eleven) for c in e.claims}
    assert all(c.holds for c in eight.claims)
    mean = next(c for name, c in measured.items() if name.startswith("around zero"))
    assert mean.holds and mean.measured < 20.0
    values = {row[0]: float(row[1]) for row in eight.tables[0].rows}
    assert values["viscous_plus_n_s_m"] == pytest.approx(5200.0, rel=0.1)
    assert values["viscous_minus_n_s_m"] == pytest.approx(4100.0, rel=0.1)
