"""Effects whose balances are far from linear: their laws against what they do, and their parameters
found by them.
"""

from __future__ import annotations

from collections.abc import Mapping
from types import SimpleNamespace
from typing import Any, cast

import numpy as np
import pytest
from scipy.stats import norm

from testbed.diagnosis.robot.evidence import RawGroup
from testbed.diagnosis.robot.groups import Balances, Candidate
from testbed.diagnosis.robot.hypotheses import Hypothesis, Ledger
from testbed.diagnosis.robot.nonlinear_fit import _as_twins, fitted, weighed_by_law
from testbed.diagnosis.robot.parameters import Doubt, _found, found_in
from testbed.effects import ALL, by_name
from testbed.effects.base import Effect
from testbed.effects.force_cushion import LEFT_COST
from testbed.effects.parameter_spec import ParameterSpec
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


def asked(seen: RobotSeen, missing: np.ndarray, noise_n: float, *effects: str) -> Balances:
    """Balances of effects, seen in a single force that misses `missing` (n,) and noise."""
    laws = [by_name(effect) for effect in effects]
    found = [Candidate(law, PLACE, law.signature(seen, PLACE)) for law in laws]
    rng = np.random.default_rng(1)
    raw = RawGroup(
        missing=missing + noise_n * rng.normal(size=seen.bins),
        time_s=seen.time_s,
        noise=noise_n**2 * np.eye(seen.bins),
        tolerated=np.zeros((seen.bins, 1)),
        rows_of=lambda change: change.force.get(AXIS, np.zeros(seen.bins)),
    )
    groups = {"forces": raw.whitened({one.name: one.signature for one in found})}
    body = SimpleNamespace(seen=seen, counted=np.ones((seen.bins, 6), dtype=bool))
    balances = SimpleNamespace(
        raw={"forces": raw},
        groups=groups,
        candidates={one.name: one for one in found},
        body=body,
        bodies=(body,),
        others=(),
    )
    return cast(Balances, balances)


def interval(balances: Balances, key: str) -> tuple[float, tuple[float, ...]]:
    """What is found of the only candidate's parameter, and its interval of 90 %."""
    chosen = Ledger(balances).hypothesis(tuple(balances.candidates))
    (found,) = found_in(balances, chosen, Doubt(1.0))
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
    value, (low, high) = interval(asked(seen, missing, 30.0, "sensor.delay"), "delay")
    assert value == pytest.approx(DELAY_S, rel=0.05)
    assert low < DELAY_S < high < 1.3 * DELAY_S
    linear = by_name("sensor.delay").signature(seen, PLACE)["delay"].force[AXIS]
    assert np.abs(missing - DELAY_S * linear).max() > 0.1 * np.abs(missing).max()


@pytest.mark.parametrize("start_m", [0.19, 0.2, 0.205])
def test_a_cushion_is_found_where_it_begins(start_m: float) -> None:
    seen, stiffness = balanced().seen, 8.0e4
    assert seen.extension_m[:, AXIS].min() < start_m < seen.extension_m[:, AXIS].max()
    missing = made("force.cushion", seen, {"stiffness": stiffness, "start": start_m})
    balances = asked(seen, missing, 10.0, "force.cushion")
    for key, true in (("stiffness", stiffness), ("start", start_m)):
        value, (low, high) = interval(balances, key)
        assert value == pytest.approx(true, rel=0.1)
        assert low < value < high


def test_a_cushion_that_its_piston_leaves_is_no_spring() -> None:
    seen = balanced().seen
    start = float(seen.extension_m[:, AXIS].max()) - 0.015
    missing = made("force.cushion", seen, {"stiffness": 8.0e4, "start": start})
    ledger = Ledger(asked(seen, missing, 10.0, "force.cushion", "force.spring"))
    tried = weighed_by_law(ledger, ledger.best())
    singles = [one for one in tried if len(one.names) == 1]
    assert singles[0].names == (f"force.cushion@{PLACE}",)
    assert singles[0].log_factor > singles[1].log_factor + 5.0


def test_a_spring_that_rests_beyond_its_cylinder_is_no_cushion() -> None:
    """The law is a cushion's that would begin where the piston never comes."""
    seen = balanced().seen
    beyond = float(seen.stroke_m[AXIS]) + 0.1
    missing = 8.0e4 * (seen.extension_m[:, AXIS] - beyond)
    balances = asked(seen, missing, 10.0, "force.cushion", "force.spring")
    ledger = Ledger(balances)
    singles = [one for one in weighed_by_law(ledger, ledger.best()) if len(one.names) == 1]
    assert singles[0].names == (f"force.spring@{PLACE}",)
    assert singles[0].log_factor > singles[1].log_factor + 5.0
    start = interval(asked(seen, missing, 10.0, "force.cushion"), "start")[0]
    assert start == pytest.approx(seen.stroke_m[AXIS])


def test_beside_a_long_delay_a_spring_is_no_cushion() -> None:
    """Of the pair with a cushion the delay is weighed by its signature, as beside the spring."""
    seen = shaken(DELAY_S)
    pull = -4.0e3 * (seen.extension_m[:, AXIS] - 0.1)
    missing = pull + made("sensor.delay", seen, {"delay": DELAY_S})
    names = ("force.cushion", "force.spring", "sensor.delay")
    ledger = Ledger(asked(seen, missing, 10.0, *names))
    pairs = [one for one in weighed_by_law(ledger, ledger.best()) if len(one.names) == 2]
    assert pairs[0].names == (f"force.spring@{PLACE}", f"sensor.delay@{PLACE}")


