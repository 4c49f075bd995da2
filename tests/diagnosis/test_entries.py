"""A fit's numbers as model files carry them: values with intervals, logarithms turned back, bounds
kept.
"""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from testbed.diagnosis.leg.entries import CAUTION, OTHER_FORM, at_bounds, entries_of
from testbed.diagnosis.leg.fit import Fit, group_scale
from testbed.diagnosis.leg.points import Point
from testbed.diagnosis.leg.search import Candidate
from testbed.diagnosis.leg.verdict import doubted
from testbed.effects import by_name
from testbed.effects.active import Active
from testbed.effects.terms import Coordinate
from testbed.estimation.leg.flow import Edges
from testbed.formats.intervals import Z90
from testbed.recording.leg_model import Friction, Parameter

GAIN, SPRING = by_name("sensor.gain_a"), by_name("force.spring")


def fitted(effect: Any, sd: dict[str, float], **values: float) -> Fit:
    """A fit of one effect alone with these standard deviations, in fitted units."""
    complete = effect.complete(values)
    coordinates = tuple(
        effect.spec(name).coordinate(effect.name, complete[name], effect.seen_in) for name in sd
    )
    theta = [np.log(c.start) if c.log else c.start for c in coordinates]
    at = Point(Friction(), Edges(), (Active(effect, complete),))
    covariance = np.diag([number**2 for number in sd.values()])
    return Fit(coordinates, np.array(theta), at, {}, {}, {}, covariance)


def parameter(fit: Fit, name: str, memory: float = 1.0, by_blocks: Any = None) -> Parameter:
    (entry,) = entries_of(fit, memory, by_blocks)
    return entry.parameters[name]


def test_an_interval_is_as_wide_as_data_and_form_leave_it() -> None:
    found = parameter(fitted(GAIN, {"gain_error": 0.01}, gain_error=0.05), "gain_error")
    half = np.hypot(Z90 * CAUTION * 0.01, OTHER_FORM["force"] * 0.05)
    assert found.value == 0.05 and found.unit == "1"
    assert found.interval90 == pytest.approx((0.05 - half, 0.05 + half))


def test_samples_that_hang_together_widen_it_by_their_root() -> None:
    fit = fitted(SPRING, {"stiffness": 100.0, "rest": 0.0}, stiffness=1.0, rest=0.0)
    one, four = (parameter(fit, "stiffness", memory).interval90 for memory in (1.0, 4.0))
    assert one is not None and four is not None
    assert four[1] - four[0] == pytest.approx(2.0 * (one[1] - one[0]), rel=1e-3)
    less = parameter(fit, "stiffness", 0.25).interval90
    assert less == one  # fewer than one sample hangs together with itself


def test_the_wider_of_data_and_blocks_counts() -> None:
    fit = fitted(GAIN, {"gain_error": 0.01}, gain_error=0.05)
    plain = parameter(fit, "gain_error").interval90
    assert parameter(fit, "gain_error", by_blocks=np.diag([1e-6])).interval90 == plain
    wide = parameter(fit, "gain_error", by_blocks=np.diag([4e-4])).interval90
    assert wide is not None and plain is not None and wide[1] > plain[1]


def test_no_interval_leaves_what_is_physical_and_every_one_holds_its_value() -> None:
    found = parameter(fitted(GAIN, {"gain_error": 10.0}, gain_error=0.05), "gain_error")
    spec = GAIN.spec("gain_error")
    assert found.interval90 == (spec.low, spec.high)


def test_a_size_that_is_fitted_as_its_logarithm_has_an_interval_of_factors() -> None:
    coordinate = Coordinate(
        GAIN.name, "gain_error", 0.05, 1e-4, 1.0, 0.1, log=True, moves=("force",)
    )
    fit = fitted(GAIN, {"gain_error": 0.1}, gain_error=0.05)
    fit = Fit((coordinate,), np.log([0.05]), fit.at, {}, {}, {}, fit.covariance)
    low, high = parameter(fit, "gain_error").interval90 or (0.0, 0.0)
    assert low * high == pytest.approx(0.05**2)


