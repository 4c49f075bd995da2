"""Random runs whose two likeliest sets of effects are often close: what a second motion is for.

Of ordinary runs three to five in a hundred are. Here the machine of a sound run hides one effect,
drawn as there and made smaller, and that is drawn anew until the sound recording lets two sets of
effects be predicted to be close: what its balances would miss with the effect is added to what they
miss. Nothing is drawn by the run itself, whose noise is another. Sets that are close to nothing at
all are not sought: any effect that only begins to show is, and noise decides then.
"""

from __future__ import annotations

import copy
import json
import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
from scipy.linalg import solve_triangular

from testbed.benchmarks.diagnosis.robot_draws import KINDS, Drawn, drawn, effect_drawn, hidden_sizes
from testbed.benchmarks.diagnosis.robot_recordings import run_of
from testbed.benchmarks.diagnosis.robot_scores import second_motion
from testbed.benchmarks.diagnosis.robot_trials import Asked, balances_in, before_of, trial_of
from testbed.benchmarks.diagnosis.scores import Trial
from testbed.benchmarks.harness import Answers, Benchmark
from testbed.diagnosis.robot.groups import Candidate
from testbed.diagnosis.robot.hypotheses import Ledger
from testbed.diagnosis.robot.motion_kinds import motion_kinds
from testbed.diagnosis.robot.motions import rivals
from testbed.diagnosis.robot.probabilities import Names, RobotSigns, calibration, distribution
from testbed.effects.signature import Change
from testbed.errors import InputError
from testbed.formats.arrays import Array
from testbed.report.page import Table

LATER = 20_000
"""Seeds of noise of these runs are so much higher than those of the sound ones."""
SMALLEST = 0.05
"""An effect is made smaller down to this share, evenly in its logarithm."""
TRIES = 400
FAINT = 2.0
"""Ln of the evidence below which an effect is so faint that a sound machine is far likelier."""


def close_run(seed: int, recordings: Path | None) -> Drawn | None:
    """The run of a seed; None where nothing that is drawn is predicted to be close."""
    sound = drawn(seed)
    asked = Asked(recordings)
    balances = balances_in(run_of(sound.scenario(), recordings), before_of(sound, asked))
    forecast = Forecast(Ledger(balances))
    rng = np.random.default_rng([seed, 43])
    for _ in range(TRIES):
        hidden = small_effect(rng, sound.motion)
        two = rivals(forecast.ranked(hidden))
        if two is not None and () not in two:
            overrides = (*sound.overrides[:-1], f"undeclared={json.dumps([hidden])}")
            kind = "outside" if hidden["effect"] in hidden_sizes()["unnamed"] else "single"
            return replace(sound, kind=kind, hidden=(hidden,), overrides=overrides, later=LATER)
    return None


def small_effect(rng: np.random.Generator, motion: str) -> dict[str, Any]:
    """An effect of the table, each as likely as another, at one of its places."""
    sizes = hidden_sizes()
    table = {**sizes["named"], **sizes["unnamed"]}
    names = [n for n in sizes["small"] if sizes["only"].get(n, motion) == motion]
    name = names[int(rng.integers(len(names)))]
    hidden = effect_drawn(rng, name, table[name])
    share = math.exp(rng.uniform(math.log(SMALLEST), 0.0))
    values = hidden["parameters"]
    for parameter, without in sizes["small"][name].items():
        off = values[parameter] - without
        larger = math.isinf(without)
        values[parameter] = values[parameter] / share if larger else without + share * off
    return hidden


