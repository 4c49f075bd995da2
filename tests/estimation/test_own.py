"""The whole-body estimate: its geometry against Pinocchio's, its balance against the statics, what
it learns from what.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from shipped import shipped_model

from testbed.estimation.live import axis, body_records, faulty_sensor, unknowns, whole_body, wrench
from testbed.estimation.live.axis import AxisState
from testbed.estimation.live.believed import Believed
from testbed.estimation.live.body_belief import body_of
from testbed.estimation.live.chain import EstimatorChain
from testbed.estimation.live.fusion import Fusion, observe, predict, start, stay_in_sets
from testbed.estimation.live.own_tuning import OwnTuning
from testbed.estimation.live.payload_aboard import free_payload
from testbed.estimation.live.uncertainty import Uncertainty, constants
from testbed.estimation.live.unknowns import Constants
from testbed.machine.build import build_machine
from testbed.machine.names import LEGS, VERTICAL
from testbed.recording.rows import DataRow, DrillKnown
from testbed.robot.linkage import Linkages
from testbed.robot.loads.foot_loads import ExpectedLoads, known_wrench, point_wrench
from testbed.robot.model import attitude_gravity
from testbed.robot.rope_bearings import NO_ROPES, SurveyedRopes

MODEL, MACHINE = shipped_model(), build_machine()
LINKAGES = Linkages.from_machine(MACHINE)
BELIEF = Believed.from_machine(MACHINE, 1e-3)
LEVEL = attitude_gravity(0.0, 0.0)
STANCE = np.tile([0.1, 0.2, 0.25], 4)
NO_PAYLOAD = (0.0, 0.0, 0.0)
AREA_A, AREA_B = BELIEF.legs[0].area_a_m2, BELIEF.legs[0].area_b_m2


def body(tuning: OwnTuning | None = None) -> np.ndarray:
    return body_of(MACHINE, MODEL, BELIEF.legs, 1e-3, NO_ROPES, tuning)


def arms(q: np.ndarray) -> np.ndarray:
    return LINKAGES.rods(q)[1]


def standing(
    lies: dict[int, float] | None = None, vertical_b_pa: float = 2e6
) -> tuple[np.ndarray, np.ndarray]:
    """Pressures (12,) with which the machine stands still without friction; `lies`: axis -> N that
    its sensors add.
    """
    loads = ExpectedLoads(MODEL, MACHINE).solve(STANCE, LEVEL, joint_compliance=np.zeros(12))
    _, jacobians = MODEL.feet(STANCE)
    torque = MODEL.gravity_forces(STANCE, LEVEL)[6:] - np.einsum(
        "ki,kij->j", loads.force_in_body_n, jacobians
    )
    force = torque / arms(STANCE)
    pa, pb = np.empty(12), np.full(12, vertical_b_pa)
    cylinders = body()["axes"]["cylinder"][0]
    for i in range(12):
        force[i] += (lies or {}).get(i, 0.0)
        pa[i] = (force[i] + pb[i] * cylinders["area_b"][i]) / cylinders["area_a"][i]
    return pa, pb


def standing_row(lies: dict[int, float] | None = None) -> np.ndarray:
    """A row of data (1,) of the still machine, not yet estimated."""
    row = DataRow.zeros()
    row["pressure_a"], row["pressure_b"] = standing(lies)
    row["position"], row["specific_force"] = STANCE, -LEVEL
    row["oil_temperature"], row["supply_pressure"], row["carrying"] = 40.0, 9.0e6, 1.0
    return row


def settled(
    tuning: OwnTuning, lies: dict[int, float] | None = None, steps: int = 4000
) -> tuple[EstimatorChain, np.ndarray]:
    """A chain that has seen the still machine for so many steps, and its row."""
    chain, row = EstimatorChain(replace(BELIEF, body=body(tuning))), standing_row(lies)
    for _ in range(steps):
        chain.step(row)
    return chain, row


def test_map_from_cylinders_to_foot_is_the_inverse_of_pinocchios_jacobian() -> None:
    rng = np.random.default_rng(1)
    legs = MODEL.leg_numbers()
    for _ in range(10):
        q = rng.uniform(*MODEL.limits.T)
        _, jacobians = MODEL.feet(q)
        for k in range(4):
            found = np.empty((3, 3))
            wrench.leg_map(legs[k], q[3 * k : 3 * k + 3], arms(q)[3 * k : 3 * k + 3], found)
            # tau = -J^T F, cylinder forces f = tau / arm
            j = jacobians[k][:, 3 * k : 3 * k + 3]
            expected = -np.linalg.inv(j.T) @ np.diag(arms(q)[3 * k : 3 * k + 3])
            np.testing.assert_allclose(found, expected, atol=1e-9)


def test_feet_stand_where_pinocchio_has_them() -> None:
    q = np.random.default_rng(2).uniform(*MODEL.limits.T)
    numbers, legs, point = body(), MODEL.leg_numbers(), np.empty(3)
    for k in range(4):
        wrench.foot_point(legs[k], q[3 * k : 3 * k + 3], numbers["foot_height"][0, k], point)
        np.testing.assert_allclose(point, MODEL.foot_positions_m(q)[k], atol=1e-12)


def test_weight_ropes_and_drill_make_the_wrench_of_the_statics() -> None:
    q = np.random.default_rng(3).uniform(*MODEL.limits.T)
    gravity = attitude_gravity(0.05, -0.6)
    ropes = np.array([[0.98, 0.17, 0.1], [0.98, -0.17, 0.1]])
    ropes /= np.linalg.norm(ropes, axis=1)[:, None]
    drill = np.array([5e3, -300.0, 40.0, 20.0, 1.5, -60.0])
    row, view = DataRow.zeros(), wrench.View(np.eye(3), gravity, -gravity)
    row["position"] = q
    for name, value in zip(DrillKnown.fields, drill, strict=True):
        row[name] = value
    numbers = body_of(MACHINE, MODEL, BELIEF.legs, 1e-3, SurveyedRopes.leading(ropes))
    tension = np.array([9e3, 8e3])
    found = wrench.other_wrench(row[0], view, np.zeros(3), wrench.Pulls(tension, ropes), numbers[0])
    expected = -MODEL.gravity_forces(q, gravity)[:6]
    for k in range(2):
        expected += point_wrench(tension[k] * ropes[k], MODEL.rope_attachments_m[k])
    expected += known_wrench(MODEL, np.array([tuple(drill)], DrillKnown.dtype)[0], gravity)
    np.testing.assert_allclose(found, expected, atol=1e-6)


def test_a_still_machine_is_read_as_the_statics_have_it() -> None:
    found = settled(OwnTuning())[1]["own"][0]
    true = (
        ExpectedLoads(MODEL, MACHINE)
        .solve(STANCE, LEVEL, joint_compliance=np.zeros(12))
        .force_in_body_n
    )
    for r, name in enumerate("xyz"):
        # the middle of friction's set is not 0: what is left is inside its standard deviation
        off = np.abs(found[name] - true[:, r])
        assert (off < 1.5 * found[f"{name}_sd"]).all() and off.max() < 150.0


REACH = np.array([0.75, 0.35])
"""Half of the platform, m."""


def looked_at(lie_n: float = 0.0, payload: tuple[float, float, float] = NO_PAYLOAD) -> np.void:
    """A filter that has looked for 3 s at most at a balance that one foot's sensors upset, or a
    weight (kg) at x and y (m). It knows the mass to 50 kg, its first moment to 30 kg m.
    """
    filter_ = started(zero_sd=100.0, spread=160.0, balance_sd=200.0, mass_sd=50.0)
    filter_["suspicion"]["memory"], filter_["suspicion"]["threshold"] = 1.0, 2.5
    rows, variance = np.zeros((6, unknowns.COUNT)), np.full(6, 300.0**2)
    for leg, (x, y) in enumerate(((1.0, 1.0), (1.0, -1.0), (-1.0, 1.0), (-1.0, -1.0))):
        for part in (unknowns.ZERO, unknowns.DEVIATION):
            rows[2:5, part + 3 * leg + 2] = 1.0, y, -x
    for k in range(6):
        rows[k, unknowns.BALANCE + k] = 1.0
    rows[2, unknowns.MASS], rows[3, unknowns.MOMENT + 1], rows[4, unknowns.MOMENT] = -9.8, -9.8, 9.8
    mass, x, y = payload
    weight = mass * (
        rows[:, unknowns.MASS] + x * rows[:, unknowns.MOMENT] + y * rows[:, unknowns.MOMENT + 1]
    )
    for _ in range(300):
        if not filter_["blamed"].any() and filter_["suspicion"]["known"][unknowns.MASS] <= 50.0:
            missing = lie_n * rows[:, unknowns.ZERO + 2] + weight
            faulty_sensor.take_balance(rows, missing, variance, REACH, filter_)
    return filter_


def test_a_sensor_that_the_balance_points_at_carries_the_blame_alone() -> None:
    lying, sound = looked_at(2500.0), looked_at(400.0)
    assert lying["blamed"][2] == pytest.approx(2500.0, rel=0.1)
    assert np.count_nonzero(lying["blamed"]) == 1
    assert lying["p"][unknowns.ZERO + 2, unknowns.ZERO + 2] > 2000.0**2
    assert not sound["blamed"].any()


def test_a_sensor_is_not_blamed_at_rest() -> None:
    """Four pistons at rest may hide as much all the same way."""
    row = settled(OwnTuning(), {LEGS.index("fl") * 3 + 2: 4000.0})[0]
    assert not row.state["body"]["fusion"]["blamed"].any()


@pytest.mark.parametrize("place", [(0.0, 0.0), (0.2, -0.1), (-0.4, 0.2)])
def test_a_weight_between_the_feet_is_told_from_a_sensor_that_lies(
    place: tuple[float, float],
) -> None:
    """No sensor is blamed, and mass and first moment may be off by as much."""
    found = looked_at(payload=(600.0, *place))
    assert not found["blamed"].any()
    assert found["p"][unknowns.MASS, unknowns.MASS] ** 0.5 == pytest.approx(600.0, rel=0.1)
    assert found["p"][unknowns.MOMENT, unknowns.MOMENT] > 300.0**2
    sound = looked_at(payload=(60.0, *place))
    assert sound["p"][unknowns.MASS, unknowns.MASS] == pytest.approx(50.0**2)


def test_what_was_learnt_before_a_weight_was_seen_is_forgotten() -> None:
    filter_ = started(zero_sd=100.0, spread=160.0, balance_sd=200.0, mass_sd=50.0)
    filter_["x"][unknowns.ZERO + 2], filter_["p"][unknowns.ZERO + 2, unknowns.ZERO + 2] = (
        300.0,
        20.0**2,
    )
    free_payload(np.array([40.0, 600.0, 0.0, 0.0]), REACH, filter_)
    assert filter_["x"][unknowns.ZERO + 2] == 0.0
    assert filter_["p"][unknowns.ZERO + 2, unknowns.ZERO + 2] == pytest.approx(100.0**2)


def started(zero_sd: float, spread: float, balance_sd: float, mass_sd: float = 0.0) -> np.void:
    """A filter that knows nothing beyond these sizes; first moments to 0.6 m of the mass's."""
    filter_ = Fusion.zeros()[0]
    sizes = filter_["sizes"]
    sizes["zero_sd"], sizes["spread"], sizes["balance_sd"] = zero_sd, spread, balance_sd
    sizes["keep"], sizes["balance_keep"], sizes["dt"] = 1.0, 1.0, 0.01
    known = np.zeros(len(unknowns.CONSTANTS))
    known[unknowns.MASS], known[unknowns.MOMENT : unknowns.MOMENT + 3] = mass_sd, 0.6 * mass_sd
    start(filter_, known)
    return filter_


