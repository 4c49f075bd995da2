"""Evidence of effects against a sound machine: the closed form is the Gaussian's, and a free number
costs.
"""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest
from scipy.linalg import block_diag
from scipy.stats import multivariate_normal, norm

from testbed.diagnosis.robot.evidence import PIECE_S, RECALLED, RawGroup
from testbed.diagnosis.robot.hypotheses import (
    ALONE,
    MATTERS,
    Hypothesis,
    Ledger,
    _near,
    log_gained,
)
from testbed.diagnosis.robot.probabilities import (
    NO_NAME,
    WORTH_A_LOOK,
    RobotSigns,
    calibration,
    distribution,
    leading,
    likeliest_nameless,
)
from testbed.effects import by_name
from testbed.effects.signature import Change
from testbed.machine.names import AXES
from tests.diagnosis.ledgers import ledger_of, ledger_of_columns, ledger_of_numbers

LEFT, RIGHT = "sensor.gain_a@fl_vertical", "sensor.gain_a@fr_vertical"


def group(missing: np.ndarray, seed: int = 0) -> RawGroup:
    """Thirty rows that two gains show, with a tolerance."""
    rng = np.random.default_rng(seed)
    columns = {2: rng.normal(size=30), 5: rng.normal(size=30)}
    root = rng.normal(size=(30, 30)) * 0.1
    return RawGroup(
        missing=missing,
        time_s=np.arange(30.0),
        noise=np.eye(30) + root @ root.T,
        tolerated=rng.normal(size=(30, 2)),
        rows_of=lambda change: sum(
            (columns[i] * force[0] for i, force in change.force.items()), np.zeros(30)
        ),
    )


def beyond(found: Hypothesis) -> float:
    """What the evidence of a gain gains by being one that matters."""
    expected = by_name("sensor.gain_a").spread("gain_error")
    spread = float(np.sqrt(found.covariance[0, 0]))
    return log_gained(found.mean[0] / expected, spread / expected, MATTERS, -math.inf)


def test_evidence_is_the_ratio_of_two_gaussian_densities() -> None:
    rng = np.random.default_rng(1)
    missing = rng.normal(size=30)
    raw = group(missing)
    found = ledger_of({"forces": raw}, (LEFT,)).hypothesis((LEFT,))
    sound = raw.noise + raw.tolerated @ raw.tolerated.T
    column = by_name("sensor.gain_a").spread("gain_error") * raw.rows_of(
        Change(force={2: np.ones(1)})
    )
    zero = np.zeros(30)
    exact = multivariate_normal.logpdf(
        missing, zero, sound + np.outer(column, column)
    ) - multivariate_normal.logpdf(missing, zero, sound)
    assert found.log_factor - beyond(found) == pytest.approx(float(exact), rel=1e-8)


def test_an_earlier_recording_counts_as_if_both_were_judged_as_one() -> None:
    rng = np.random.default_rng(2)
    before, after = group(rng.normal(size=30), 3), group(rng.normal(size=30), 4)
    found = ledger_of({"forces": after.knowing(before, recalled=0.0)}, (LEFT,)).hypothesis((LEFT,))
    tolerated = np.vstack([before.tolerated, after.tolerated])
    both = block_diag(before.noise, after.noise) + tolerated @ tolerated.T
    column = by_name("sensor.gain_a").spread("gain_error") * after.rows_of(
        Change(force={2: np.ones(1)})
    )
    later = np.concatenate([np.zeros(30), column])  # the earlier one is without the effect
    missing = np.concatenate([before.missing, after.missing])
    exact = multivariate_normal.logpdf(
        missing, np.zeros(60), both + np.outer(later, later)
    ) - multivariate_normal.logpdf(missing, np.zeros(60), both)
    assert found.log_factor - beyond(found) == pytest.approx(float(exact), rel=1e-8)


def test_several_names_that_are_alike_are_together_no_sound_machine() -> None:
    alike = {(): 0.3, (LEFT,): 0.28, (RIGHT,): 0.25, NO_NAME: 0.17}
    assert leading(alike) == (LEFT,)
    assert leading({(): 0.2, (LEFT,): 0.35, NO_NAME: 0.45}) == NO_NAME


@pytest.mark.parametrize(("more", "said"), [(0.01, (LEFT,)), (-0.01, ())])
def test_a_name_is_worth_a_look_that_a_sound_machine_does_not_outweigh_by_far(
    more: float, said: tuple[str, ...]
) -> None:
    """However many others are as unlikely as it is."""
    share = WORTH_A_LOOK + more
    sound = 1.0 / (1.0 + 1.9 * share)
    assert leading({(): sound, (LEFT,): share * sound, (RIGHT,): 0.9 * share * sound}) == said


