"""Friction (5) identified: known parameters come back, intervals hold what they promise, bad data
are named.
"""

import math
import os
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from synthetic_bench import bench

from testbed.benchmarks.estimators.identification_trials import (
    KNOWN,
    UNSEEN_M_S,
    air_recording,
    coverage,
    eight,
    random_friction,
    recording_of,
    speed_profile,
)
from testbed.errors import InputError
from testbed.estimation.friction.declared_numbers import Unknown, choose_form
from testbed.estimation.friction.evidence import Evidence, check_opposes, gather
from testbed.estimation.friction.identification import identify, identify_rig
from testbed.estimation.friction.posterior import correlation_inflation, curve, fit_side
from testbed.recording.axis import read_recording, read_rig
from testbed.recording.known import Known
from testbed.recording.leg_model import read_model, write_model

FRICTION = random_friction(np.random.default_rng(1))
DATA = os.environ.get("TESTBED_DATA")


def binomial_two_sided(successes, trials, p):
    """Two-sided p-value: total probability of outcomes no likelier than the one observed."""
    from scipy.stats import binomtest

    return binomtest(successes, trials, p).pvalue


@pytest.fixture(scope="module")
def recording():
    return air_recording(FRICTION, 1)


def test_curve_equals_the_hand_computed_friction():
    # 5000 * 0.02 + 600 + 200 exp(-0.02 / 0.007) = 711.49 N
    assert curve(np.array([5000.0, 600.0, 200.0, 0.007]), np.array([0.02]))[0] == pytest.approx(
        711.487, abs=1e-3
    )


def test_noise_free_rows_give_back_the_four_parameters():
    true = np.array([4000.0, 700.0, 250.0, 0.008])
    speed = np.geomspace(0.002, 0.12, 200)
    assert fit_side(speed, curve(true, speed)).value == pytest.approx(true, rel=0.01)


def test_eight_parameters_lie_in_or_near_their_intervals(recording):
    found = identify([recording], KNOWN)
    for p, true in zip(found.parameters, eight(FRICTION), strict=True):
        width = p.interval90[1] - p.interval90[0]
        assert p.interval90[0] - width <= true <= p.interval90[1] + width
        assert p.shown


def test_friction_at_unseen_speeds_is_predicted_within_five_per_cent(recording):
    found, true = eight(identify([recording], KNOWN).model.friction), eight(FRICTION)
    for side in (slice(0, 4), slice(4, 8)):
        assert curve(found[side], UNSEEN_M_S) == pytest.approx(
            curve(true[side], UNSEEN_M_S), rel=0.05
        )


def test_motion_without_slow_parts_does_not_show_the_stribeck_speed():
    fast = speed_profile((0.06, 0.08, 0.1, 0.14))
    found = {p.name: p for p in identify([air_recording(FRICTION, 2, fast)], KNOWN).parameters}
    assert not found["stribeck_speed_plus_m_s"].shown
    assert (
        "mm/s" in found["stribeck_plus_n"].why or "absent" in found["stribeck_speed_plus_m_s"].why
    )


def test_motion_at_one_speed_does_not_show_the_viscous_part():
    found = {
        p.name: p
        for p in identify(
            [air_recording(FRICTION, 3, speed_profile((0.02,) * 8))], KNOWN
        ).parameters
    }
    assert not found["viscous_plus_n_s_m"].shown
    assert "hardly change the friction" in found["viscous_plus_n_s_m"].why


def test_quick_reversal_leaves_no_row_of_mixed_direction():
    v = 0.14 * np.sign(np.sin(2 * np.pi * 0.7 * np.arange(0, 8, 1e-3)))
    v = np.convolve(v, np.ones(30) / 30, "same")
    rows = gather([air_recording(FRICTION, 4, v)], KNOWN)
    assert np.all(np.abs(rows.velocity_m_s) > 0.12)


def test_correlated_residuals_inflate_the_variance_by_their_sum():
    # AR(1) with 0.6: (1 + 0.6) / (1 - 0.6) = 4
    rng = np.random.default_rng(0)
    r = np.zeros(20000)
    for k in range(1, r.size):
        r[k] = 0.6 * r[k - 1] + rng.normal()
    assert correlation_inflation(r) == pytest.approx(4.0, rel=0.25)
    assert correlation_inflation(rng.normal(size=20000)) == pytest.approx(1.0, abs=0.1)


def test_model_file_of_an_identification_can_be_read_back(recording, tmp_path):
    model = identify([recording], KNOWN).model
    write_model(tmp_path / "m.yaml", model)
    assert read_model(tmp_path / "m.yaml").friction == model.friction
    assert "90 % intervals" in model.description