def test_a_foot_that_moves_both_ways_in_the_air_tells_the_zero_from_friction() -> None:
    """A zero of 150 N, and friction 30 N more than believed, against the motion."""
    filter_ = started(zero_sd=200.0, spread=50.0, balance_sd=200.0)
    h, x, p = np.zeros(unknowns.COUNT), filter_["x"], filter_["p"]
    h[unknowns.ZERO + 2] = h[unknowns.DEVIATION + 2] = 1.0
    for _ in range(50):  # extending: friction 30 N more than believed; then retracting: 30 N less
        observe(filter_, h, 180.0, 400.0, 1e9, True)
    # the piston has turned: what friction deviated by is forgotten, the zero stays
    filter_["sizes"]["keep"][2] = 0.0
    predict(filter_)
    for _ in range(50):
        observe(filter_, h, 120.0, 400.0, 1e9, True)
    assert x[unknowns.ZERO + 2] == pytest.approx(150.0, abs=15.0)
    assert np.sqrt(p[unknowns.ZERO + 2, unknowns.ZERO + 2]) < 45.0


def test_one_observation_is_the_textbook_kalman_update() -> None:
    filter_ = started(zero_sd=3.0, spread=4.0, balance_sd=1.0)
    h, x, p = np.zeros(unknowns.COUNT), filter_["x"], filter_["p"]
    zero, friction = unknowns.ZERO, unknowns.DEVIATION
    h[zero] = h[friction] = 1.0  # variances 9 and 16, noise 25: gain 9 / 50 and 16 / 50
    observe(filter_, h, 10.0, 25.0, 1e9, True)
    assert x[zero] == pytest.approx(1.8) and x[friction] == pytest.approx(3.2)
    assert p[zero, zero] == pytest.approx(9.0 - 81.0 / 50.0)
    assert p[zero, friction] == pytest.approx(-9.0 * 16.0 / 50.0)