@pytest.mark.parametrize(("nameless", "said"), [(0.42, (LEFT,)), (0.48, NO_NAME)])
def test_that_names_were_wrong_at_times_does_not_speak_for_what_no_name_covers(
    nameless: float, said: tuple[str, ...]
) -> None:
    lapse, two = 0.2, 1.0 - nameless
    kept = (1.0 - lapse) * two
    weights = {(LEFT,): 0.6 * kept, (RIGHT,): 0.4 * kept, NO_NAME: nameless + lapse * two}
    assert sum(weights.values()) == pytest.approx(1.0)
    assert weights[NO_NAME] > kept
    assert leading(weights, lapse) == said


def test_a_name_that_lapses_leave_too_unlikely_against_a_sound_machine_is_not_said() -> None:
    sound, lapse = 0.72, 0.2
    said = 0.95 * WORTH_A_LOOK * sound  # enough before the lapses took their share
    weights = {(): sound, (LEFT,): said, NO_NAME: 1.0 - sound - said}
    assert leading(weights, lapse) == ()
    assert said / (1.0 - lapse) > WORTH_A_LOOK * sound


def test_what_an_earlier_recording_shows_leaves_a_share_of_the_tolerances() -> None:
    rng = np.random.default_rng(3)
    before, after = group(rng.normal(size=30), 3), group(rng.normal(size=30), 4)
    sure = replace(before, noise=1e-9 * before.noise)
    left = after.knowing(sure).tolerated
    kept = RECALLED**2 * after.tolerated @ after.tolerated.T
    assert left @ left.T == pytest.approx(kept, abs=1e-6 * float(np.abs(kept).max()))


def test_the_effect_that_is_there_wins_and_its_size_comes_back() -> None:
    raw = group(np.zeros(30))
    there = 40.0 * raw.rows_of(Change(force={2: np.ones(1)}))
    ledger = ledger_of({"forces": group(there)}, (LEFT, RIGHT), spread=50.0)
    best = ledger.best()[0]
    assert best.names == (LEFT,) and best.mean[0] == pytest.approx(40.0, rel=0.02)
    assert ledger.hypothesis((RIGHT,)).log_factor < 0.5 * best.log_factor


def test_noise_alone_costs_an_effect_its_freedom() -> None:
    ledger = ledger_of({"forces": group(np.zeros(30))}, (LEFT,), spread=50.0)
    assert ledger.hypothesis((LEFT,)).log_factor < -2.0
    assert isinstance(ledger, Ledger)


