"""Two recordings of one machine together, and the motion that is chosen to part two hypotheses."""

from __future__ import annotations

import json
import shutil
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from testbed.diagnosis.robot.diagnose import (
    PLACE_IN_DOUBT,
    PREDICTS_WORSE,
    RobotDiagnosis,
    Verdict,
    _without_doubts,
)
from testbed.diagnosis.robot.evidence import RawGroup
from testbed.diagnosis.robot.groups import FORCES, Balances, Candidate
from testbed.diagnosis.robot.hypotheses import Ledger
from testbed.diagnosis.robot.motion_kinds import SECOND, SWAY
from testbed.diagnosis.robot.motions import (
    CLOSE,
    instead_of_a_motion,
    made,
    motion_named,
    motions,
    motions_for,
    parted_sets,
    parting,
    promises,
    rivals,
)
from testbed.diagnosis.robot.parameters import Doubt, found_in
from testbed.diagnosis.robot.probabilities import NO_NAME, RobotSigns, calibration, distribution
from testbed.diagnosis.robot.second_effects import explained, foretold_alike, shown_by_both
from testbed.diagnosis.robot.several_recordings import APART_S, Changes, together
from testbed.effects import by_name
from testbed.effects.signature import Change
from testbed.errors import InputError
from testbed.machine.names import AXES, LEGS
from testbed.resources import folder
from testbed.scenario.scenario import load_scenario
from testbed.workflows import diagnose
from tests.diagnosis.test_robot_signatures import balanced, recorded

LEFT, RIGHT = "sensor.gain_a@fl_vertical", "sensor.gain_a@fr_vertical"
ROWS = 20
TWO = {(LEFT,): 0.5, (RIGHT,): 0.4}
HIGHER = recorded()["position_fl_vertical"] + 0.1


def recording(
    left: np.ndarray, right: np.ndarray, missing: np.ndarray, tolerance: float = 0.0
) -> Balances:
    """A recording in which two gains would show as these columns; white noise of 1."""
    columns = {2: left, 5: right}
    raw = RawGroup(
        missing=missing,
        time_s=np.arange(float(ROWS)),
        noise=np.eye(ROWS),
        tolerated=np.full((ROWS, 1), tolerance),
        rows_of=lambda change: sum(
            (columns[i] * force[0] for i, force in change.force.items()), np.zeros(ROWS)
        ),
    )
    effect = by_name("sensor.gain_a")
    found = {
        name: Candidate(effect, place, {"gain_error": Change(force={axis: np.ones(1)})})
        for name, place, axis in ((LEFT, "fl_vertical", 2), (RIGHT, "fr_vertical", 5))
    }
    groups = {"forces": raw.whitened({n: c.signature for n, c in found.items()})}
    nobody: Any = None
    return Balances(nobody, SWAYING, {"forces": raw}, groups, found)


SWAYING: Any = SimpleNamespace(
    counted=np.zeros((2, 18)),
    seen=SimpleNamespace(
        thrust_n=np.zeros(2), extension_m=np.zeros((2, len(AXES))), stroke_m=np.ones(len(AXES))
    ),
)
"""A body that hardly moves."""


UNKNOWN = 3.0
"""What is alike in all rows of a machine, one standard deviation."""
SOUND = recording(np.zeros(ROWS), np.zeros(ROWS), np.zeros(ROWS), UNKNOWN).raw["forces"]
"""An earlier one of the machine, when it was sound."""


def course(seed: int) -> np.ndarray:
    """Any course of a column."""
    return np.random.default_rng(seed).normal(size=ROWS) * 30.0


def test_a_second_recording_parts_what_the_first_cannot() -> None:
    alike, own, other = course(1), course(2), course(3)
    first = recording(alike, alike, 0.1 * alike)
    both = Ledger(together(first, recording(own, other, 0.1 * own)))
    left, right = (Ledger(first).hypothesis((n,)).log_factor for n in (LEFT, RIGHT))
    assert left == pytest.approx(right)
    assert both.hypothesis((LEFT,)).log_factor > both.hypothesis((RIGHT,)).log_factor + 20.0


def test_several_recordings_share_an_effects_number() -> None:
    first = recording(course(1), course(2), 0.1 * course(1))
    second = recording(course(4), course(5), 0.1 * course(4))
    alone = Ledger(first).hypothesis((LEFT,))
    found = Ledger(together(first, second)).hypothesis((LEFT,))
    assert found.mean == pytest.approx([0.1], rel=0.03) and len(found.mean) == 1
    assert found.covariance[0, 0] < 0.7 * alone.covariance[0, 0]