@pytest.mark.parametrize(("cushion", "as_it_counts"), [(40.0, 80.0), (70.0, 110.0), (110.0, 110.0)])
def test_between_a_cushion_that_is_never_left_and_a_spring_there_their_numbers_decide(
    cushion: float, as_it_counts: float
) -> None:
    nothing = np.zeros(0)

    def told(name: str, factor: float, price: float = 0.0) -> Hypothesis:
        return Hypothesis((name,), factor, nothing, nothing, price=price)

    names = ("force.cushion@fl_radial", "force.spring@fl_radial", "force.spring@fr_radial")
    others = [told(names[1], 100.0), told(names[2], 200.0), told("unnamed.force@fl_radial", 300.0)]
    found = _as_twins([told(names[0], cushion, 40.0), *others])
    assert found[0].log_factor == pytest.approx(as_it_counts)
    assert found[0].price == pytest.approx(40.0 - (as_it_counts - cushion))
    assert [one.log_factor for one in found[1:]] == [one.log_factor for one in others]


def test_a_robots_cushion_costs_what_one_on_a_bench_does_that_moves_alike() -> None:
    seen, cushion = balanced().seen, by_name("force.cushion")
    extension_m = seen.extension_m[:, AXIS]
    bench: Any = SimpleNamespace(position_m=extension_m)
    costs = []
    for start in np.quantile(extension_m, (0.0, 0.9, 0.98, 0.99, 1.0)):
        values = {"stiffness": 8.0e4, "start": float(start)}
        costs.append(cushion.robot_price(seen, PLACE, values))
        assert costs[-1] == cushion.price(values, bench)
    assert costs[:2] == [0.0, 0.0] and costs[-1] == LEFT_COST
    assert costs == sorted(costs)


def test_a_cushion_has_the_evidence_of_its_law_by_a_sum_over_its_numbers() -> None:
    seen, noise_n, true = balanced().seen, 200.0, {"stiffness": 8.0e4, "start": 0.2}
    balances = asked(seen, made("force.cushion", seen, true), noise_n, "force.cushion")
    ledger = Ledger(balances)
    (weighed,) = weighed_by_law(ledger, [ledger.hypothesis(ledger.names)])
    spec, missing = by_name("force.cushion").spec, balances.raw["forces"].missing
    stiffness, start = (spec(k).coordinate("", 0.0, ()).prior for k in ("stiffness", "start"))
    assert stiffness is not None and start is not None
    logs = np.log(true["stiffness"]) + np.linspace(-1.0, 1.0, 61)
    starts = true["start"] + np.linspace(-0.01, 0.01, 61)
    total = 0.0
    for log in logs:
        for at in starts:
            rest = missing - made("force.cushion", seen, {"stiffness": np.exp(log), "start": at})
            better = (missing @ missing - rest @ rest) / (2.0 * noise_n**2) - weighed.log_factor
            total += np.exp(better) * norm.pdf(log, *stiffness) * norm.pdf(at, *start)
    step = (logs[1] - logs[0]) * (starts[1] - starts[0])
    assert np.log(total * step) == pytest.approx(0.0, abs=0.2)


def test_what_does_not_bend_keeps_its_linear_numbers() -> None:
    seen = balanced().seen
    missing = 0.1 * by_name("sensor.gain_a").signature(seen, PLACE)["gain_error"].force[AXIS]
    balances = asked(seen, missing, 30.0, "sensor.gain_a")
    chosen = Ledger(balances).hypothesis(tuple(balances.candidates))
    fit = fitted(balances, chosen)
    assert fit.mean is chosen.mean and not fit.parts[0].coordinates


def test_every_effect_that_bends_has_a_law_and_every_law_a_parameter_that_bends() -> None:
    bending = {effect.kind for effect in ALL if effect.bends}
    assert bending == {effect.kind for effect in ALL if type(effect).made is not Effect.made}
    assert bending


def test_an_interval_holds_its_value_where_a_parameter_leaps_with_the_numbers() -> None:
    """The friction that a foot used is read where it slipped fastest: noise moves that stretch."""

    class Leaping(Effect):
        kind, places = "test.leaping", (PLACE,)
        parameters = (ParameterSpec("coefficient", "1", 0.0, 2.0, (0.1, 0.5), "of a test"),)

        def from_linear(
            self, linear: Mapping[str, float], seen: RobotSeen, place: str
        ) -> dict[str, float]:
            exactly = abs(linear["size"] - mean) < 1e-12
            return {"coefficient": 0.05 if exactly else 0.4 + 0.01 * linear["size"]}

    mean = 1.0
    candidate = SimpleNamespace(effect=Leaping(), place=PLACE)
    part = SimpleNamespace(candidate=candidate, first=0, size=1)
    fit = SimpleNamespace(
        mean=np.array([mean]),
        covariance=np.array([[0.04]]),
        parameters=lambda part, numbers, balances: Leaping().from_linear(
            {"size": float(numbers[0])}, balances.body.seen, PLACE
        ),
    )
    balances = SimpleNamespace(body=SimpleNamespace(seen=None))
    found = _found(cast(Any, balances), cast(Any, fit), cast(Any, part), Doubt(1.0))
    coefficient = found.parameters["coefficient"]
    low, high = coefficient.interval90 or (0.0, 0.0)
    assert low <= coefficient.value <= high
    assert coefficient.value == pytest.approx(0.41, abs=0.002)
