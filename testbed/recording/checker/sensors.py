"""Each channel by itself: values that are no numbers, clipped, frozen, out of all range."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace

import numpy as np

from testbed.formats.arrays import Array, Flags
from testbed.recording.checker.command import REVERSED_M, frozen_command
from testbed.recording.checker.finding import Finding
from testbed.recording.checker.raw import REFERENCE, Raw, repetitions

STOOD_S = 0.05
"""A value that stood for longer before it jumped was held."""
MUCH_CLIPPED, SOME_CLIPPED = 0.5, 0.01
"""Shares of clipped samples that are an error and a warning."""
SENSED = ("pressure_", "supply", "actuator", "force", REFERENCE)
"""Channels whose noise shows whether the sensor is alive and within its range."""
FORCES = (REFERENCE, "actuator_force", "force")
CLIPPED_SHARE, CLIPPED_RUN = 0.002, 6
"""A noisy channel that stands at its extreme in this share of the samples, and so many in a row, is
clipped.
"""
PRESSED, STIRS = 0.1, 0.02
"""Shares of its span by which a pressure changes while a load cell at its end does not: that say
enough alone; and beside a value that stands OUT times as often as the next one."""
OUT = 4.0
NOISY = 0.6
"""A channel that repeats itself in less than this share of the steps is noisy: a long repetition
means something.
"""
FROZEN_S, FROZEN_TIMES = 0.2, 4.0
"""A frozen channel repeats one value for this long, and for so many times what its noise would ever
do by chance.
"""
ALONE_TIMES = 10.0
"""Times that the longest repetition of a force is longer than the next one where it is frozen."""
JUMP_TIMES = 6.0
"""A frozen sensor that wakes up steps by so many times its largest usual step."""


LARGEST = 1e30
"""No sensor reads so many of any SI unit."""


def readable(values: Array) -> Flags:
    """Which values a sensor can have read: finite ones below LARGEST."""
    return np.abs(values) < LARGEST


def check_numbers(raw: Raw) -> Iterator[Finding]:
    """Values that are not finite numbers, or larger than any sensor reads, by channel."""
    for name, values in raw.series.items():
        bad = ~readable(values)
        if bad.all():
            beyond = f", beyond {LARGEST:g}" if np.isfinite(values).all() else ""
            evidence, advice = f"{bad.size} rows{beyond}", "leave the channel out"
            yield Finding("error", name, "holds no number at all", evidence, advice)
        elif bad.any():
            first, last = np.flatnonzero(bad)[[0, -1]]
            bridged = raw.rig == "foot" and name == "force"
            yield Finding(
                "warning" if bridged else "error",
                name,
                "is larger than any sensor reads"
                if np.isfinite(values).all()
                else "is not a number",
                f"{int(bad.sum())} rows, first row {first}",
                "detect holds its state there" if bridged else "leave these rows out",
                float(raw.time_s[first]),
                float(raw.time_s[last]),
            )


def check_frozen(raw: Raw) -> Iterator[Finding]:
    """Sensors that repeat one value while the machine goes on."""
    for name, values in raw.series.items():
        found: Iterator[Finding] = iter(())
        if name == "valve_command":
            found = frozen_command(raw)
        elif name.startswith("position"):
            found = _frozen_then_steps(raw, name, values)
        elif name.startswith(SENSED):
            found = _frozen_sensor(raw, name, values)
        yield from _longest_of(list(found))


def _longest_of(found: list[Finding]) -> Iterator[Finding]:
    """The longest stretch, with the number of all of them."""
    if not found:
        return
    worst = max(found, key=lambda f: (f.to_s or 0.0) - (f.from_s or 0.0))
    also = f"; {len(found)} such stretches" if len(found) > 1 else ""
    yield replace(worst, evidence=worst.evidence + also)


def _frozen_sensor(raw: Raw, name: str, values: Array) -> Iterator[Finding]:
    first, length = repetitions(values)
    if len(first) == 1:
        moves = _travel(raw, 0, len(values) - 1) > REVERSED_M
        yield Finding(
            "error" if moves else "warning",
            name,
            "never changes" + (" while the piston moves" if moves else ""),
            f"{values[0]:.6g} in all {len(values)} rows",
            "the sensor is dead or not connected: leave the channel out",
        )
        return
    # A value repeats by chance with the share seen outside the longest run: so long is the longest
    # run of chance.
    longest = int(np.argmax(length))
    outside = len(values) - int(length[longest])
    repeats = (np.sum(length - 1) - (length[longest] - 1)) / max(outside, 1)
    coarse = NOISY if name.startswith(("pressure_", "supply")) else 0.1
    if (
        repeats > coarse
        and _alone(length)
        and _held_while_pressed(raw, values == values[first[longest]])
    ):
        coarse = NOISY
    if repeats > coarse:  # a coarse one repeats itself by right
        at_work = np.abs(values) > 0.05 * np.abs(values).max()
        yield from _frozen_then_steps(raw, name, np.where(at_work, values, 0.0))
        yield from _frozen_at_work(raw, name, values, at_work)
        return
    chance = np.log(len(values)) / -np.log(np.clip(repeats, 1e-3, 0.999))
    step_s = float(np.median(np.diff(raw.time_s)))
    limit = max(FROZEN_TIMES * chance, FROZEN_S / step_s, 12.0)
    low, high = raw.ranges_pa.get(name, (-np.inf, np.inf))
    for index in np.flatnonzero(length > limit):
        start, stop = int(first[index]), int(first[index] + length[index] - 1)
        at_end = values[start] <= low or values[start] >= high - 1e-3 * (high - low)
        if at_end or _at_extreme(values, values[start]):
            continue
        yield _is_frozen(raw, name, values, start, stop, float(chance))


def _frozen_at_work(raw: Raw, name: str, values: Array, at_work: Flags) -> Iterator[Finding]:
    """A coarse force that rests by right, and repeats itself while it works as it does nowhere
    else, though the pressure stirs.
    """
    first, length = repetitions(values)
    works = at_work[first]
    if works.sum() < 2:
        return
    longest = int(np.argmax(np.where(works, length, 0)))
    others = works & (np.arange(len(first)) != longest)
    repeats = float(np.sum(length[others] - 1)) / float(np.sum(length[others]))
    chance = np.log(len(values)) / -np.log(np.clip(repeats, 1e-3, 0.999))
    step_s = float(np.median(np.diff(raw.time_s)))
    start, stop = int(first[longest]), int(first[longest] + length[longest] - 1)
    there = np.zeros(len(values), dtype=np.bool_)
    there[start : stop + 1] = True
    if (
        repeats < NOISY
        and length[longest] > max(FROZEN_TIMES * chance, FROZEN_S / step_s)
        and not _at_extreme(values, values[start])
        and _held_while_pressed(raw, there, STIRS)
    ):
        yield _is_frozen(raw, name, values, start, stop, float(chance))


def _is_frozen(raw: Raw, name: str, values: Array, start: int, stop: int, chance: float) -> Finding:
    return Finding(
        "error",
        name,
        "is frozen at one value",
        f"{values[start]:.6g} for {stop - start + 1} samples; by chance at most about {chance:.0f}",
        "cut this stretch out",
        float(raw.time_s[start]),
        float(raw.time_s[stop]),
    )


def _alone(length: Array) -> bool:
    """Whether the longest of the repetitions is one like no other: a coarse force that rests does
    so again and again.
    """
    longest, next_one = np.sort(length)[[-1, -2]]
    return bool(longest > ALONE_TIMES * next_one)


def _at_extreme(values: Array, value: float) -> bool:
    return bool(value == values.max() or value == values.min())


def _frozen_then_steps(raw: Raw, name: str, values: Array) -> Iterator[Finding]:
    """A sensor that stands still and then steps to where the machine meanwhile has gone."""
    steps = np.abs(np.diff(values))
    usual_s = np.diff(raw.time_s)
    speed = steps / np.maximum(usual_s, 1e-9)
    regular = usual_s < 3.5 * np.median(usual_s)
    if not steps.any() or not regular.any():
        return
    fast = float(np.quantile(speed[regular], 0.995))
    finest = max(raw.resolutions.get(name, 0.0), float(np.median(steps[steps > 0.0])))
    limit = JUMP_TIMES * np.maximum(fast * usual_s, finest)
    first, length = repetitions(values)
    for index in range(len(first) - 1):
        start, stop = int(first[index]), int(first[index] + length[index] - 1)
        stood_s = raw.time_s[stop] - raw.time_s[start]
        away = values[start] != 0.0  # a force of 0 steps to a load when the foot lands
        if stood_s > STOOD_S and away and regular[stop] and steps[stop] > limit[stop]:
            yield Finding(
                "error",
                name,
                "is frozen, then steps",
                f"{values[start]:.6g} for {stood_s:.3g} s, then a step of {steps[stop]:.3g} "
                f"within {usual_s[stop]:.2g} s",
                "cut this stretch out",
                float(raw.time_s[start]),
                float(raw.time_s[stop]),
            )


def _travel(raw: Raw, start: int, stop: int) -> float:
    position = raw.series.get("position")
    return 0.0 if position is None else float(np.ptp(position[start : stop + 1]))


def check_clipped(raw: Raw) -> Iterator[Finding]:
    """Channels at the end of their declared range, or that stand at their extreme as no noisy
    channel does. A gauge reading that stands at a declared 0 is that of an empty chamber.
    """
    for name, values in raw.series.items():
        if not name.startswith(SENSED):
            continue
        declared = raw.ranges_pa.get(name)
        ends = []
        if declared is not None:
            margin = 1e-3 * (declared[1] - declared[0])
            ends = [(declared[1], values >= declared[1] - margin, "declared")]
            if declared[0] != 0.0:
                ends.append((declared[0], values <= declared[0] + margin, "declared"))
        first, length = repetitions(values)
        if len(first) > 1 and np.sum(length - 1) / len(values) < NOISY:
            for extreme in (float(values.max()), float(values.min())):
                if not (declared and _is_end(extreme, declared)) and _cut_off(raw, name, extreme):
                    ends.append((extreme, values == extreme, "seen"))
        elif name in FORCES:
            top = float(values[np.argmax(np.abs(values))])
            changes = STIRS if _stands_out(values, top) else PRESSED
            if top and _held_while_pressed(raw, values == top, changes):
                ends.append((top, values == top, "seen"))
        reported = False
        for end, there, how in ends:
            share, longest = float(there.mean()), _longest(there)
            enough = (
                there.any()
                if how == "declared"
                else (share > CLIPPED_SHARE and longest >= CLIPPED_RUN)
            )
            if not enough or reported:
                continue
            reported = True
            yield _clipped(raw, name, end, there, how)


def _is_end(value: float, declared: tuple[float, float]) -> bool:
    """Whether a value is one of the two ends of a declared range."""
    low, high = declared
    margin = 1e-3 * (high - low)
    return value <= low + margin or value >= high - margin


def _stands_out(values: Array, extreme: float) -> bool:
    """Whether an extreme comes far more often than the value next to it: a channel that turns round
    there spends no more time at its last count than at the one before.
    """
    others = values[values != extreme]
    if not others.size:
        return False
    next_one = others[np.argmin(np.abs(others - extreme))]
    return bool((values == extreme).sum() > OUT * (others == next_one).sum())


def _cut_off(raw: Raw, name: str, extreme: float) -> bool:
    """Whether a noisy channel stands out at its extreme, or stays there as no noise does; a force
    only while a pressure stirs.
    """
    values = raw.series[name]
    there = values == extreme
    rests = name in FORCES and "pressure_a" in raw.series
    stays = _longest(there) > FROZEN_TIMES * _longest_by_chance(values, there)
    return (stays or _stands_out(values, extreme)) and (
        not rests or _held_while_pressed(raw, there, STIRS)
    )


def _longest_by_chance(values: Array, without: Flags) -> float:
    """How often in a row a noisy channel repeats itself at most, as the other rows have it."""
    same = np.diff(values) == 0.0
    usual = same[~(without[1:] & without[:-1])]
    repeats = float(np.clip(np.mean(usual), 1e-3, 0.999)) if usual.size else 0.999
    return float(np.log(len(values)) / -np.log(repeats))


def _held_while_pressed(raw: Raw, there: Flags, changes: float = PRESSED) -> bool:
    """Whether the pressure goes on changing, by a share `changes` of its span, in the longest
    stretch in which a coarse force stays at its extreme.
    """
    pressure = raw.series.get("pressure_a")
    if pressure is None:
        return False
    edges = np.flatnonzero(np.diff(np.concatenate([[0], there.astype(np.int8), [0]])))
    starts, stops = edges[::2], edges[1::2]
    longest = int(np.argmax(stops - starts))
    held = pressure[starts[longest] : stops[longest]]
    low, high = np.quantile(pressure, [0.01, 0.99])
    return bool(np.ptp(held) > changes * (high - low))


def _clipped(raw: Raw, name: str, end: float, there: Flags, how: str) -> Finding:
    share = float(there.mean())
    first, last = np.flatnonzero(there)[[0, -1]]
    some = how == "seen" or share > SOME_CLIPPED
    severity = "error" if share > MUCH_CLIPPED else "warning" if some else "note"
    return Finding(
        severity,  # type: ignore[arg-type]
        name,
        "is clipped" if how == "declared" else "is clipped where no range is declared",
        f"{100 * share:.2g} % of the samples at {end:.6g}, up to {_longest(there)} in a row",
        "these samples are left out"
        if how == "declared"
        else "declare range_pa, so that they are left out",
        float(raw.time_s[first]),
        float(raw.time_s[last]),
    )


def _longest(there: Flags) -> int:
    """The most True values in a row."""
    edges = np.flatnonzero(np.diff(np.concatenate([[0], there.astype(np.int8), [0]])))
    return int((edges[1::2] - edges[::2]).max()) if edges.size else 0


def check_ranges(raw: Raw) -> Iterator[Finding]:
    """Values that cannot be in the unit they are said to be in."""
    for name, values in raw.series.items():
        low, high = (float(level) for level in np.quantile(values, [0.01, 0.99]))
        for prefix, floor, ceiling, what, advice in _PLAUSIBLE:
            if name.startswith(prefix) and (low < floor or high > ceiling):
                yield Finding(
                    "error", name, what, f"98 % lie between {low:.4g} and {high:.4g}", advice
                )


_PLAUSIBLE: tuple[tuple[str | tuple[str, ...], float, float, str, str], ...] = (
    (
        ("pressure_", "supply_pressure"),
        -1.2e5,
        1.5e8,
        "cannot be a gauge pressure in Pa",
        "put sign, unit or calibration right",
    ),
    ("valve", -1.01, 1.01, "is beyond -1 to 1", "declare unit '%' or scale it"),
    ("oil_temperature", -50.0, 180.0, "is hardly in degC", "declare unit K or degF"),
    ("attitude_", -6.4, 6.4, "is hardly in rad", "declare unit deg"),
    ("rope_tension_", -500.0, 1e6, "a rope does not push", "turn its sign, or put its zero right"),
)
"""Prefix of the quantity, lowest and highest plausible value, what is wrong beyond them, what to
do.
"""