@pytest.mark.slow
def test_ninety_per_cent_intervals_hold_the_truth_in_ninety_of_a_hundred_of_200_trials():
    held, worst = coverage(200, speed_profile(longest_s=1.5, travel_m=0.01))
    assert worst < 0.05
    for count in held:  # eight tests at once: 1 % for each
        assert binomial_two_sided(int(count), 200, 0.90) > 0.01 / 8


def test_constant_position_is_named(recording):
    still = replace(recording, position_m=np.full_like(recording.position_m, 0.2))
    with pytest.raises(InputError, match=r"position: the position stays at 0.2 m"):
        identify([still], KNOWN)


def test_stuck_sensor_is_named_with_its_time(recording):
    pa = recording.pressure_a_pa.copy()
    pa[5000:12000] = pa[5000]
    with pytest.raises(
        InputError, match=r"pressure_a: the sensor is stuck .* from t = 4.99\d s to 11.999 s"
    ):
        identify([replace(recording, pressure_a_pa=pa)], KNOWN)


def test_saturated_sensor_is_named_with_its_time(recording):
    full = np.arange(len(recording)) > 3000
    with pytest.raises(
        InputError, match=r"pressure_b: .* end of its range .* first at t = 3.001 s"
    ):
        identify([replace(recording, saturated_b=full)], KNOWN)


def test_recording_without_known_force_is_named(recording):
    with pytest.raises(InputError, match="reference_force"):
        identify([replace(recording, reference_force_n=None)], KNOWN)


def test_leg_without_its_second_chamber_is_named(recording):
    with pytest.raises(InputError, match=r"channels.pressure_b.*both chambers"):
        identify([replace(recording, pressure_b_pa=None)], KNOWN)


def test_a_rod_that_nobody_declares_is_found(recording):
    rodless = identify([recording], KNOWN.model_copy(update={"rod_m": None}))
    assert rodless.model.known.rod_m == pytest.approx(KNOWN.rod_m, rel=0.1)
    assert any(used.name == "rod_m" and used.declared is None for used in rodless.used)


@pytest.mark.parametrize(("plus_n", "minus_n"), [(800.0, 800.0), (900.0, 700.0), (600.0, 800.0)])
def test_beside_a_found_constant_coulomb_friction_is_as_wide_as_it_may_be_lopsided(plus_n, minus_n):
    """A zero's force takes up half the difference of both: the intervals have to hold them all the
    same, and say why they are wide.
    """
    recordings, known = oil_cylinder(plus_n, minus_n)
    found = {p.name: p for p in identify(recordings, known, "cylinder").parameters}
    for name, truth in (("coulomb_plus_n", plus_n), ("coulomb_minus_n", minus_n)):
        low, high = found[name].interval90
        assert low < truth < high < 2.0 * truth
        assert not found[name].shown and "a constant force was found beside it" in found[name].why


def test_too_little_motion_is_named():
    v = np.where(np.arange(4000) < 300, 0.01, 0.0)
    with pytest.raises(InputError, match="hardly moves"):
        identify([air_recording(FRICTION, 5, v)], KNOWN)


def test_motion_in_one_direction_only_is_named():
    with pytest.raises(InputError, match="hardly ever retracts"):
        identify([air_recording(FRICTION, 6, np.full(8000, 0.01))], KNOWN)


@pytest.mark.parametrize(
    ("change", "said"),
    [
        (lambda t: t[:20], "too few samples"),
        (
            lambda t: np.where(np.arange(len(t)) == 500, t - 0.01, t),
            "time goes backwards at row 500",
        ),
        (lambda t: np.where(np.arange(len(t)) == 500, np.nan, t), "not finite at row 500"),
    ],
)
def test_faulty_time_is_named_with_its_row(tmp_path, change, said):
    import pyarrow as pa
    import pyarrow.parquet as pq

    t = change(np.arange(0, 2, 1e-3))
    pq.write_table(
        pa.table({"t": t, "x": 0.1 + 0 * t, "p": 1e6 + 0 * t}), tmp_path / "data.parquet"
    )
    (tmp_path / "recording.yaml").write_text(
        "format: roboclimber-recording/1\nrig: cylinder\ndata: data.parquet\nsample_rate_hz: 1000\n"
        "channels:\n  time: {column: t, unit: s}\n  position: {column: x, unit: m, resolution: 0.0001}\n"
        "  pressure_a: {column: p, unit: Pa}\nknown: {bore_m: 0.07}\n"
        "reference_force: {kind: free}\n"
    )
    with pytest.raises(InputError, match=said):
        read_recording(tmp_path)