def test_what_was_not_fitted_has_no_interval_and_a_default_is_not_written() -> None:
    (entry,) = entries_of(fitted(SPRING, {"rest": 0.01}, stiffness=500.0, rest=0.2), 1.0)
    assert set(entry.parameters) == {"stiffness", "rest"}  # cubic is its default
    assert entry.parameters["stiffness"].interval90 is None


def test_an_effect_at_a_place_keeps_its_place_beside_its_name() -> None:
    placed = GAIN.at("fl_vertical")
    (entry,) = entries_of(fitted(placed, {"gain_error": 0.01}, gain_error=0.05), 1.0)
    assert (entry.name, entry.place) == ("sensor.gain_a", "fl_vertical")


def test_the_noise_of_a_group_is_its_own_and_a_burst_does_not_make_it() -> None:
    rng = np.random.default_rng(7)
    group = np.repeat([0, 1, 2], [2_000, 2_000, 10])
    residual = rng.normal(0.0, np.array([3.0, 30.0, 1.0])[group])
    residual[:5] = 1e6
    noise = group_scale(residual, np.ones(len(group)), group, 4, floor=1e-3)
    assert noise[:2] == pytest.approx([3.0, 30.0], rel=0.1)
    assert np.isinf(noise[2:]).all()  # too few bins, and none


def test_noise_does_not_fall_below_its_floor() -> None:
    silent = np.zeros(100)
    found = group_scale(silent, np.ones(100), np.zeros(100, dtype=int), 1, floor=0.5)
    assert found.tolist() == [0.5]


AIR, DELAY = by_name("hydraulics.air"), by_name("sensor.delay")


def air(exponent: float) -> Fit:
    """Entrained air whose law is bent by this exponent, 0.2 to 1.2 being possible."""
    return fitted(AIR, {"fraction": 0.1, "exponent": 0.1}, fraction=2e-3, exponent=exponent)


def test_a_number_at_a_bound_is_told_and_one_at_its_natural_end_is_none() -> None:
    assert at_bounds(air(0.2)) == {"hydraulics.air": ("exponent",)}
    assert at_bounds(air(1.2)) == {"hydraulics.air": ("exponent",)}
    assert at_bounds(air(0.21)) == {}
    sd = {"delay": 1e-3, "lag_share": 0.1}
    assert at_bounds(fitted(DELAY, sd, delay=0.01, lag_share=1.0)) == {}
    assert at_bounds(fitted(DELAY, sd, delay=0.2, lag_share=1.0)) == {"sensor.delay": ("delay",)}


def test_a_logarithm_at_its_least_stands_for_nothing_where_there_may_be_none() -> None:
    bristle = by_name("friction.presliding")
    sd = {"stiffness": 0.1, "damping": 0.5}

    def ended(damping: float) -> dict[str, tuple[str, ...]]:
        fit = fitted(bristle, sd, stiffness=2e5, damping=damping)
        return at_bounds(fit)

    damping = bristle.spec("damping").coordinate(bristle.name, 1.0, ())
    assert ended(damping.low) == {} and ended(500.0) == {}
    assert ended(damping.high) == {"friction.presliding": ("damping",)}


def test_a_set_with_a_number_at_a_bound_gives_half_of_its_probability_away() -> None:
    both, alone = ("force.spring", "hydraulics.air"), ("hydraulics.air",)
    spring, none, unnamed = ("force.spring",), (), ("unnamed",)
    given = {both: 0.6, spring: 0.1, alone: 0.2, none: 0.06, unnamed: 0.04}

    def after(exponent: float) -> dict[tuple[str, ...], float]:
        straight = fitted(SPRING, {"stiffness": 1.0}, stiffness=500.0, rest=0.2)
        fits = {both: air(exponent), alone: air(exponent), spring: straight, none: straight}
        sets: Any = {
            frozenset(names): Candidate(names, fit, SimpleNamespace())  # type: ignore[arg-type]
            for names, fit in fits.items()
        }
        return doubted(sets, given)

    assert after(0.5) == pytest.approx(given)
    expected = {both: 0.3, spring: 0.4, alone: 0.1, none: 0.06, unnamed: 0.14}
    assert after(0.2) == pytest.approx(expected)
