"""The live chain: the paper's equations by hand, the friction set, contact states, speed."""

import math
import time

import numpy as np
import pytest
from shipped import MACHINE

from testbed.errors import InputError
from testbed.estimation.cylinder import Conditions, friction_set, friction_value, stribeck_of
from testbed.estimation.detectors.sample import valves_of
from testbed.estimation.live import contact, encoder
from testbed.estimation.live.believed import Believed, Leg, Tuning
from testbed.estimation.live.chain import EstimatorChain
from testbed.estimation.live.joined import forces, replay, replay_rows
from testbed.estimation.live.whole_body import gravity_in_body
from testbed.machine.names import LEGS
from testbed.recording.leg_model import EffectEntry, Friction
from testbed.recording.rows import DataRow

AREA_A = 0.25 * math.pi * 0.07**2
AREA_B = AREA_A - 0.25 * math.pi * 0.04**2
FRICTION = Friction(
    viscous_plus_n_s_m=5000.0,
    coulomb_plus_n=600.0,
    stribeck_plus_n=200.0,
    stribeck_speed_plus_m_s=0.007,
    viscous_minus_n_s_m=4000.0,
    coulomb_minus_n=500.0,
    stribeck_minus_n=150.0,
    stribeck_speed_minus_m_s=0.008,
)
VALVES = valves_of(MACHINE)
FIVE = stribeck_of(FRICTION)[0]
PLAIN = Conditions(1.0, 0.0, 1.0, 0.0)


def believed(**changes):
    leg = Leg(AREA_A, AREA_B, FRICTION, **changes)
    return Believed((leg, leg, leg, leg), VALVES)


def measured(pressure_a=4.0e6, pressure_b=2.0e6, position=0.1, pitch=0.0):
    """One row of data before it is estimated."""
    row = DataRow.zeros()
    row["pressure_a"], row["pressure_b"], row["position"] = pressure_a, pressure_b, position
    row["attitude"][0, 1] = pitch
    row["oil_temperature"], row["supply_pressure"], row["carrying"] = 20.0, 9.0e6, 1.0
    return row


def estimated(believed, row):
    """The same row after one step of a fresh chain; its estimates by name."""
    EstimatorChain(believed).step(row)
    return row["estimate"][0]


def air_motion(speed, seconds=6.0, pb=2.0e6, load=None):
    """Columns of a robot recording whose four vertical joints move with `speed(t)` against
    `load(t)`.
    """
    t = np.arange(0.0, seconds, 1e-3)
    v = speed(t)
    x = 0.25 + np.cumsum(v) * 1e-3
    f = np.array([friction_value(w, FIVE, PLAIN) for w in v])
    external = np.zeros_like(t) if load is None else load(t)
    pa = (external + pb * AREA_B + f - 91.7 * 9.81 + 91.7 * np.gradient(v, 1e-3)) / AREA_A
    columns = {"t": t, "attitude_roll": 0 * t, "attitude_pitch": 0 * t}
    for leg in LEGS:
        columns[f"pressure_a_{leg}_vertical"] = pa
        columns[f"pressure_b_{leg}_vertical"] = np.full_like(t, pb)
        columns[f"position_{leg}_vertical"] = np.round(x / 1e-4) * 1e-4
    return columns, v, external


def test_one_and_two_chamber_forces_equal_pressure_times_area():
    # 4 MPa on 38.48 cm2 = 15394 N; 2 MPa on 25.92 cm2 = 5184 N
    estimate = estimated(believed(), measured())
    assert estimate["one_chamber"] == pytest.approx(np.full(4, 15393.80), abs=0.01)
    assert estimate["two_chamber"] == pytest.approx(np.full(4, 10210.18), abs=0.01)


def test_only_the_vertical_joints_are_read():
    estimate = estimated(believed(), measured(np.arange(12) * 1e5, 0.0))
    assert estimate["one_chamber"] == pytest.approx(np.array([2, 5, 8, 11]) * 1e5 * AREA_A)


@pytest.mark.parametrize("slope_deg", [0.0, 30.0, 45.0, 80.0])
def test_frame_weight_counts_with_the_cosine_of_the_slope(slope_deg):
    estimate = estimated(believed(), measured(1e6, 1e6, pitch=-math.radians(slope_deg)))
    weight = estimate["friction"] - estimate["two_chamber"]
    assert weight == pytest.approx(
        np.full(4, 91.7 * 9.81 * math.cos(math.radians(slope_deg))), abs=1e-6
    )


def test_gravity_points_downhill_on_a_slope_that_rises_towards_x():
    g = np.empty(3)
    gravity_in_body(np.array([0.0, -math.radians(30.0), 0.0]), 9.81, g)
    assert g == pytest.approx([-4.905, 0.0, -8.4957], abs=1e-4)


def test_roll_to_the_right_tilts_gravity_to_the_right():
    # positive roll turns y (left) upwards, so that gravity leans towards -y
    g = np.empty(3)
    gravity_in_body(np.array([0.1, 0.0, 0.0]), 9.81, g)
    assert g[1] == pytest.approx(-9.81 * math.sin(0.1))