def test_three_recordings_say_more_than_two_whichever_were_joined_first() -> None:
    one, two, three = (recording(course(k), course(k + 1), 0.1 * course(k)) for k in (1, 4, 7))
    hypotheses = [
        Ledger(both).hypothesis((LEFT,))
        for both in (
            together(one, two),
            together(one, two, three),
            together(together(one, two), three),
        )
    ]
    assert hypotheses[1].log_factor > hypotheses[0].log_factor + 20.0
    assert hypotheses[2].log_factor == pytest.approx(hypotheses[1].log_factor)
    assert together(one) is one and len(together(one, two, three).bodies) == 3


def test_what_a_further_recording_does_not_show_is_not_forgotten() -> None:
    """Neither an effect that it cannot show nor balances that the first one has not got."""
    first = recording(course(1), course(2), 0.1 * course(1))
    second = recording(course(3), course(4), 0.1 * course(3))
    without = replace(second, candidates={RIGHT: second.candidates[RIGHT]})
    found = Ledger(together(first, without)).hypothesis((LEFT,))
    assert found.log_factor == pytest.approx(Ledger(first).hypothesis((LEFT,)).log_factor)
    other = replace(second, raw={"ropes": second.raw["forces"]})
    both = together(first, other)
    assert list(both.raw) == ["forces", "ropes"] and both.raw["ropes"].of_first == 0
    beside = Ledger(both).hypothesis((LEFT,)).log_factor
    assert beside == pytest.approx(Ledger(together(first, second)).hypothesis((LEFT,)).log_factor)


def test_effects_that_make_the_same_are_foretold_alike() -> None:
    """The left gain shows in one part of the first recording alone; the right one makes the same
    but for a little in the second. Neither is preferred for how parts foretell each other.
    """
    shows = np.where(np.arange(ROWS) < 2, 20.0, 0.0)
    little = 0.2 * np.random.default_rng(9).normal(size=ROWS)
    first = recording(shows, shows, 0.3 * shows)
    ledger = Ledger(together(first, recording(little, -little, np.zeros(ROWS))))
    tried = [ledger.hypothesis((name,)) for name in (LEFT, RIGHT)]
    worse = replace(tried[0], log_factor=tried[0].log_factor - 7.0)
    found = {one.names: one.log_factor for one in foretold_alike(ledger, [worse, tried[1]])}
    assert found[(LEFT,)] == pytest.approx(tried[0].log_factor)
    assert found[(RIGHT,)] == pytest.approx(tried[1].log_factor)
    alone = Ledger(first)
    assert foretold_alike(alone, [worse, tried[1]]) == [worse, tried[1]]
    other = Ledger(together(first, recording(course(1), course(2), 0.3 * course(1))))
    tried = [other.hypothesis((name,)) for name in (LEFT, RIGHT)]
    assert [one.log_factor for one in foretold_alike(other, tried)] == [
        one.log_factor for one in tried
    ]


def test_a_tolerance_is_the_same_machines_in_both_recordings() -> None:
    """An offset that a sound machine may have, alike in both, is no news; one of either sign is."""
    nothing = np.zeros(ROWS)
    one, other = np.full(ROWS, 5.0), np.full(ROWS, -5.0)
    left = np.concatenate([np.ones(10), np.zeros(10)])

    def misfit(second: np.ndarray) -> float:
        group = together(
            recording(left, nothing, one, 5.0), recording(left, nothing, second, 5.0)
        ).groups["forces"]
        return float(group.missing @ group.missing)

    assert misfit(other) > 10.0 * misfit(one)


def test_a_cushion_begins_at_the_same_places_in_both_recordings() -> None:
    """What its numbers make is -(start - x) inside it, with one start however far each one went."""
    cushion, place, axis = by_name("force.cushion"), "fl_vertical", AXES.index("fl_vertical")
    bodies = [balanced(), balanced({**recorded(), f"position_{place}": HIGHER})]
    nobody: Any = None
    first, second = (
        Balances(
            nobody,
            body,
            {},
            {},
            {
                "force.cushion@fl_vertical": Candidate(
                    cushion, place, cushion.signature(body.seen, place)
                )
            },
        )
        for body in bodies
    )
    both = together(first, second)
    for change in both.candidates["force.cushion@fl_vertical"].signature.values():
        assert isinstance(change, Changes)
        starts = [
            (body.seen.extension_m[:, axis] - part.force[axis])[part.force[axis] < 0.0]
            for body, part in zip(bodies, change.parts, strict=True)
        ]
        inside = np.concatenate(starts)
        assert len(inside) and np.ptp(inside) < 1e-9