class Forecast:
    """The diagnosis expected of a sound recording with an effect added."""

    def __init__(self, sound: Ledger) -> None:
        self.sound = sound
        balances = sound.balances
        self._roots = {key: group.root() for key, group in balances.raw.items()}

    def ranked(self, hidden: Mapping[str, Any]) -> tuple[tuple[Names, float], ...]:
        """(names, probability) of single effects, the likeliest first; nothing for an effect of
        which the recording shows none of its numbers, or hardly anything.
        """
        name = f"{hidden['effect']}@{hidden['at']}"
        candidate = self.sound.balances.candidates.get(name)
        changes = [] if candidate is None else self._changes(candidate, hidden["parameters"])
        if not changes:
            return ()
        with_it = copy.copy(self.sound)
        with_it.gradient = self.sound.gradient + self._added(changes)
        if with_it.hypothesis((name,)).log_factor < FAINT:
            return ()
        tried = [with_it.hypothesis((n,)) for n in with_it.names]
        signs = RobotSigns.of(tried, motion_kinds(self.sound.balances))
        found = distribution(signs, calibration())
        return tuple(sorted(found.items(), key=lambda item: -item[1]))

    def _changes(self, candidate: Candidate, values: Mapping[str, float]) -> list[Change]:
        effect, seen = candidate.effect, self.sound.balances.body.seen
        if effect.bends:
            return [effect.made(seen, candidate.place, values)]
        linear, signature = effect.to_linear(values), candidate.signature
        return [signature[n].times(x) for n, x in linear.items() if n in signature]

    def _added(self, changes: Sequence[Change]) -> Array:
        """What changes add to the ledger's gradient, by its candidates' numbers."""
        out: Array = np.zeros(len(self.sound.gradient))
        balances = self.sound.balances
        for key, group in balances.raw.items():
            missed = np.sum([group.rows_of(change) for change in changes], axis=0)
            if not np.any(missed):
                continue
            white = solve_triangular(self._roots[key], missed, lower=True)
            for name, columns in balances.groups[key].columns.items():
                spreads = balances.candidates[name].spreads
                out[self.sound.numbers_of(name)] += spreads * (columns.T @ white)
        return out


@dataclass(frozen=True)
class CloseCases(Benchmark[int]):
    """The sound seeds among `runs` consecutive ones."""

    name = "robot_close"
    noun = "runs"
    runs: int = 60
    first_seed: int = 2000
    recordings: Path | None = None

    def cases(self) -> Mapping[str, int]:
        """The seeds."""
        seeds = range(self.first_seed, self.first_seed + self.runs)
        return {str(seed): seed for seed in seeds if KINDS[seed % len(KINDS)] == "clean"}

    def work(self, case: int) -> Trial:
        """See robot_trials.trial_of; `refused` where there is no such run, or control will not
        start it.
        """
        try:
            close = close_run(case, self.recordings)
            if close is None:
                return {"seed": case, "refused": "nothing is predicted to be close"}
            return trial_of(close, Asked(self.recordings, closed=False, alone=False))
        except InputError as error:
            return {"seed": case, "refused": str(error)}

    def made_from(self, case: int) -> str:
        """Where runs are kept has no say."""
        return repr(case)

    def without(self) -> tuple[str, ...]:
        """See RobotBlindTest."""
        names = ("*scores.py", "*calibration.py", "trials.py", "benchmark.py", "measured_rigs.py")
        return tuple(f"benchmarks/diagnosis/{name}" for name in names)

    def summarise(self, answers: Answers) -> dict[str, Any]:
        """Of those that were close indeed, what was said without a second motion and with it; and
        every one of them.
        """
        made = [one for one in answers.values() if "refused" not in one]
        close = [one for one in made if one["second"]]
        return {
            "refused": len(answers) - len(made),
            "runs": len(made),
            "seeds": [min(t["seed"] for t in made), max(t["seed"] for t in made)],
            "second": second_motion(close),
            "each": [_told(one) for one in close],
        }

    def tables(self, result: dict[str, Any]) -> Sequence[Table]:
        """The shares, then a line for each close run."""
        second = result["second"]
        first, last = result["seeds"]
        asked = {
            "all that is hidden is said, and nothing else": ("without", "with"),
            "... where it shows in both recordings together": ("visible_without", "visible_with"),
            "... with a third motion where two do not decide": ("without", "with_third"),
        }
        shares = []
        for what, keys in asked.items():
            before, after = (second[key] for key in keys)
            within = f"{after['low95']:.0%} to {after['high95']:.0%}" if after["of"] else "-"
            told = [f"{r['share']:.0%}" if r["of"] else "-" for r in (before, after)]
            shares.append([what, str(before["of"]), *told, within])
        title = f"{len(result['each'])} close of {result['runs']} runs, seeds {first} to {last}"
        heads = ["what", "of", "without a second motion", "with it", "95 %"]
        each = [[one[key] for key in EACH] for one in result["each"]]
        return [Table(title, heads, shares), Table("Each of them", list(EACH), each)]


EACH = ("seed", "hidden", "rivals", "first said", "motion", "both say")


def _told(one: Trial) -> dict[str, str]:
    """A line of the table."""
    said = [" and ".join(o["names"]) or o["verdict"] for o in (one, one["second"])]
    two = [" and ".join(names) or "none" for names in one["second"]["rivals"]]
    hidden = " and ".join(one["truth"])
    row = (str(one["seed"]), hidden, ", ".join(two), said[0], one["second"]["motion"], said[1])
    return dict(zip(EACH, row, strict=True))