def test_friction_of_equation_5_equals_the_hand_computed_value():
    # 5000 * 0.02 + 600 + 200 exp(-0.02 / 0.007) = 711.49; -(4000 * 0.02 + 500 + 150 exp(-2.5)) =
    # -592.31
    assert friction_value(0.02, FIVE, PLAIN) == pytest.approx(711.487, abs=1e-3)
    assert friction_value(-0.02, FIVE, PLAIN) == pytest.approx(-592.313, abs=1e-3)
    assert friction_value(0.0, FIVE, PLAIN) == 0.0


def test_friction_at_rest_is_the_set_between_both_break_away_forces():
    assert friction_set(0.0, 1.0, 0.0, FIVE, PLAIN) == pytest.approx((-650.0, 800.0))
    low, high = friction_set(0.02, 1.0, 1.0, FIVE, PLAIN)
    assert low == high == pytest.approx(711.487, abs=1e-3)


def test_encoder_observer_follows_a_constant_speed_within_two_mm_s():
    s = encoder.EncoderState.zeros()[0]
    speeds = []
    for k in range(4000):
        encoder.observe(s, round(0.005 * k * 1e-3 / 1e-4) * 1e-4, 1e-4, 1e-3, 60.0)
        speeds.append(s["speed"])
    assert np.abs(np.array(speeds[1000:]) - 0.005).max() < 0.002
    assert encoder.sliding(s, 1e-4, 0.001, 0.003) == 1.0