def test_what_one_part_alone_shows_foretells_nothing() -> None:
    """A jump in two of the rows looks like the effect there; the whole effect is foretold from
    every part.
    """
    column = 40.0 * group(np.zeros(30)).rows_of(Change(force={2: np.ones(1)}))
    jump = np.where(np.arange(30) // 2 == 12, 3.0 * column, 0.0)
    there = ledger_of({"forces": group(column)}, (LEFT,), spread=10.0)
    once = ledger_of({"forces": group(jump)}, (LEFT,), spread=10.0)
    assert there.foreseen((LEFT,)) > 0.9 * there.hypothesis((LEFT,)).log_factor
    assert once.hypothesis((LEFT,)).log_factor > 10.0 > 0.0 > once.foreseen((LEFT,))
    assert once.best()[0].log_factor == pytest.approx(once.foreseen((LEFT,)))
    assert once.foreseen(()) == 0.0


def test_numbers_that_can_hardly_be_cost_what_is_foreseen_with_them_too(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    column = 40.0 * group(np.zeros(30)).rows_of(Change(force={2: np.ones(1)}))
    jump = np.where(np.arange(30) // 2 == 12, 3.0 * column, 0.0)
    for missing in (column, jump):
        ledger = ledger_of({"forces": group(missing)}, (LEFT,), spread=10.0)
        before = ledger.best()[0].log_factor
        with monkeypatch.context() as patched:
            patched.setattr(Ledger, "_log_possible", lambda *_: -5.0)
            assert ledger.best()[0].log_factor == pytest.approx(before - 5.0)


@pytest.mark.parametrize("sure", [-3.0, 0.0, 2.0])
def test_a_number_that_cannot_be_negative_counts_by_its_positive_share(sure: float) -> None:
    gained = log_gained(0.1 * sure, 0.1, matters=0.0, least=0.0)
    assert gained == pytest.approx(math.log(2.0 * float(norm.cdf(sure))))


def test_a_number_that_is_surely_small_is_none_that_matters() -> None:
    """However sure it is, a third of a third of what is expected is no effect; a whole one is."""
    before = 2.0 * float(norm.sf(MATTERS))
    assert log_gained(MATTERS / 3.0, 0.02, MATTERS, -math.inf) < -40.0
    large = log_gained(1.0, 0.02, MATTERS, -math.inf)
    assert large == pytest.approx(-math.log(before))
    one_side = log_gained(-1.0, 0.5, MATTERS, least=0.0)
    assert one_side == pytest.approx(
        math.log(float(norm.sf(MATTERS + 1.0, scale=0.5)) / before * 2)
    )


@pytest.mark.parametrize(("mean", "spread"), [(-0.6, 0.1), (0.5, 0.3), (-2.0, 0.2)])
def test_a_number_lies_above_what_is_least_and_beyond_what_matters(
    mean: float, spread: float
) -> None:
    """As little as -1, as little as a third either way: by the normal distribution's shares."""
    now, before = (
        float(d.sf(MATTERS) + d.cdf(-MATTERS) - d.cdf(-1.0))
        for d in (norm(mean, spread), norm(0.0, 1.0))
    )
    gained = log_gained(mean, spread, MATTERS, least=-1.0)
    assert gained == pytest.approx(math.log(now / before), rel=1e-6)


def test_what_lies_far_out_between_two_bounds_is_still_a_number() -> None:
    """Bounds that are next to each other, a thousand standard deviations off."""
    gained = log_gained(10.0, 0.01, MATTERS, least=-MATTERS * (1.0 + 1e-15))
    assert gained == pytest.approx(-math.log(float(norm.sf(MATTERS))), rel=1e-6)


def test_a_number_that_would_be_negative_is_held_at_nothing() -> None:
    """Ways that a foot sinks by: what one shows backwards is not evidence for sinking."""
    rng = np.random.default_rng(5)
    ways = rng.normal(size=(40, 2))
    raw = RawGroup(
        missing=ways @ np.array([20.0, -20.0]) + rng.normal(size=40),
        time_s=np.arange(40.0),
        noise=np.eye(40),
        tolerated=np.zeros((40, 1)),
        rows_of=lambda change: ways @ change.force[0],
    )
    ledger = ledger_of_numbers(raw, "ground.settling@foot_fl", np.eye(2))
    found = ledger.hypothesis(("ground.settling@foot_fl",))
    assert found.mean[1] == 0.0 < found.mean[0] and np.all(np.diag(found.covariance) > 0.0)
    backwards = ledger.were(("ground.settling@foot_fl",), np.array([0.0, -20.0]))
    assert backwards.hypothesis(("ground.settling@foot_fl",)).log_factor < 0.0


def test_a_course_in_time_need_not_foretell_what_is_kept_back() -> None:
    """A foot that slips once has slipped, though no other part of the recording shows it."""
    jump = np.where(np.arange(40) // 5 == 6, 30.0, 0.0)
    raw = RawGroup(
        missing=jump,
        time_s=np.repeat(np.arange(0.0, 8.0 * PIECE_S, PIECE_S), 5),
        noise=np.eye(40),
        tolerated=np.zeros((40, 1)),
        rows_of=lambda change: np.repeat(change.force[0], 5),
    )
    name = "ground.friction@foot_fl"
    ledger = ledger_of_numbers(raw, name, np.eye(8))
    assert ledger.foreseen((name,)) < ledger.hypothesis((name,)).log_factor
    assert ledger.best()[0].log_factor == ledger.hypothesis((name,)).log_factor


@pytest.mark.parametrize("others", [0.0, -12.0])
def test_what_shows_in_one_part_alone_costs_so_much_and_what_others_deny_more(
    others: float,
) -> None:
    """A leg that swings once shows its mass then; where the others say the opposite it is none."""
    rng = np.random.default_rng(2)
    part = np.arange(40) // 5 % 4
    way = np.where(part == 1, 3.0, 0.05 if others == 0.0 else 1.0)
    size = np.where(part == 1, 12.0, others)
    raw = RawGroup(
        missing=way * size + rng.normal(size=40),
        time_s=np.repeat(np.arange(0.0, 8.0 * PIECE_S, PIECE_S), 5),
        noise=np.eye(40),
        tolerated=np.zeros((40, 1)),
        rows_of=lambda change: way * change.force[0],
    )
    name = "inertia.mass@fl_radial"
    ledger = ledger_of_numbers(raw, name, np.eye(1))
    whole = ledger.hypothesis((name,)).log_factor
    if others == 0.0:
        assert ledger.foreseen((name,)) == pytest.approx(whole - ALONE, abs=5.0)
    else:
        assert ledger.foreseen((name,)) < whole - 2.0 * ALONE


def test_what_lasting_noise_lets_be_seen_once_alone_need_not_show_again() -> None:
    rows, lasting, there = 80, 100.0, 60.0
    raw = RawGroup(
        missing=np.full(rows, there),
        time_s=0.2 * np.arange(rows),
        noise=0.01 * np.eye(rows) + lasting * np.ones((rows, rows)),
        tolerated=np.zeros((rows, 1)),
        rows_of=lambda change: change.force[0],
    )
    found = ledger_of_numbers(raw, LEFT, np.ones((1, rows)))
    known = 20.0**2 / lasting  # its prior of 20 beside noise of 10, of which there is one draw
    seen = 0.5 * there**2 / lasting * known / (1.0 + known) - 0.5 * math.log(1.0 + known)
    assert found.foreseen((LEFT,)) == pytest.approx(seen, rel=0.01)
    begins = np.where(raw.time_s < PIECE_S, 1.0, 0.0)
    once = replace(raw, missing=there * begins, noise=lasting * np.eye(rows))
    found = ledger_of_numbers(once, LEFT, begins[None])
    assert found.foreseen((LEFT,)) <= found.hypothesis((LEFT,)).log_factor - 0.9 * ALONE


def signs(one: float, rival: float, nothing: float) -> RobotSigns:
    """A good name, a rival, and what no name covers."""
    return RobotSigns((((LEFT,), one), ((RIGHT,), rival), (("unnamed.wrench@body",), nothing)))


def test_probabilities_add_up_to_one_and_follow_the_evidence() -> None:
    numbers = calibration()
    for one, rival, nothing in ((0.0, 0.0, 0.0), (300.0, 20.0, 10.0), (20.0, 19.0, 400.0)):
        found = distribution(signs(one, rival, nothing), numbers)
        assert sum(found.values()) == pytest.approx(1.0, abs=1e-12)
    strong, weak, strange = (
        distribution(signs(*s), numbers)
        for s in ((300.0, 20.0, 10.0), (1.0, 0.0, 0.0), (20.0, 19.0, 400.0))
    )
    assert max(strong, key=strong.__getitem__) == (LEFT,)
    assert max(weak, key=weak.__getitem__) == ()
    assert max(strange, key=strange.__getitem__) == NO_NAME


def test_a_tolerance_far_beyond_its_size_is_no_name() -> None:
    far = RobotSigns(((("sensor.zero_a@fl_vertical",), 200.0), ((LEFT,), 5.0)))
    found = distribution(far, calibration())
    assert found[NO_NAME] > 0.9


def test_a_tolerance_far_beyond_its_size_is_as_likely_as_a_name_that_explains_as_much() -> None:
    zero, spring = "sensor.zero_a@fl_radial", "force.spring@fl_radial"
    tried = RobotSigns((((zero,), 14.0), ((spring,), 14.0)))
    found = distribution(tried, {**calibration(), "lapse": 0.0, "sound": {}})
    assert found[NO_NAME] == pytest.approx(found[(spring,)])


def test_of_all_that_have_no_name_the_likeliest_stands_for_them() -> None:
    named, zero, course = (LEFT,), ("sensor.zero_a@fl_vertical",), ("unnamed.force@fr_vertical",)
    for best, factors in ((zero, (30.0, 20.0)), (course, (5.0, 90.0))):
        tried = RobotSigns(((named, 25.0), (zero, factors[0]), (course, factors[1])))
        assert likeliest_nameless(tried, calibration()) == best
    assert likeliest_nameless(RobotSigns(((named, 25.0),)), calibration()) == ()


@pytest.mark.parametrize(("place", "said"), [("fl_vertical", NO_NAME), ("fr_vertical", None)])
def test_gains_of_both_sensors_of_one_cylinder_are_a_sensor_that_bends(
    place: str, said: tuple[str, ...] | None
) -> None:
    gains = ("sensor.gain_a@fl_vertical", f"sensor.gain_b@{place}")
    tried = RobotSigns((((gains[0],), 15.0), ((gains[1],), 19.0), (gains, 67.0)))
    assert leading(distribution(tried, calibration())) == (said or gains)


def test_two_other_effects_of_one_cylinder_keep_their_names() -> None:
    pair = ("friction.position@fl_vertical", "sensor.gain_a@fl_vertical")
    tried = RobotSigns((((pair[0],), 40.0), ((pair[1],), 60.0), (pair, 260.0)))
    assert leading(distribution(tried, calibration())) == pair


@pytest.mark.parametrize("lead", [50.0, 500.0, 5000.0])
def test_a_second_effect_elsewhere_owes_nothing_to_what_the_first_explains(lead: float) -> None:
    spring, air = "force.spring@fr_vertical", "hydraulics.air@fl_vertical"
    sets = (((spring,), lead), ((air,), 30.0), ((air, spring), lead + 30.0))
    found = distribution(RobotSigns(sets), {**calibration(), "sound": {}})
    one, both = found[(spring,)], found[(air, spring)]
    numbers = calibration()
    added = numbers["share"] * numbers["much"] * math.log1p(30.0 / numbers["much"])
    assert leading(found) == (air, spring)
    assert both / one == pytest.approx(math.exp(added - numbers["two"]) / len(AXES))


@pytest.mark.parametrize(("place", "same"), [("rr_rotation", True), ("fr_vertical", False)])
def test_a_second_effect_at_another_place_is_believed_as_a_first_one_is(
    place: str, same: bool
) -> None:
    """Evidence of 20 for the second: by the share of a first, less its price and its places."""
    first, second = "force.spring@fr_vertical", f"force.cushion@{place}"
    sets = (((first,), 40.0), ((second,), 20.0), ((second, first), 60.0))
    numbers = {**calibration(), "form_here": 0.0, "sound": {}}
    found = distribution(RobotSigns(sets), numbers)
    share = numbers["share" if same else "share_second"]
    added = share * numbers["much"] * math.log1p(20.0 / numbers["much"])
    odds = added - numbers["two"] - math.log(len(AXES))
    said = math.log(found[(second, first)] / found[(first,)])
    assert said == pytest.approx(odds)


@pytest.mark.parametrize(("nameless", "said"), [(70.0, False), (110.0, True)])
def test_one_effect_that_explains_as_much_as_two_do_is_no_less_likely_for_being_one(
    nameless: float, said: bool
) -> None:
    """A mass, and beside it another one with a zero, which no name covers."""
    one, other = "inertia.mass@rl_vertical", "inertia.mass@rl_radial"
    pair = (other, "sensor.zero_a@rl_vertical")
    sets = (((one,), 70.0), ((other,), 37.0), ((pair[1],), 20.0), (pair, nameless))
    numbers = {**calibration(), "lapse": 0.0, "sound": {}}
    assert (leading(distribution(RobotSigns(sets), numbers)) == NO_NAME) is said


def test_of_a_second_effect_counts_what_no_error_at_the_first_ones_place_explains() -> None:
    first, second = "friction.presliding@fl_radial", "inertia.mass@fl_radial"
    sets = (((first,), 260.0), ((second,), 25.0), ((first, second), 290.0))
    numbers = {**calibration(), "sound": {}}
    beside, bent = (
        distribution(RobotSigns(sets, bent={(first, second): by}), numbers) for by in (2.0, 28.0)
    )
    assert leading(beside) == (first, second)
    assert leading(bent) == (first,)


def test_an_error_of_any_course_at_its_place_is_as_good_as_a_second_effect_there() -> None:
    """Rows that the second one and the error change alike, and rows that only the second does."""
    error, second = "unnamed.force@fl_vertical", "sensor.gain_b@fl_vertical"
    rng = np.random.default_rng(8)
    whole = group(rng.normal(size=30))
    for alike, explained in ((1.0, 0.8), (0.0, 0.1)):
        columns = {
            LEFT: whole.rows_of(Change(force={2: np.ones(1)})),
            error: (shape := rng.normal(size=30)),
            second: 30.0 * (alike * shape + (1.0 - alike) * rng.normal(size=30)),
        }
        missing = 100.0 * columns[LEFT] + 0.4 * columns[second] + rng.normal(size=30)
        ledger = ledger_of_columns(replace(whole, missing=missing), columns)
        alone = {n: ledger.hypothesis((n,)).log_factor for n in ledger.names}
        pair = ledger.hypothesis((LEFT, second))
        bent, added = ledger._bent(pair, alone), pair.log_factor - alone[LEFT]
        assert bent is not None and added > 10.0
        assert (bent > explained * added) == (alike == 1.0)


def test_only_cylinders_of_one_leg_are_near() -> None:
    assert _near(LEFT, "inertia.mass@fl_radial") and _near(
        "supply.pump@supply", "supply.droop@supply"
    )
    assert not _near(LEFT, RIGHT) and not _near(LEFT, "robot.payload@body")
    assert not _near("rope.direction@rope_left", "rope.direction@rope_right")


def test_signs_that_were_written_are_read_as_they_were() -> None:
    pair = (LEFT, RIGHT)
    told = RobotSigns((((LEFT,), 1.0), (pair, 2.0)), {pair: 0.5})
    assert RobotSigns.from_json(told.as_json()) == told
