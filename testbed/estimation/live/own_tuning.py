"""The tuning of the whole-body estimate (whole_body.py): the uncertainties that it assumes, and
which of its parts are switched on. Also the tunings for a robot without a survey of ropes and load
(`unsurveyed`) and for one without an inertial unit (`unfelt`).
"""

from __future__ import annotations

import math
from dataclasses import dataclass, fields, replace

from testbed.machine.scale import Scale

EVEN = 1.0 / math.sqrt(3.0)
"""One standard deviation of what is anywhere in a set, as a share of the set's half width."""

TUNED_AT_S = 1.0e-3
"""Sampling period for which the numbers of OwnTuning that count samples are meant."""


@dataclass(frozen=True)
class OwnTuning:
    """Uncertainties that the estimator assumes, and switches of its parts. All numbers are assumed
    (E) and were chosen on runs that no result is taken from; see `testbed estimators`.

    `*_sd_*` is one standard deviation, `*_share` a share of what its name says, `*_keep_s` the time
    constant with which a deviation decays. `reported_*` is the part of the filter's standard
    deviation that an interval reports (reported_shares.py), chosen on drawn machines whose seals
    begin stuck anywhere in their set.
    """

    rich: bool = True
    """Friction beyond (5): warmth of the oil, place on the stroke, pressure, side load, rest."""
    swing: bool = True
    """A foot in the air carries nothing: zeros are learnt there."""
    balance: bool = True
    """Foot forces, weight, ropes and drill add up to nothing."""
    friction: bool = True
    """Friction of each cylinder is learnt while it slides."""
    weighs: bool = True
    """Weight, centre of mass, ropes, load pins and the inertial unit's bracket are learnt."""
    robust: bool = True
    """A sensor that the balance blames far more than a sound machine's carries the blame alone, and
    a balance that no friction can explain is given up.
    """
    pushes: bool = True
    """A foot pushes and does not pull."""
    shakes: bool = True
    """Fast changes of the loads follow from the body's acceleration."""
    every: int = 5
    """Samples between two balances of the body."""
    observer_rad_s: float = 60.0
    """Bandwidth of the observer that takes speed and acceleration from the encoder."""
    rest_m_s: float = 0.001
    """A piston that is slower counts as resting."""
    slide_m_s: float = 0.003
    """A piston that is faster counts as sliding; between the two friction is neither a set nor
    known.
    """
    friction_share: float = 0.12
    """Sliding friction is known to this share."""
    slow_share: float = 0.6
    """A further share of it at the slowest speeds, where a piston may stick and slip."""
    slow_m_s: float = 0.008
    """Speed over which `slow_share` decays."""
    speed_sd_m_s: float = 0.003
    """Of the piston's speed; the viscous slope times this is what friction may be off by for it."""
    rest_share: float = 0.3
    """Standard deviation of friction at rest, as a share of the half width of its set; EVEN for a
    machine without load-holding valves.
    """
    fresh_more: float = 1.5
    """Right after a stop, while oil and friction settle, it is larger by this share of itself."""
    fresh_s: float = 4.0
    """Time constant with which `fresh_more` decays."""
    stuck_share: float = EVEN
    """What `rest_share` is for a piston that has not slid since the start: it may be stuck
    anywhere in its set.
    """
    sliding_keep_s: float = 0.5
    """Of friction while a piston slides."""
    rest_keep_s: float = 0.3
    """Of friction at rest."""
    rest_alike: float = 0.5
    """Correlation of friction between feet after a long rest: leaking oil moves it the same way at
    all of them.
    """
    alike_after_s: float = 30.0
    """Time constant of a rest with which that correlation builds up."""
    body_keep_s: float = 0.3
    """Of the balance's own error. No longer than friction's: else what a stuck piston hides is
    taken for an error of the weight.
    """
    weight_share: float = 0.005
    """Error of the balance of forces, as a share of the weight."""
    centre_sd_m: float = 0.01
    """Of the centre of mass; times the weight it is the error of the balance of moments."""
    rope_share: float = 0.005
    """Error of the balance of forces, as a share of the ropes' tensions."""
    drill_share: float = 0.05
    """Error of the balance along z, as a share of the ordered thrust."""
    blow_share: float = 0.2
    """Noise of the balance along z by the hammer's blows, as a share of the ordered thrust."""
    force_sd_n: float = 300.0
    """Noise of the balance of forces."""
    moment_sd_n_m: float = 450.0
    """Noise of the balance of moments."""
    set_margin: float = 0.2
    """Friction's set may be wider than believed, at either end by this share of its width."""
    news_share: float = 0.8
    """Share of a change of the piston's force at rest that may be a change of friction."""
    news_noise_n: float = 50.0
    """Part of such a change that is noise."""
    gate: float = 8.0
    """An observation that is off by more standard deviations than this gets less weight, as if it
    were off by just as many.
    """
    blame_s: float = 1.0
    """Time over which the balance is averaged to find a sensor that reads wrong."""
    blame_threshold: float = 2.5
    """Standard deviations by which the balance must speak against a sensor for it to be blamed."""
    doubt_cost: float = 10.0
    """Cost of a balance that is still believed before anything slid (doubt.py). On 26 tuning runs
    of sound drawn machines it is at most 5 standing and drilling, 8 raising, and 24 for moments of
    a crawl.
    """
    doubt_time_s: float = 2.0
    """Time within which a doubted balance is given up, and believed again."""
    surprise_worth: float = 2.0
    """Weight of the prior belief that the machine is as told, counted in unknowns (surprise.py)."""
    surprise_s: float = 8.0
    """Time over which friction's deviations and the balance's errors are averaged for that."""
    zero_wander_n2_s: float = 1.0
    """Growth of the variance of a cylinder force's zero."""
    zero_sd_n: float = 20.0
    """Of a cylinder force's zero after calibration, beside the tolerances of its sensors."""
    dry_sd_n: float = 20.0
    """Of dry friction, beside its tolerances."""
    air_load_n: float = 1500.0
    """A foot that is not meant to carry, and has borne less than this for `air_dwell_s`, is in the
    air.
    """
    air_dwell_s: float = 0.15
    air_sd_n: float = 40.0
    """Of the load of a foot in the air about zero."""
    carries_n: float = 300.0
    """From this load on a foot takes its part in fast changes of the body's load."""
    noise_sd_n: float = 15.0
    """Noise of a filtered load."""
    moving_sd_n: float = 110.0
    """Error of a load by inertia and friction while its piston slides, for the spread."""
    steady_sd_n: float = 32.0
    """That error for the interval where the body moves steadily; body_stirred.py adds the rest."""
    reported_sliding: float = 0.45
    """Of the part by friction, while the vertical piston slides."""
    reported_begun: float = 1.8
    """Of the part by friction, when the piston has just begun to slide; decays to
    `reported_sliding` over `reported_begun_s`.
    """
    reported_begun_s: float = 0.05
    reported_constants: float = 0.9
    """Of the part by the machine's constants, once the vertical piston has slid for longer. Less
    than 1: errors of friction by speed, of friction by load and of a zero make up for each other.
    """
    reported_resting: float = 1.2
    """Of the part by the machine's constants, while the vertical piston does not slide."""
    reported_stopped: float = 0.43
    """Of the part by friction, just after the piston came to rest: it keeps the friction of its
    stop.
    """
    reported_loaded: float = 0.88
    """Of the part by friction, once the force has since ranged over `reported_loaded_within` times
    the width of friction's set.
    """
    reported_stuck: float = 0.62
    """Of the part by friction, while the piston has not slid since the start: what it may hide is
    as wide as its set, less what the balance of the body shows.
    """
    reported_led: float = 0.29
    """Of the part by friction of a piston that never slid, once its force has ranged over
    `reported_led_within` times that width.
    """
    reported_loaded_within: float = 1.0
    reported_led_within: float = 0.7
    range_noise_n: float = 50.0
    """Range over which a piston's force seems to go by noise alone."""
    spread_share: float = 0.75
    """Of the whole standard deviation, for the spread that contact detectors weigh a load by."""
    spread_stuck: float = 0.7
    """Of that, on a vertical piston that never slid."""
    filter_q_n2: float = 150.0
    """Process variance of the filter of the reported loads, per sample."""
    filter_r_n2: float = 1500.0
    """Measurement variance of that filter."""
    e_max_n: float = 500.0
    """A load that jumps by more than this is held back for `hold_samples`: by then a spike is over,
    and a true change is not.
    """
    hold_samples: float = 4.0

    def scaled(self, scale: Scale) -> OwnTuning:
        """The same for a machine of another size."""
        by_unit = {
            "_n_m": scale.moment,
            "_m_s": scale.speed,
            "_n2": scale.force**2,
            "_n2_s": scale.force**2,
            "_n": scale.force,
            "_m": scale.length,
        }
        changes = {}
        for field in fields(self):
            unit = next((end for end in by_unit if field.name.endswith(end)), None)
            if unit is not None:
                changes[field.name] = by_unit[unit] * getattr(self, field.name)
        return replace(self, **changes)

    def stepped(self, dt_s: float) -> OwnTuning:
        """The same for samples that come every so many seconds: as quick to follow a load, by
        larger steps where there are fewer.
        """
        steps = round(dt_s / TUNED_AT_S, 3)
        return replace(
            self,
            every=math.ceil(self.every / steps),
            hold_samples=max(self.hold_samples / steps, 2.0),
            filter_q_n2=self.filter_q_n2 * steps,
        )


