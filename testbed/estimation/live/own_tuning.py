"""How sure the whole-body estimate (whole_body.py) is of what, and which of its ideas are on: for
everything, without a survey, without the body's acceleration.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, fields, replace

from testbed.machine.scale import Scale

EVEN = 1.0 / math.sqrt(3.0)
"""One standard deviation of what is anywhere in a set, as a share of the set's half width."""

TUNED_AT_S = 1.0e-3
"""What OwnTuning has by samples is for samples that are so far apart."""


@dataclass(frozen=True)
class OwnTuning:
    """How sure the estimator is of what, and which of its ideas are on. All numbers assumed (E) and
    chosen on runs that no result is taken from; see `testbed estimators`.

    `*_sd_*` is one standard deviation, `*_share` a share of what its name says, `*_keep_s` for how
    long a deviation lasts.
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
    """The same at the slowest speeds, beside that: a piston may stick and slip there."""
    slow_m_s: float = 0.008
    """Speed over which that fades."""
    speed_sd_m_s: float = 0.003
    """Of the piston speed: what friction may be off by because the speed is."""
    rest_share: float = 0.3
    """One standard deviation of friction at rest, of its set's half width; EVEN without
    load-holding valves.
    """
    fresh_more: float = 1.5
    """So much more of it right after a stop, while oil and friction settle."""
    fresh_s: float = 4.0
    """Over which that fades."""
    stuck_share: float = EVEN
    """Likewise of a piston that has not slid since the start: it may be stuck anywhere in its
    set.
    """
    sliding_keep_s: float = 0.5
    """Of friction while a piston slides."""
    rest_keep_s: float = 0.3
    """Of friction at rest."""
    rest_alike: float = 0.5
    """Correlation of friction between feet that have rested for `alike_after_s`: oil that leaks
    moves it the same way at all of them.
    """
    alike_after_s: float = 30.0
    """Of rest, after which friction is about as much alike."""
    body_keep_s: float = 0.3
    """Of the balance's own error: shorter than friction's, else it takes what a stuck piston hides
    for an error of the weight.
    """
    weight_share: float = 0.005
    """Of the weight, by which the balance of forces may be off."""
    centre_sd_m: float = 0.01
    """Of the centre of mass: the weight times this is what the balance of moments may be off by."""
    rope_share: float = 0.005
    """Of the ropes' tensions, by which the balance may be off."""
    drill_share: float = 0.05
    """Of the ordered thrust, by which it may."""
    blow_share: float = 0.2
    """Of the thrust, by which it may while the hammer blows."""
    force_sd_n: float = 300.0
    """Noise of the balance of forces."""
    moment_sd_n_m: float = 450.0
    """Noise of the balance of moments."""
    set_margin: float = 0.2
    """By so much of its width friction's set may be wider than believed."""
    news_share: float = 0.8
    """Of a change of the piston force at rest, that may be friction."""
    news_noise_n: float = 50.0
    """Of such a change, that is noise."""
    gate: float = 8.0
    """An observation that is more standard deviations off than this counts less."""
    blame_s: float = 1.0
    """Over which the balance is looked at for a sensor that lies."""
    blame_threshold: float = 2.5
    """Standard deviations at which a sensor is blamed."""
    doubt_cost: float = 10.0
    """Cost of a balance that is still believed before anything slid (doubt.py). On 26 tuning runs
    of sound drawn machines it is at most 5 standing and drilling, 8 raising, and 24 for moments of
    a crawl.
    """
    doubt_time_s: float = 2.0
    """Within which a doubted balance is given up, and believed again."""
    surprise_worth: float = 2.0
    """Unknowns that the belief is worth: so many more would have to be as far off as told before
    what is found says how far off the machine is (surprise.py).
    """
    surprise_s: float = 8.0
    """Over which what friction hides and the balance errs by is looked at for it."""
    zero_wander_n2_s: float = 1.0
    """Variance by which a zero of the cylinder force grows."""
    zero_sd_n: float = 20.0
    """The calibration itself, beside what the machine's tolerances say of the sensors."""
    dry_sd_n: float = 20.0
    """Dry friction likewise."""
    air_load_n: float = 1500.0
    """A foot that is not meant to carry and bears less is in the air,"""
    air_dwell_s: float = 0.15
    """once it has for so long."""
    air_sd_n: float = 40.0
    """Of the load of a foot in the air: how surely it is nothing."""
    carries_n: float = 300.0
    """From this load on a foot takes its part in fast changes of the body's load."""
    noise_sd_n: float = 15.0
    """Of a filtered load."""
    moving_sd_n: float = 110.0
    """What inertia and friction leave beside that while the piston slides."""
    steady_sd_n: float = 32.0
    """What they leave where the body goes steadily."""
    told_sliding: float = 0.45
    """Of the filter's standard deviation by friction, what an interval tells while the vertical
    piston slides (told_friction.py). These were chosen on drawn machines whose seals begin
    stuck anywhere.
    """
    told_begun: float = 1.8
    """When it has just begun to slide,"""
    told_begun_s: float = 0.05
    """and for about so long."""
    told_constants: float = 0.9
    """Of the filter's standard deviation by the machine's constants, while the vertical piston
    slides for longer: what a friction by speed errs by, one by load or a zero makes up for.
    """
    told_resting: float = 1.2
    """Likewise while it does not slide."""
    told_stopped: float = 0.43
    """Just after it came to rest: it keeps the friction of its stop."""
    told_loaded: float = 0.88
    """Once its force has gone over `told_loaded_within` times the width of friction's set since."""
    told_stuck: float = 0.62
    """While it has not slid since the start: what it may hide is as wide as its set, less what the
    balance of the body shows.
    """
    told_led: float = 0.29
    """Once its force has gone over `told_led_within` times that width since the start."""
    told_loaded_within: float = 1.0
    told_led_within: float = 0.7
    range_noise_n: float = 50.0
    """Over which a piston's force seems to go by noise alone."""
    spread_share: float = 0.75
    """Of the filter's standard deviation, what makes the spread that detectors weigh a load by."""
    spread_stuck: float = 0.7
    """Of that, on a vertical piston that never slid."""
    filter_q_n2: float = 150.0
    """Variance by which a load changes from sample to sample, for the filter of what is told."""
    filter_r_n2: float = 1500.0
    """Variance of what that filter is fed."""
    e_max_n: float = 500.0
    """A load that jumps by more is held back,"""
    hold_samples: float = 4.0
    """for so many samples: a spike is over by then, news is not."""

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
    """The tuning with some of its ideas, the fields that are true or false, switched off."""
    values = {field.name: getattr(tuning, field.name) for field in fields(tuning)}
    return OwnTuning(**(values | dict.fromkeys(ideas, False)))


def unsurveyed(tuning: OwnTuning) -> OwnTuning:
    """The same where nobody surveyed ropes and load: nothing balances the feet, so nothing narrows
    what friction hides. At rest it is anywhere in its set, and all of that is told.
    """
    alone = without(tuning, "balance", "weighs")
    return told_whole(replace(alone, rest_share=EVEN, fresh_more=0.0), stuck=0.6)


def unfelt(tuning: OwnTuning) -> OwnTuning:
    """The same where no inertial unit felt the body's acceleration: fast changes of the loads, of
    blows above all, are not followed, and what the filter does not know of is told.
    """
    alone = replace(without(tuning, "shakes"), steady_sd_n=tuning.moving_sd_n)
    return told_whole(alone, stuck=0.85)


def told_whole(tuning: OwnTuning, stuck: float = 1.0) -> OwnTuning:
    """The same with intervals of all that the filter does not know, on a vertical piston that never
    slid of a share.
    """
    return replace(
        tuning,
        told_sliding=1.0,
        told_begun=1.0,
        told_constants=1.0,
        told_resting=1.0,
        told_stopped=1.0,
        told_loaded=1.0,
        told_stuck=stuck,
        told_led=stuck,
        spread_share=1.0,
        spread_stuck=stuck,
    )