@pytest.mark.parametrize(("learns", "left"), [(True, (0.82, -0.32)), (False, (1.0, -0.32))])
def test_what_a_constant_makes_of_the_variance_is_what_the_gains_leave_of_it(
    learns: bool, left: tuple[float, float]
) -> None:
    """A zero's variance 9, friction's 16, noise 25: of the zero's error 1 - gain is left in it, and
    less the gain goes to friction. Then friction forgets three quarters.
    """
    filter_ = started(zero_sd=3.0, spread=4.0, balance_sd=1.0)
    h, fixed, places = (
        np.zeros(unknowns.COUNT),
        filter_["fixed"],
        [unknowns.ZERO, unknowns.DEVIATION],
    )
    h[places] = 1.0
    observe(filter_, h, 10.0, 25.0, 1e9, learns)
    np.testing.assert_allclose(fixed[np.ix_(places, places)], 9.0 * np.outer(left, left))
    filter_["sizes"]["keep"][0] = 0.25
    predict(filter_)
    faded = np.array([left[0], 0.25 * left[1]])
    np.testing.assert_allclose(fixed[np.ix_(places, places)], 9.0 * np.outer(faded, faded))


def test_where_friction_and_the_balance_are_exact_the_constants_make_all_of_the_variance() -> None:
    filter_ = started(zero_sd=3.0, spread=0.0, balance_sd=0.0)
    h = np.zeros(unknowns.COUNT)
    h[[unknowns.ZERO, unknowns.ZERO + 1, unknowns.DEVIATION]] = 1.0, -2.0, 1.0
    for _ in range(3):
        observe(filter_, h, 5.0, 1e-9, 1e9, True)
    np.testing.assert_allclose(filter_["fixed"], filter_["p"], atol=1e-6)


