"""The detector `combined`: the mean, over a few milliseconds, of three loads whose errors differ.

The loads take the friction of a piston that hardly moves in three ways: `balance` takes the middle
of its set, `own` a memory that drifts to the middle, `carried` follows it through the oil
(sample.py). Each is wrong by up to the break-away force, but seldom all in the same direction: at
equal recall the mean calls half as many loaded feet lost as the best of the three. The score is
minus the mean, N.

A sensor that drifts moves `balance` and `carried` without bound, while `own` is tied to the weight
of the whole machine. Friction explains a difference between them of no more than the break-away
force: what is beyond that, averaged over many seconds, is taken for the sensor's and subtracted.
"""

from __future__ import annotations

from typing import ClassVar

from testbed.compiled import njit
from testbed.estimation.detectors.base import CompiledDetector, Hold
from testbed.estimation.detectors.sample import Derived, Sample
from testbed.formats.records import Record, quantity


class CombinedNumbers(Record):
    """Of the mean."""

    mean_time = quantity("s", "time of the mean")
    weight_balance = quantity("1", "weight of `balance`")
    weight_own = quantity("1", "weight of `own`")
    weight_carried = quantity("1", "weight of `carried`")
    drift_time = quantity("s", "over which a difference is taken for a sensor's")
    break_away = quantity("N", "what friction explains of a difference")


class CombinedState(Record):
    """Of one foot."""

    mean = quantity("N", "the load")
    behind_balance = quantity("N", "`own` less `balance`, over the drift's time")
    behind_carried = quantity("N", "`own` less `carried`, likewise")
    started = quantity("1", "1 once there was a sample")


@njit
def beyond(difference_n: float, break_away_n: float) -> float:
    """What of a difference (N) friction does not explain."""
    if difference_n > break_away_n:
        return difference_n - break_away_n
    return min(difference_n + break_away_n, 0.0)


@njit
def step_on(
    own: float,
    derived: Derived,
    foot: int,
    numbers: CombinedNumbers,
    state: CombinedState,
    dt_s: float,
) -> float:
    """One sample of one foot: the own estimate (N) and `Derived`."""
    share, slow = dt_s / (numbers.mean_time + dt_s), dt_s / (numbers.drift_time + dt_s)
    balance, carried = derived.balance[foot], derived.carried[foot]
    state.behind_balance += slow * (own - balance - state.behind_balance)
    state.behind_carried += slow * (own - carried - state.behind_carried)
    balance += beyond(state.behind_balance, numbers.break_away)
    carried += beyond(state.behind_carried, numbers.break_away)
    load = numbers.weight_balance * balance + numbers.weight_own * own
    load += numbers.weight_carried * carried
    state.mean = load if state.started == 0.0 else state.mean + share * (load - state.mean)
    state.started = 1.0
    return -state.mean


@njit
def step(
    sample: Sample, foot: int, numbers: CombinedNumbers, state: CombinedState, dt_s: float
) -> float:
    """One sample of one foot."""
    own = sample.row.estimate.own[foot]
    return step_on(own, sample.derived, foot, numbers, state, dt_s)


class Combined(CompiledDetector, step=step):
    """800 N is the believed break-away force, 620 + 180 N."""

    name, text = "combined", "mean of three loads"
    threshold = -912.263
    Numbers, State = CombinedNumbers, CombinedState
    numbers: ClassVar[dict[str, float]] = {
        "mean_time": 6.7e-4,
        "weight_balance": 0.3,
        "weight_own": 0.35,
        "weight_carried": 0.35,
        "drift_time": 10.0,
        "break_away": 800.0,
    }


class Steady(CompiledDetector, step=step):
    """The combined detector over as long as a loss must last.

    A foot that bears next to nothing crosses the force of a loss with every blow; means over
    20 ms follow the definition of a loss (estimation/contact_losses.py), which waits for as
    long.

    The weights are the combined detector's.
    """

    name, text = "steady", "mean of three loads, over 20 ms"
    threshold = -691.5
    Numbers, State = CombinedNumbers, CombinedState
    numbers: ClassVar[dict[str, float]] = Combined.numbers | {"mean_time": 0.02}


class Held(CompiledDetector, step=step):
    """The shipped detector: the mean of two loads over a few milliseconds, and a contact
    state that is held.

    A foot that bears next to nothing under a hammering drill crosses any one level with every
    blow: that, not an error of the load, makes most false alarms of a threshold. So the
    contact state has three levels. Below the first a foot is lost. It counts as loaded again
    once it has stayed above the second, which is further up by what friction hides, for
    longer than a few blows; or above the third, where no friction could lift an unloaded
    foot, for as long as a touchdown lasts.

    The loads are `own` and `carried` (sample.py), which take the friction of a resting piston
    in different ways, with what a drifting sensor adds to the second one given back. The
    piston alone, without any friction (`balance`), adds nothing to the two once the state is
    held.

    All numbers were set on the tuning scenes, N and s on a machine of 4 t.
    """

    name, text = "held", "mean of two loads over 5 ms, three levels"
    threshold = -175.0
    hold: Hold = Hold(margin=626.0, dwell_s=0.22, sure_margin=1200.0, sure_s=0.018)
    Numbers, State = CombinedNumbers, CombinedState
    numbers: ClassVar[dict[str, float]] = Combined.numbers | {
        "mean_time": 0.005,
        "weight_balance": 0.0,
        "weight_own": 0.83,
        "weight_carried": 0.17,
    }