@pytest.mark.skipif(DATA is None, reason="TESTBED_DATA (a folder with recordings/) is not set")
def test_rig_without_a_missing_effect_is_predicted_to_a_per_cent_of_its_friction():
    from testbed.estimation.leg.force import estimate
    from testbed.estimation.leg.motion import signals_of

    rig = read_rig(Path(DATA) / "recordings" / "rig-01")
    found = identify_rig(rig)
    assert found.recordings == ("multisine", "ramps", "shake")
    sine = next(r for r in rig.verify if r.name == "sine")
    moving = np.abs(signals_of(sine).velocity_m_s) > 3e-3
    error = estimate(sine, found.model).force_n[moving]
    assert math.sqrt(np.mean(error**2)) < 10.0


def test_bench_gives_back_area_zero_and_coulomb_friction():
    recordings, known = bench((0.008, 0.012, 0.016))
    model = identify(recordings, known, "cylinder").model
    assert model.known.area_a_m2 == pytest.approx(1.03 * known.area_a_m2, rel=1e-3)
    assert model.force_offset_n == pytest.approx(25.0, abs=3.0)
    assert model.friction.coulomb_plus_n == pytest.approx(80.0, abs=3.0)


def test_parts_of_friction_that_one_speed_cannot_show_are_left_out():
    recordings, known = bench((0.008, 0.012, 0.016))
    found = {p.name: p for p in identify(recordings, known, "cylinder").parameters}
    assert found["viscous_plus_n_s_m"].value == 0.0 and found["stribeck_minus_n"].value == 0.0
    assert "left out" in found["viscous_plus_n_s_m"].why


@pytest.mark.skipif(DATA is None, reason="TESTBED_DATA (a folder with real/) is not set")
def test_measured_seals_are_predicted_to_six_per_mille_in_the_median():
    from testbed.estimation.leg.force import estimate
    from testbed.estimation.leg.motion import signals_of

    shares = []
    for folder in sorted((Path(DATA) / "real").glob("seal-*")):
        rig = read_rig(folder)
        model = identify_rig(rig).model
        for recording in rig.verify:
            moving = np.abs(signals_of(recording).velocity_m_s) > 3e-3
            moving = moving[: len(recording)]
            true = recording.reference_force_n[: len(moving)][moving]
            error = estimate(recording, model).force_n[: len(moving)][moving] - true
            shares.append(np.sqrt(np.mean(error**2) / np.mean(true**2)))
    assert np.median(shares) < 0.006


def oil_cylinder(
    plus_n: float,
    minus_n: float,
    bore: float = 1.0,
    levels: int = 3,
    speeds: tuple[float, ...] = (0.005, 0.01, 0.02, 0.04),
    back_pa_s_m: float = 0.0,
) -> tuple[list, Known]:
    """A cylinder of both chambers on a load cell; `bore` times the declared 70 mm, Coulomb friction
    by direction; `back_pa_s_m`: how much pressure B rises with the speed at which it retracts.
    """
    known = KNOWN.model_copy(update={"inclination_deg": 90.0, "moving_mass_kg": None})
    area_a = bore**2 * known.area_a_m2
    area_b = area_a - (known.area_a_m2 - known.area_b_m2)
    out = []
    for k in range(levels):
        rng = np.random.default_rng([0, k])
        v = speed_profile(speeds, longest_s=2.0, travel_m=0.02)
        t = np.arange(v.size) * 1e-3
        pb = 1.5e6 + 4e5 * np.sin(0.7 * t) + 3e5 * (v < 0) + back_pa_s_m * np.maximum(-v, 0.0)
        pa = 4e6 + 2e6 * k + 1e6 * np.sin(0.4 * t + k) + 5e5 * (v > 0)
        friction = np.where(v > 0, plus_n, np.where(v < 0, -minus_n, 0.0)) + 3000.0 * v
        force = pa * area_a - pb * area_b - friction + rng.normal(0.0, 20.0, t.size)
        x = 0.2 + np.cumsum(v) * 1e-3
        one = recording_of(t, x, pa, pb, force, known, "load-cell")
        header = one.header.model_copy(update={"rig": "cylinder"})
        out.append(replace(one, name=f"level{k}", header=header))
    return out, known