def test_what_leaves_its_set_goes_to_a_zero_that_is_set_free_and_to_no_other_constant() -> None:
    filter_ = started(zero_sd=30.0, spread=40.0, balance_sd=1.0)
    filter_["blamed"][0] = 30.0
    filter_["p"][unknowns.MASS, unknowns.MASS] = 100.0
    filter_["sizes"]["low"], filter_["sizes"]["high"] = -10.0, 10.0
    h, x = np.zeros(unknowns.COUNT), filter_["x"]
    h[unknowns.ZERO] = h[unknowns.DEVIATION] = h[unknowns.MASS] = 1.0
    observe(filter_, h, 50.0, 1e-3, 1e9, False)
    stay_in_sets(filter_)
    assert x[unknowns.MASS] == 0.0
    assert x[unknowns.DEVIATION] == pytest.approx(10.0)
    explained = 50.0 * 2500.0 / 2600.0  # the mass, of variance 100, may be the rest
    assert x[unknowns.ZERO] + x[unknowns.DEVIATION] == pytest.approx(explained, abs=3.0)


def test_rows_of_the_balance_are_what_a_wrong_belief_does_to_the_wrench() -> None:
    """Every constant of weight, unit and ropes: believed off by a little, against its row."""
    gravity, row, state = (
        attitude_gravity(0.05, -0.6),
        DataRow.zeros(),
        body_records.BodyState.zeros(),
    )
    ropes = np.array([[0.6, 0.17, 0.75], [0.6, -0.17, 0.75]])
    ropes /= np.linalg.norm(ropes, axis=1)[:, None]
    row["position"], row["attitude"] = STANCE, (0.05, -0.6, 0.2)
    state["means"]["specific_force"], state["means"]["rope_tension"] = -gravity, (9e3, 8e3)
    numbers = body_of(MACHINE, MODEL, BELIEF.legs, 1e-3, SurveyedRopes.leading(ropes))
    state["ropes"]["direction"] = ropes
    rows, turning = np.zeros((6, unknowns.COUNT)), np.zeros(3)
    right = whole_body.write_body_wrench(row[0], turning, numbers[0], state[0], rows)

    def off(**changes: object) -> np.ndarray:
        other, again = numbers.copy(), np.zeros((6, unknowns.COUNT))
        for name, value in changes.items():
            other[name] = value
        return whole_body.write_body_wrench(row[0], turning, other[0], state[0], again) - right

    lighter = off(base_mass=numbers["base_mass"] - 10.0)  # at its centre
    centre = numbers["base_centre"][0]
    moment = sum(10.0 * centre[k] * rows[:, unknowns.MOMENT + k] for k in range(3))
    np.testing.assert_allclose(lighter, 10.0 * rows[:, unknowns.MASS] + moment, atol=1e-6)
    np.testing.assert_allclose(
        off(unit_pitch=-1e-4), 1e-4 * rows[:, unknowns.UNIT + 1], rtol=0.02, atol=2e-3
    )
    lower = numbers["rope_point"].copy()
    lower[0, 1, 2] -= 0.01
    np.testing.assert_allclose(
        off(rope_point=lower), 0.01 * rows[:, unknowns.ROPE_HEIGHT + 1], atol=1e-6
    )


