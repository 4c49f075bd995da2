"""Effects whose balances are far from linear: their laws against what they do, and their parameters
found by them.
"""

from __future__ import annotations

from collections.abc import Mapping
from types import SimpleNamespace
from typing import cast

import numpy as np
import pytest

from testbed.diagnosis.robot.by_law import fitted
from testbed.diagnosis.robot.evidence import RawGroup
from testbed.diagnosis.robot.groups import Balances, Candidate
from testbed.diagnosis.robot.hypotheses import Ledger
from testbed.diagnosis.robot.parameters import found_in
from testbed.effects import ALL, by_name
from testbed.effects.base import Effect
from testbed.effects.signature import Change, RobotSeen
from testbed.machine.names import AXES
from tests.diagnosis.test_robot_signatures import balanced, recorded

PLACE, DELAY_S, QUICK_RAD_S = "fl_vertical", 0.06, 12.0
AXIS = AXES.index(PLACE)


def shaken(late_s: float) -> RobotSeen:
    """A robot whose pressures swing quickly and are read late."""
    data = dict(recorded())
    data[f"pressure_a_{PLACE}"] = 3e6 + 5e5 * np.sin(QUICK_RAD_S * (data["t"] - late_s))
    return balanced(data).seen


def asked(effect: str, seen: RobotSeen, missing: np.ndarray, noise_n: float) -> Balances:
    """Balances of one effect, seen in a single force that misses `missing` (n,) and noise."""
    candidate = Candidate(by_name(effect), PLACE, by_name(effect).signature(seen, PLACE))
    rng = np.random.default_rng(1)
    raw = RawGroup(
        missing=missing + noise_n * rng.normal(size=seen.bins),
        time_s=seen.time_s,
        noise=noise_n**2 * np.eye(seen.bins),
        tolerated=np.zeros((seen.bins, 1)),
        rows_of=lambda change: change.force.get(AXIS, np.zeros(seen.bins)),
    )
    groups = {"forces": raw.whitened({candidate.name: candidate.signature})}
    body = SimpleNamespace(seen=seen)
    balances = SimpleNamespace(
        raw={"forces": raw},
        groups=groups,
        candidates={candidate.name: candidate},
        body=body,
        second=None,
    )
    return cast(Balances, balances)


def interval(balances: Balances, key: str) -> tuple[float, tuple[float, ...]]:
    """What is found of the only candidate's parameter, and its interval of 90 %."""
    chosen = Ledger(balances).hypothesis(tuple(balances.candidates))
    (found,) = found_in(balances, chosen, 1.0)
    return found.parameters[key].value, tuple(found.parameters[key].interval90 or ())


def made(effect: str, seen: RobotSeen, values: Mapping[str, float]) -> np.ndarray:
    """The force that an effect makes of its cylinder's."""
    change: Change = by_name(effect).made(seen, PLACE, values)
    return np.asarray(change.force[AXIS])


def test_a_delay_makes_what_the_pressures_change_meanwhile() -> None:
    late, true = shaken(DELAY_S), shaken(0.0)
    force = made("sensor.delay", late, {"delay": DELAY_S})
    change = late.area_a_m2[AXIS] * (late.pressure_a_pa - true.pressure_a_pa)[:, AXIS]
    pressure_b = late.pressure_b_pa[:, AXIS] - late.later(AXIS, 1, DELAY_S)
    change = change - late.area_b_m2[AXIS] * pressure_b
    inside = slice(0, -2)
    assert force[inside] == pytest.approx(change[inside], abs=0.03 * np.abs(change).max())


def test_a_long_delay_is_found_as_long_as_it_is() -> None:
    seen = shaken(DELAY_S)
    missing = made("sensor.delay", seen, {"delay": DELAY_S})
    value, (low, high) = interval(asked("sensor.delay", seen, missing, 30.0), "delay")
    assert value == pytest.approx(DELAY_S, rel=0.05)
    assert low < DELAY_S < high < 1.3 * DELAY_S
    linear = by_name("sensor.delay").signature(seen, PLACE)["delay"].force[AXIS]
    assert np.abs(missing - DELAY_S * linear).max() > 0.1 * np.abs(missing).max()


@pytest.mark.parametrize("start_m", [0.19, 0.2, 0.205])
def test_a_cushion_is_found_where_it_begins(start_m: float) -> None:
    seen, stiffness = balanced().seen, 8.0e4
    assert seen.extension_m[:, AXIS].min() < start_m < seen.extension_m[:, AXIS].max()
    missing = made("force.cushion", seen, {"stiffness": stiffness, "start": start_m})
    balances = asked("force.cushion", seen, missing, 10.0)
    for key, true in (("stiffness", stiffness), ("start", start_m)):
        value, (low, high) = interval(balances, key)
        assert value == pytest.approx(true, rel=0.1)
        assert low < value < high


def test_what_does_not_bend_keeps_its_linear_numbers() -> None:
    seen = balanced().seen
    missing = 0.1 * by_name("sensor.gain_a").signature(seen, PLACE)["gain_error"].force[AXIS]
    balances = asked("sensor.gain_a", seen, missing, 30.0)
    chosen = Ledger(balances).hypothesis(tuple(balances.candidates))
    fit = fitted(balances, chosen)
    assert fit.mean is chosen.mean and not fit.parts[0].coordinates


def test_every_effect_that_bends_has_a_law_and_every_law_a_parameter_that_bends() -> None:
    bending = {effect.kind for effect in ALL if effect.bends}
    assert bending == {effect.kind for effect in ALL if type(effect).made is not Effect.made}
    assert bending