def test_rows_of_the_second_come_after_the_first() -> None:
    both = together(*(recording(course(1), course(2), course(3)) for _ in range(2)))
    time = both.raw["forces"].time_s
    assert len(time) == 2 * ROWS and time[ROWS] == APART_S


def test_the_motion_that_shows_the_difference_promises_most() -> None:
    alike = course(1)
    first = Ledger(recording(alike, alike, 0.1 * alike))
    rehearsals = {
        "parts": recording(course(2), course(3), np.zeros(ROWS)),
        "does not": recording(alike, 1.001 * alike, np.zeros(ROWS)),
    }
    promised = promises(first, TWO, rehearsals)
    assert promised["parts"] > 0.999 and promised["does not"] == pytest.approx(0.5, abs=0.02)
    assert parting(promised, TWO) == ["parts"]


def test_an_effect_is_parted_from_a_sound_machine() -> None:
    first = Ledger(recording(course(1), course(2), 0.02 * course(1)))
    rehearsals = {
        "shows": recording(5.0 * course(3), course(4), np.zeros(ROWS)),
        "hardly shows": recording(course(3), course(4), np.zeros(ROWS)),
    }
    promised = promises(first, {(LEFT,): 0.5, (): 0.4}, rehearsals)
    assert promised["shows"] > 0.9 > 0.6 > promised["hardly shows"]


def test_a_motion_is_chosen_for_all_that_are_likely() -> None:
    """One that parts the likeliest two alone is worth less than one that parts all."""
    alike = course(1)
    first = Ledger(recording(alike, alike, 0.1 * alike))
    rehearsals = {
        "parts the two": recording(alike, course(3), np.zeros(ROWS)),
        "parts all": recording(alike + course(2), course(3), np.zeros(ROWS)),
    }
    three = {(LEFT,): 0.4, (RIGHT,): 0.3, (LEFT, RIGHT): 0.2}
    promised = promises(first, three, rehearsals)
    assert promised["parts all"] > promised["parts the two"] > 0.5


def test_what_an_earlier_recording_tells_of_the_machine_counts_in_the_promise() -> None:
    """A constant that a workshop leaves unknown hides a gain; an earlier recording shows it."""
    alike = np.full(ROWS, 30.0)
    again = {"again": recording(alike, course(2), np.zeros(ROWS), UNKNOWN)}
    alone = recording(alike, course(2), 0.1 * alike, UNKNOWN)
    raw = {"forces": alone.raw["forces"].knowing(SOUND)}
    groups = {
        "forces": raw["forces"].whitened({n: c.signature for n, c in alone.candidates.items()})
    }
    beside = replace(alone, raw=raw, groups=groups, sound={"forces": SOUND})
    promised = [promises(Ledger(one), {(LEFT,): 0.5, (): 0.4}, again) for one in (alone, beside)]
    assert promised[1]["again"] > promised[0]["again"] + 0.05


def test_a_promise_is_what_both_recordings_would_say_together() -> None:
    """The rehearsal alone parts nothing: there a gain on the left makes what another one on the
    right makes. Its number is known from the first recording, and is not that other one.
    """
    alike, own = course(1), course(2)
    first = Ledger(recording(alike, alike, 0.1 * alike))
    rehearsals = {"twice": recording(own, 2.0 * own, np.zeros(ROWS))}
    promised = promises(first, TWO, rehearsals)["twice"]
    left, right = (first.hypothesis((name,)).mean[0] for name in (LEFT, RIGHT))
    second = {LEFT: left * own, RIGHT: right * 2.0 * own}
    told = 0.0
    for true, likely in ((LEFT, 0.5), (RIGHT, 0.4)):
        both = Ledger(
            together(recording(alike, alike, 0.1 * alike), recording(own, 2.0 * own, second[true]))
        )
        sets = tuple(((name,), both.hypothesis((name,)).log_factor) for name in (LEFT, RIGHT))
        said = distribution(RobotSigns(sets, {}, (SWAY, SECOND)), calibration())
        told += likely / 0.9 * said[(true,)] / (said[(LEFT,)] + said[(RIGHT,)])
    assert promised == pytest.approx(told, rel=1e-6) and promised > 0.99