@pytest.mark.parametrize(("plus_n", "minus_n"), [(800.0, 800.0), (1500.0, 300.0), (300.0, 1500.0)])
@pytest.mark.parametrize("levels", [1, 3])
@pytest.mark.slow
def test_a_right_bore_stays_within_its_tolerance_however_lopsided_friction_is(
    plus_n: float, minus_n: float, levels: int
) -> None:
    recordings, known = oil_cylinder(plus_n, minus_n, levels=levels)
    found = identify(recordings, known, "cylinder")
    assert found.model.known.bore_m == pytest.approx(known.bore_m, rel=0.003)
    assert all(u.tolerances_off < 0.2 for u in found.used if u.tolerances_off is not None)
    # The difference of the Coulomb levels and a zero are one number in motion.
    friction, zero = found.model.friction, found.model.force_offset_n
    lopsided = 0.5 * (friction.coulomb_plus_n - friction.coulomb_minus_n) - zero
    assert lopsided == pytest.approx(0.5 * (plus_n - minus_n), abs=40.0)


def test_a_bore_that_is_off_moves_within_its_tolerance_and_says_so() -> None:
    from testbed.report.console import identification_shown

    recordings, known = oil_cylinder(800.0, 600.0, bore=1.015)
    found = identify(recordings, known, "cylinder")
    bore = next(u for u in found.used if u.name == "bore_m")
    assert found.model.known.bore_m == bore.used == pytest.approx(1.015 * known.bore_m, rel=0.003)
    assert bore.tolerances_off == pytest.approx(0.75, abs=0.15) and not bore.at_bound
    table, *lines = identification_shown(found)
    said = "\n".join(map(str, [table, *lines]))
    assert "bore_m: declared 0.07 m, used 0.0710" in said and "force_offset_n" in said
    assert "bore_m: declared 0.07 m" in str(found.model.description)
    assert found.tree()["declared"]["bore_m"]["declared"] == 0.07


def test_a_back_pressure_that_grows_with_the_speed_is_no_other_rod() -> None:
    recordings, known = oil_cylinder(
        600.0, 600.0, speeds=(0.012, 0.02, 0.05), back_pa_s_m=2.4e7, bore=1.01
    )
    used = {one.name: one for one in identify(recordings, known, "cylinder").used}
    assert used["rod_m"].used == known.rod_m
    assert used["bore_m"].used == pytest.approx(1.01 * known.bore_m, rel=0.002)


def test_a_narrow_tolerance_holds_a_declared_bore_against_the_data() -> None:
    recordings, known = oil_cylinder(800.0, 600.0, bore=1.1)
    found = identify(
        recordings, known.model_copy(update={"tolerances": {"bore_m": 0.01}}), "cylinder"
    )
    bore = next(u for u in found.used if u.name == "bore_m")
    assert bore.at_bound and "contradict" in str(bore)
    assert bore.used <= 1.03 * 0.07 + 1e-9


@pytest.mark.slow
@pytest.mark.parametrize("turned", ["reference_force_n", "position_m", "pressure_a_pa"])
def test_a_force_or_position_turned_round_is_one_line_and_no_fault_of_mathematics(
    turned: str,
) -> None:
    recordings, known = oil_cylinder(800.0, 600.0)
    wrong = [replace(r, **{turned: -getattr(r, turned)}) for r in recordings]
    with np.errstate(invalid="raise"), pytest.raises(InputError, match="testbed check says which"):
        identify(wrong, known, "cylinder")


def test_a_lag_that_drives_the_fastest_rows_is_no_sign_turned_round() -> None:
    """Friction of 300 N, and a sensor whose lag puts more power in where the piston is fastest."""
    velocity = 0.2 * np.sin(np.linspace(0.0, 20.0 * np.pi, 4000)) ** 3
    lagging = 3e4 * velocity * np.abs(velocity)
    left = 300.0 * np.sign(velocity) - lagging
    assert np.mean(left * velocity) < 0.0
    check_opposes(velocity, left)
    with pytest.raises(InputError, match="drive the piston"):
        check_opposes(velocity, -300.0 * np.sign(velocity))


def test_recordings_that_go_one_way_each_foretell_the_other_way_without_a_constant_force() -> None:
    """Beside rows of one way any constant force is friction: 1e8 N were foretold for the other."""
    rng, nothing = np.random.default_rng(0), np.zeros(200)
    out = np.arange(200) < 100
    velocity = np.where(out, 1.0, -1.0) * rng.uniform(0.01, 0.2, 200)
    force = 100.0 * np.sign(velocity) + 1000.0 * velocity + 30.0 + rng.normal(0.0, 1.0, 200)
    rows = Evidence(velocity, force, nothing, nothing, nothing, np.where(out, 0, 1))
    constant = Unknown("force_offset_n", np.ones(200))
    form, squares = choose_form(rows, [constant])
    assert form == "viscous" and np.sqrt(squares / 200) < 1.5