def test_one_count_to_and_fro_is_rest():
    s = encoder.EncoderState.zeros()[0]
    for k in range(400):
        encoder.observe(s, 1e-4 * (k // 20 % 2), 1e-4, 1e-3, 60.0)
        assert encoder.sliding(s, 1e-4, 0.001, 0.003) == 0.0


def test_silent_encoder_reads_as_exactly_no_speed():
    s = encoder.EncoderState.zeros()[0]
    for k in range(600):
        encoder.observe(s, round(min(0.02 * k * 1e-3, 0.002) / 1e-4) * 1e-4, 1e-4, 1e-3, 60.0)
    assert encoder.bounded_speed(s, 1e-4, 0.001) == 0.0


def test_in_the_air_the_load_is_zero_while_the_joint_moves():
    columns, v, _ = air_motion(lambda t: 0.06 * np.sin(2 * np.pi * 0.4 * t))
    out = replay(columns, believed())
    moving = (np.abs(v) > 0.01) & (columns["t"] > 1.0)
    assert np.sqrt(np.mean(out["estimate_own_fl"][moving] ** 2)) < 40.0
    assert np.sqrt(np.mean(out["estimate_one_chamber_fl"][moving] ** 2)) > 1000.0


def test_hidden_load_change_at_rest_stays_inside_the_set():
    columns, _, load = air_motion(
        lambda t: np.where(t < 2.0, 0.03, 0.0),
        4.0,
        load=lambda t: np.where(t < 3.0, 4000.0, 3000.0),
    )
    for leg in LEGS:  # friction takes the whole change: the pressures do not move
        columns[f"pressure_a_{leg}_vertical"][3000:] = columns[f"pressure_a_{leg}_vertical"][2999]
        columns[f"pressure_a_{leg}_vertical"][2000:] -= 100.0 / AREA_A
    out = replay(columns, believed())
    at_rest = slice(2300, 4000)
    assert np.all(out["own_low_rr"][at_rest] <= load[at_rest])
    assert np.all(out["own_high_rr"][at_rest] >= load[at_rest] - 1e-6)
    width = out["own_high_rr"][3500] - out["own_low_rr"][3500]
    assert width == pytest.approx(1450.0)
    assert out["own_sd_rr"][3500] > 0.4 * 725.0


def test_chain_follows_a_true_step_that_locks_the_modified_filter_out():
    columns, _, load = air_motion(
        lambda t: 0.03 + 0 * t, 4.0, load=lambda t: np.where(t < 2.0, 8000.0, 0.0)
    )
    out = replay(columns, believed())
    assert np.all(out["estimate_modified_kbf_fl"][2000:] > 7000.0)
    assert abs(out["estimate_own_fl"][2050] - load[2050]) < 60.0


def contact_states(load, first, settled=np.inf):
    """Contact states over loads (n,), N, with an upper limit of 1500 and a lower one of 700 N, 20
    ms each; `settled`: that of the mean load over half a second.
    """
    limits = contact.ContactLimits.one(
        **{"on": 1500.0, "off": 700.0, "dwell_on": 0.02, "dwell_off": 0.02},
        **{"sure": 6000.0, "dwell_sure": 0.005, "settled": settled, "settling": 0.5},
    )[0]
    state = contact.ContactState.one(contact=first, since=0.0, surely=0.0, mean=0.0)[0]
    return np.array([contact.step(state, value, 1e-3, limits) for value in load])


def test_contact_state_changes_after_its_dwell_and_not_before():
    load = np.concatenate([np.full(100, 5000.0), np.full(100, 0.0)])
    states = contact_states(load, 0.0)
    assert states[18] == 0.0 and states[19] == 1.0
    assert states[118] == 1.0 and states[119] == 0.0


def test_a_load_beyond_doubt_is_contact_sooner():
    states = contact_states(np.full(100, 6500.0), 0.0)
    assert states[3] == 0.0 and states[4] == 1.0
    tapped = np.tile(np.append(np.full(4, 6500.0), 0.0), 20)
    assert np.all(contact_states(tapped, 0.0) == 0.0)


def test_load_between_both_thresholds_keeps_the_contact_state():
    middle = np.full(500, 1000.0)
    assert np.all(contact_states(middle, 1.0) == 1.0)
    assert np.all(contact_states(middle, 0.0) == 0.0)


def test_a_load_that_stays_in_between_is_contact_once_its_mean_since_the_loss_is_high_enough():
    """The mean of 900 N since nothing reaches 800 N after ln 9 time constants; a gap in the
    readings stops it, and one that was loaded before tells nothing.
    """
    middle = np.full(2000, 900.0)
    assert np.flatnonzero(contact_states(middle, 0.0, 800.0))[0] == pytest.approx(1098, abs=3)
    assert np.all(contact_states(middle, 0.0, 950.0) == 0.0)
    gap = np.concatenate([np.full(500, 900.0), np.full(500, np.nan), middle])
    assert np.flatnonzero(contact_states(gap, 0.0, 800.0))[0] == pytest.approx(1598, abs=3)
    lost = np.concatenate([np.full(3000, 5000.0), np.full(20, 0.0), middle])
    states = contact_states(lost, 1.0, 800.0)
    assert np.all(states[3020:4000] == 0.0) and states[-1] == 1.0


def test_replay_equals_the_live_steps():
    columns, _, _ = air_motion(lambda t: 0.05 * np.sin(2 * np.pi * 0.5 * t), 1.0)
    b = believed()
    whole, chain = replay_rows(columns, b), EstimatorChain(b)
    row = measured()
    for k in range(1000):
        for stem in ("pressure_a", "pressure_b", "position"):
            row[stem][0, 2::3] = columns[f"{stem}_fl_vertical"][k]
        chain.step(row)
    for name in ("estimate", "estimate_own", "own", "contact"):
        assert whole[name][-1].tobytes() == row[name][0].tobytes()


def test_believed_gain_error_is_taken_out():
    effect = EffectEntry(name="sensor.gain_a", parameters={"gain_error": 0.05}, place="fr")
    b = believed()
    legs = tuple(leg.with_effect(effect) if i == 1 else leg for i, leg in enumerate(b.legs))
    row = measured()
    row["pressure_a"][0, 5] *= 1.05
    assert estimated(Believed(legs, VALVES), row)["one_chamber"] == pytest.approx(
        np.full(4, 4.0e6 * AREA_A)
    )


def test_forces_of_a_robot_recording_have_value_and_set_per_leg():
    columns, _, _ = air_motion(lambda t: 0.03 + 0 * t, 0.5)
    out = forces(columns, believed())
    assert list(out)[:4] == ["t", "force_fl_n", "force_fl_n_low", "force_fl_n_high"]
    assert len(out) == 13


def test_missing_column_is_named():
    columns, _, _ = air_motion(lambda t: 0 * t, 0.1)
    del columns["pressure_b_rl_vertical"]
    with pytest.raises(InputError, match="pressure_b_rl_vertical"):
        replay(columns, believed())


def test_chain_refuses_a_step_that_is_not_positive():
    leg = Leg(AREA_A, AREA_B, FRICTION)
    with pytest.raises(InputError, match="dt_s"):
        Believed((leg, leg, leg, leg), VALVES, dt_s=0.0)


def test_step_of_four_legs_with_their_contact_states_takes_less_than_thirty_microseconds():
    chain = EstimatorChain(Believed(believed().legs, VALVES, tuning=Tuning()))
    row = measured()
    chain.step(row)
    best = math.inf
    for _ in range(10):
        start = time.perf_counter()
        for _ in range(2000):
            chain.step(row)
        best = min(best, (time.perf_counter() - start) / 2000)
    assert best < 30e-6  # what a step of four feet may take; on a fast, quiet machine it is 5 to 8


@pytest.mark.parametrize("stem", ["pressure_a", "pressure_b", "position"])
def test_lost_sample_leaves_no_trace_in_later_estimates(stem):
    columns, _, _ = air_motion(lambda t: 0.05 * np.sin(2 * np.pi * 0.5 * t), 2.0)
    whole = replay(columns, believed())
    columns[f"{stem}_fl_vertical"][500:503] = np.nan
    out = replay(columns, believed())
    assert np.isfinite(out["estimate_own_fl"]).all() and np.isfinite(out["estimate_kbf_fl"]).all()
    assert out["estimate_own_fl"][-1] == pytest.approx(whole["estimate_own_fl"][-1], abs=1.0)