def test_what_a_step_away_from_a_sound_machine_costs_counts_in_the_promise() -> None:
    """Evidence that an effect has already and can have no more of does not part it."""
    alike = course(1)
    first = Ledger(recording(alike, course(2), 0.03 * alike))
    nothing = {"nothing new": recording(np.zeros(ROWS), 1e-3 * course(3), np.zeros(ROWS))}
    assert first.hypothesis((LEFT,)).log_factor > 1.0
    two = {(LEFT,): 0.5, (): 0.45}
    assert promises(first, two, nothing)["nothing new"] < 0.6


def test_a_recording_that_is_given_twice_would_count_twice(tmp_path: Path) -> None:
    (tmp_path / "run").mkdir()
    (tmp_path / "run" / "recording.yaml").write_text("format: roboclimber-recording/1\n")
    again = diagnose.Wanted(also=(tmp_path / "run" / ".." / "run",))
    with pytest.raises(InputError, match="twice"):
        diagnose._robot(tmp_path / "run", tmp_path / "out", again, print)
    assert not (tmp_path / "out").exists()


def test_where_no_motion_parts_two_it_is_said_what_would() -> None:
    promised = {"rise": 0.62, "press": 0.5}
    assert parting(promised, TWO) == []
    several = {(LEFT,): 0.3, (RIGHT,): 0.3, (): 0.2, (LEFT, RIGHT): 0.2}
    assert parting(promised, several) == ["rise", "press"]
    spring, cushion = "force.spring@fl_rotation", "force.cushion@fl_rotation"
    said = instead_of_a_motion(((spring,), (cushion,)))
    assert "no motion" in said and by_name("force.spring").alike["force.cushion"] in said
    assert by_name("force.cushion").telling_motion in said
    both = "rope.direction@rope_left"
    assert both not in instead_of_a_motion(((spring, both), (cushion, both)))


def test_sets_that_are_close_are_rivals() -> None:
    close: Any = (((LEFT,), 0.5), ((RIGHT,), 0.4), ((), 0.1))
    clear: Any = (((LEFT,), 0.41 + CLOSE), ((), 0.4))
    assert rivals(close) == ((LEFT,), (RIGHT,)) and rivals(clear) is None


def test_what_is_sure_of_two_effects_has_its_own_numbers_in_the_model() -> None:
    """Both make nearly the same: beside the right one, which is in doubt, the left one has less."""
    left, right = course(1), course(1) + 0.3 * course(2)
    balances = recording(left, right, 0.15 * (left + right))
    ledger, both, signs = Ledger(balances), (LEFT, RIGHT), RobotSigns(())
    together_, alone = (ledger.hypothesis(names) for names in (both, (LEFT,)))
    sets = ((both, 0.7), ((LEFT,), 0.3))
    verdict = Verdict("effect", together_, sets, {})
    found = found_in(balances, together_, Doubt.shipped())
    errors = {FORCES: {"before": 1.0, "refit": 1.0, "after": 0.5}}
    said = RobotDiagnosis("run", balances, signs, verdict, found, errors, {})
    (sure,) = _without_doubts(said, ledger)
    assert sure.name == LEFT
    gain = sure.parameters["gain_error"].value
    assert gain > 1.1 * found[0].parameters["gain_error"].value > 0.0
    assert sure.parameters == found_in(balances, alone, Doubt.shipped())[0].parameters
    assert (
        _without_doubts(replace(said, verdict=replace(verdict, hypotheses=sets[:1])), ledger) == ()
    )


def test_beside_the_likeliest_two_the_next_ones_are_to_be_parted_too() -> None:
    def said(*hypotheses: Any, not_believed: str = "") -> Any:
        verdict = SimpleNamespace(hypotheses=hypotheses)
        return SimpleNamespace(verdict=verdict, signs=RobotSigns(()), not_believed=not_believed)

    left, right, both = (LEFT,), (RIGHT,), (LEFT, RIGHT)
    more = ((both, 0.1), (NO_NAME, 0.08), ((), 0.06), (("other",), 0.02))
    parted = parted_sets(said((left, 0.5), (right, 0.3), *more))
    assert list(parted.items()) == [(left, 0.5), (right, 0.3), (both, 0.1), ((), 0.06)]
    clear = (left, 0.7), (right, 0.2), (("other",), 0.1)
    assert parted_sets(said(*clear)) == parted_sets(said((left, 1.0))) == {}
    assert parted_sets(said(*clear, not_believed=PREDICTS_WORSE)) == {}
    assert parted_sets(said(*clear, not_believed=PLACE_IN_DOUBT)) == dict(clear)


