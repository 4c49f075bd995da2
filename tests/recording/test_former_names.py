"""Runs recorded under former column names are read under today's."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from testbed.formats.table import write_columns
from testbed.recording.former import current, current_numbers, with_former, written_for
from testbed.recording.robot_columns import described
from testbed.simulation.runs import read_series


def test_an_old_column_is_found_by_its_name_of_today(tmp_path: Path) -> None:
    columns = {
        "t": np.arange(3.0),
        "estimate_own_low_fl": np.ones(3),
        "estimate_own_fl": np.zeros(3),
    }
    write_columns(tmp_path / "data.parquet", columns)
    assert set(read_series(tmp_path, "data")) == {"t", "own_low_fl", "estimate_own_fl"}
    assert np.array_equal(read_series(tmp_path, "data", ["own_low_fl"])["own_low_fl"], np.ones(3))


def test_names_of_today_stay_as_they_are() -> None:
    assert current("estimate_own_fl") == "estimate_own_fl"
    assert current("estimate_own_sd_rr") == "own_sd_rr"
    assert with_former(["t", "own_high_fr"]) == ["t", "own_high_fr", "estimate_own_high_fr"]
    assert described("estimate_own_low_fl") == described("own_low_fl") is not None


def test_a_leakage_that_stood_for_two_edges_is_that_of_both() -> None:
    known = {"valve.edge_leakage_m3_s_pa": 3e-13, "total_mass_kg": 4e3}
    assert current_numbers(known) == {
        "valve.edge_at_leakage_m3_s_pa": 3e-13,
        "valve.edge_bt_leakage_m3_s_pa": 3e-13,
        "total_mass_kg": 4e3,
    }


def test_a_recording_of_valves_that_hold_no_load_counts_from_the_original_circuit() -> None:
    assert written_for({"valve.deadband": 0.03}) == "original"
    assert written_for({"valve.deadband": 0.03, "valve.holding_a": 0.0}) == "inferred"
    assert written_for({"oil.bulk_modulus_pa": 1e9}) == written_for({}) == "inferred"