def test_the_workshops_tolerances_make_the_widths() -> None:
    known = constants(Uncertainty("workshop"), MACHINE)[0]
    assert known["unit"][0] == pytest.approx(0.018 / 24.0**0.5)
    assert known["side"][2] == pytest.approx(0.2 / 12.0**0.5)
    assert 80.0 < known["zero"][2] < 150.0
    assert not np.any(Constants.as_table(constants(Uncertainty(None), MACHINE)))
    found = Uncertainty("workshop", {"robot.attitude@body.roll": 1e-4})
    assert constants(found, MACHINE)[0]["unit"][0] == 1e-4


def test_a_missing_sample_is_bridged_and_teaches_nothing() -> None:
    chain, row = settled(OwnTuning(), steps=500)
    before = row["estimate"]["own"].copy()
    row["pressure_a"][0, 2] = np.nan
    for _ in range(7):
        chain.step(row)
    for part in ("estimate_own", "own"):
        assert all(np.isfinite(row[part][name]).all() for name in row[part].dtype.names)
    assert np.isfinite(row["estimate"]["own"]).all()
    assert np.abs(row["estimate"]["own"] - before).max() < 30.0


def test_four_legs_take_less_than_thirty_microseconds_a_step() -> None:
    import time

    chain, row = settled(OwnTuning(), steps=10)
    quickest = np.inf
    for _ in range(5):
        began = time.thread_time()
        for _ in range(400):
            chain.step(row)
        quickest = min(quickest, (time.thread_time() - began) / 400)
    assert quickest < 30e-6