def test_a_motion_of_one_leg_is_for_effects_of_that_leg() -> None:
    def names(*parted: Any) -> set[str]:
        return {motion.name for motion in motions_for(parted)}

    of_leg = {f"swing_{leg}" for leg in LEGS}
    assert names((LEFT,), ()) & of_leg == {"swing_fl"}
    assert names((LEFT,), (RIGHT,)) & of_leg == {"swing_fl", "swing_fr"}
    assert not names(("robot.payload@body",), ()) & of_leg
    assert of_leg < {motion.name for motion in motions()}


def test_a_sway_goes_as_far_as_the_legs_reach() -> None:
    tried: list[float] = []

    def make(overrides: list[str]) -> float:
        task = json.loads(overrides[0].removeprefix("task="))
        tried.append(task.get("amplitude_m", [0.0, 1.0])[1])
        if tried[-1] > 0.14:
            raise InputError("asks a cylinder beyond its range")
        return tried[-1]

    way, reached = made(motion_named("side_sway"), make)
    assert tried == [0.18, 0.153, 0.126] and reached == way.task["amplitude_m"][1] == 0.126
    with pytest.raises(InputError, match="beyond its range"):
        made(motion_named("lift_feet"), make)


def test_a_second_effect_counts_where_both_recordings_show_it() -> None:
    left, right, nothing = course(1), course(2), np.zeros(ROWS)

    def evidence(second: float) -> tuple[float, float]:
        """Of the left gain alone and of both, where the right one is there by so much."""
        first = recording(left, right, 0.1 * left + 0.1 * right)
        again = recording(right, left, 0.1 * right + second * left)
        ledger = Ledger(together(first, again))
        tried = [ledger.hypothesis(names) for names in ((LEFT,), (RIGHT,), (LEFT, RIGHT))]
        found = {one.names: one.log_factor for one in shown_by_both(ledger, tried)}
        return max(found[(LEFT,)], found[(RIGHT,)]), found[(LEFT, RIGHT)]

    single, pair = evidence(0.1)
    assert pair > single + 20.0
    single, pair = evidence(0.0)
    assert pair <= single
    alone = Ledger(recording(left, right, 0.1 * left + 0.1 * right))
    tried = [alone.hypothesis((LEFT,)), alone.hypothesis((LEFT, RIGHT))]
    assert shown_by_both(alone, tried) == tried
    one_shows = together(recording(left, nothing, left), recording(left, nothing, nothing))
    raised = explained(one_shows, Ledger(one_shows).hypothesis((LEFT,)))
    assert raised[0] > 20.0 and raised[1] < 0.0


def test_what_the_first_recording_does_not_show_was_not_asked_for() -> None:
    """An error of the second motion's own looks like a gain that the first one says nothing of; a
    gain that shows in the first one alone is kept."""
    left, right, nothing = course(1), course(2), np.zeros(ROWS)
    both = together(recording(left, nothing, 0.1 * left), recording(nothing, right, 0.2 * right))
    ledger = Ledger(both)
    tried = [ledger.hypothesis((name,)) for name in (LEFT, RIGHT)]
    assert min(one.log_factor for one in tried) > 20.0
    found = {one.names: one.log_factor for one in shown_by_both(ledger, tried)}
    assert found[(LEFT,)] > 20.0 and found[(RIGHT,)] == 0.0


def test_every_motion_of_the_catalogue_is_one_that_a_standing_robot_can_make() -> None:
    for motion in motions():
        scenario = load_scenario("stand_clean", motion.overrides())
        assert scenario.task.kind == motion.task["kind"]
    with pytest.raises(InputError, match="no motion has that name"):
        motion_named("dance")


@pytest.mark.parametrize(("other", "written"), [(2.0, True), (1.001, False)])
def test_a_motion_is_written_only_where_one_parts_the_two(
    other: float, written: bool, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    alike = course(1)
    first = recording(alike, alike, 0.1 * alike)
    rehearsal = recording(alike, other * alike, np.zeros(ROWS))
    monkeypatch.setattr(diagnose, "_rehearsal", lambda *_: rehearsal)
    shutil.copy(folder("scenarios") / "stand_clean.yaml", tmp_path / "scenario.yaml")
    found: Any = SimpleNamespace(
        balances=first,
        signs=RobotSigns(()),
        not_believed="",
        verdict=SimpleNamespace(hypotheses=(((LEFT,), 0.5), ((RIGHT,), 0.4))),
    )
    said: list[str] = []
    told = diagnose.suggest_motion(found, tmp_path, tmp_path / "next.yaml", said.append)
    assert told is not None and told["parts"] == [[LEFT], [RIGHT]]
    assert (tmp_path / "next.yaml").is_file() == written == (told["motion"] is not None)
    assert written or told["text"] == said[-1]