def without(tuning: OwnTuning, *ideas: str) -> OwnTuning:
    """The tuning with some of its switches, the fields of type bool, turned off."""
    values = {field.name: getattr(tuning, field.name) for field in fields(tuning)}
    return OwnTuning(**(values | dict.fromkeys(ideas, False)))


def unsurveyed(tuning: OwnTuning) -> OwnTuning:
    """The numbers where nobody surveyed ropes and load: there is no balance of the body to narrow
    what friction hides. At rest friction is anywhere in its set, and intervals report all of that.
    """
    alone = without(tuning, "balance", "weighs")
    return fully_reported(replace(alone, rest_share=EVEN, fresh_more=0.0), stuck=0.6)


def unfelt(tuning: OwnTuning) -> OwnTuning:
    """The numbers where no inertial unit measured the body's acceleration: fast changes of the
    loads, by blows above all, cannot be followed, and intervals are as wide as the filter's own.
    """
    alone = replace(without(tuning, "shakes"), steady_sd_n=tuning.moving_sd_n)
    return fully_reported(alone, stuck=0.85)


def fully_reported(tuning: OwnTuning, stuck: float = 1.0) -> OwnTuning:
    """The numbers with intervals as wide as the filter's own uncertainty; on a vertical piston that
    never slid, of the share `stuck` of it.
    """
    return replace(
        tuning,
        reported_sliding=1.0,
        reported_begun=1.0,
        reported_constants=1.0,
        reported_resting=1.0,
        reported_stopped=1.0,
        reported_loaded=1.0,
        reported_stuck=stuck,
        reported_led=stuck,
        spread_share=1.0,
        spread_stuck=stuck,
    )