def test_friction_at_rest_is_anywhere_in_its_set_where_no_valve_holds_the_oil() -> None:
    """Load-holding valves let it settle; without, leaking edges go on pressing."""
    shares = {}
    for of_set in ("inferred", "original"):
        machine = build_machine(of_set=of_set)
        legs = Believed.from_machine(machine, 1e-3).legs
        decisions = body_of(machine, MODEL, legs, 1e-3, NO_ROPES)[0]["decisions"]
        shares[of_set] = decisions["rest_share"], decisions["fresh_more"]
    assert shares["inferred"] == (OwnTuning().rest_share, OwnTuning().fresh_more)
    share, more = shares["original"]
    assert share == pytest.approx(1.0 / np.sqrt(3.0)) and share * (1.0 + more) == pytest.approx(1.0)


def test_friction_of_a_piston_that_never_slid_may_be_anywhere_in_its_set_for_good() -> None:
    """After a slide it settles; what a seal was stuck with at the start nothing leads anywhere."""
    decisions = body()[0]["decisions"]
    state = AxisState.zeros(2)
    state["has_slid"] = 0.0, 1.0
    state["rested"] = 60.0
    stuck, settled_ = (axis.unsure(one, decisions) * decisions["rest_share"] for one in state)
    assert stuck == pytest.approx(1.0 / np.sqrt(3.0))
    assert settled_ == pytest.approx(OwnTuning().rest_share, rel=1e-3)


def test_a_slide_is_remembered_as_long_as_the_estimate_runs() -> None:
    chain, row = settled(OwnTuning(), steps=50)

    def slid() -> list[int]:
        return np.flatnonzero(chain.state["body"]["axes"]["has_slid"]).tolist()

    assert slid() == []
    for _ in range(200):
        row["position"][0, VERTICAL[0]] += 5e-5
        chain.step(row)
    assert slid() == [VERTICAL[0]]
    for _ in range(500):
        chain.step(row)
    assert slid() == [VERTICAL[0]]


def test_the_ropes_of_a_machine_that_has_walked_lead_to_where_their_anchors_are() -> None:
    """The body of the balance, told of feet that went a metre down the machine and stood."""
    ways = np.array([[20.0, 4.0, 21.0], [20.0, -4.0, 21.0]])
    numbers = body_of(MACHINE, MODEL, BELIEF.legs, 1e-3, SurveyedRopes.along(ways))
    row, state = DataRow.zeros(), body_records.BodyState.zeros()
    state["means"]["foot_force"][0, :, 2] = 1e4
    row["position"] = STANCE
    whole_body.follow_ropes(row[0], np.ones(4), numbers[0], state[0])
    first = MODEL.foot_positions_m(STANCE)
    row["position"][0, 1::3] += 0.05
    whole_body.follow_ropes(row[0], np.ones(4), numbers[0], state[0])
    moved = -(MODEL.foot_positions_m(row["position"][0]) - first).mean(axis=0)
    np.testing.assert_allclose(state["ropes"]["way"][0], moved, atol=1e-12)
    expected = SurveyedRopes.along(ways - moved).directions
    np.testing.assert_allclose(state["ropes"]["direction"][0], expected, atol=1e-12)
    hanging = np.array([1.0, 1.0, 1.0, 0.0])
    row["position"][0, -2] += 0.05
    whole_body.follow_ropes(row[0], hanging, numbers[0], state[0])
    np.testing.assert_allclose(state["ropes"]["way"][0], moved, atol=1e-12)
