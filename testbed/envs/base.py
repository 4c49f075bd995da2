"""The environment around a run: a step is a whole number of control ticks of the same loop as
`testbed run`.

A task declares its observation and its action row by row, and its reward term by term. Observations
are means over the step of measurements, estimates and control's own orders. Truth appears in the
reward and in `info` alone.
"""

from __future__ import annotations

import copy
import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import gymnasium
import numpy as np
from numpy.typing import NDArray

from testbed.control.gait import Layered, Observed, amounts
from testbed.control.layers import Trim
from testbed.envs.display import has_display
from testbed.envs.observations import (
    INCREMENTS,
    TABLE,
    Observer,
    fitted,
    in_units,
    increase,
    increased,
    rows_in,
)
from testbed.envs.randomisation import draw_overrides, named_set, reset_options
from testbed.envs.rewards import (
    HOLDING,
    LOST_N,
    Term,
    Truth,
    body_position,
    holding_amounts,
    term_weights,
    truth_of_step,
)
from testbed.errors import InputError, check_one_of
from testbed.formats.arrays import Array, Flags
from testbed.machine.model import Machine
from testbed.recording.rows import DataRow, TruthRow
from testbed.scenario.machines import machines_of
from testbed.scenario.scenario import Scenario, load_scenario

if TYPE_CHECKING:
    from testbed.world.saved import State

Vector = NDArray[np.float32]
Observation = Vector | dict[str, Vector]
PICTURE = (480, 360)
"""Width and height of a picture, pixels."""
TICK_MS = 10
"""A step is a whole number of control ticks of so long."""
DRAWS = 25
"""So many draws in a row that do not stand are no environment."""

KEPT = (bool, int, float, str, tuple, np.ndarray, type(None))
"""Attributes of these classes belong to an episode's state; all others are parts of its run."""


@dataclass(frozen=True)
class Saved:
    """An episode at an instant. Made by `save`, given to `restore` of the same environment."""

    run: Any
    state: State
    own: Mapping[str, Any]
    """What the environment keeps beside the run."""


class RoboclimberEnv(gymnasium.Env[Observation, NDArray[np.float32]]):
    """One scenario as an environment, on whatever machine the scenario has: ranges and rewards are
    of its size. All keyword arguments are plain JSON values.

    - `scenario`: a file, or the name of a shipped one; `overrides`: `a.b=c` changes of it
    - `duration_s`: simulated time of an episode; None: the scenario's
    - `randomisation`: name of a set in randomisation.yaml, or a mapping of its form; None: no draws
    - `step_ms`: simulated time of a step, a multiple of the control tick's 10 ms
    - `weights`: name of a reward's term -> size of its weight; those left out keep their own
    - `observations`: `flat`, one vector (len(table),) in [-1, 1], or `dict`, every row by its name
      and in its unit
    - `render_mode`: `human` opens a window, `rgb_array` lets `render` give pictures; None: neither

    Raises InputError for what cannot be used, and for what the scenario refuses.
    """

    table: tuple[Observed, ...] = TABLE
    """The observation, index by index: of the class with ROBOCLIMBER's ranges, of an environment
    with its machine's.
    """
    actions: tuple[Observed, ...] = INCREMENTS
    """The action, likewise."""
    terms: tuple[Term, ...] = HOLDING
    """What the reward is the sum of; a step's share of each is in its `info["reward_terms"]`."""
    metadata = {"render_modes": ["human", "rgb_array"], "render_fps": 50}  # noqa: RUF012 (gymnasium's own form)

    def __init__(
        self,
        scenario: str = "drill_slope_45",
        overrides: list[str] | None = None,
        duration_s: float | None = None,
        randomisation: str | Mapping[str, Any] | None = None,
        step_ms: int = 20,
        weights: Mapping[str, float] | None = None,
        observations: str = "flat",
        render_mode: str | None = None,
    ) -> None:
        if render_mode not in (None, *self.metadata["render_modes"]):
            raise InputError(
                "no such mode", field="render_mode", value=render_mode, allowed="human, rgb_array"
            )
        check_one_of(observations, ("flat", "dict"), "observations", "no such form")
        if not isinstance(step_ms, int | float) or step_ms < TICK_MS or step_ms % TICK_MS:
            raise InputError(
                "must be whole control ticks",
                field="step_ms",
                value=step_ms,
                allowed="10, 20, 30, ..",
            )
        self.render_mode = render_mode
        loaded = load_scenario(scenario, overrides or [], duration=duration_s)
        self._scenario, self._duration_s = scenario, duration_s
        self._overrides = list(overrides or ())
        self._step_s = step_ms / 1000.0
        self._by_name = observations == "dict"
        believed = machines_of(loaded).belief
        self.scale = believed.scale
        """The machine's size, with which ranges and rewards go."""
        self.table, self.actions = self._fitted(believed)
        self._randomisation = named_set(randomisation, self.scale)
        self._weights = term_weights(self.terms, weights or {}, self.scale)
        self.observation_space: gymnasium.Space[Any] = self._space()
        self.action_space = gymnasium.spaces.Box(-1.0, 1.0, (len(self.actions),), np.float32)
        self._sim: Any = None
        self._ended = True
        self._last: tuple[Array, Array] | None = None
        """Data and truth rows of the step before, (1, ..) each."""
        self._last_answer: tuple[Observation, dict[str, Any]] | None = None
        """What the last step or reset returned."""
        self._start: Saved | None = None
        """Where the last draw began."""

    def _fitted(self, machine: Machine) -> tuple[tuple[Observed, ...], tuple[Observed, ...]]:
        """The tables of observation and action with a machine's ranges."""
        return fitted(type(self).table, machine), fitted(type(self).actions, machine)

    def _space(self) -> gymnasium.Space[Any]:
        box = gymnasium.spaces.Box
        if not self._by_name:
            return box(-1.0, 1.0, (len(self.table),), np.float32)
        rows: dict[str, gymnasium.Space[Any]] = {
            row.column: box(row.low, row.high, (1,), np.float32) for row in self.table
        }
        return gymnasium.spaces.Dict(rows)

    # ---- gymnasium's five ------------------------------------------------------------------------

    def reset(
        self, *, seed: int | None = None, options: dict[str, Any] | None = None
    ) -> tuple[Observation, dict[str, Any]]:
        """A fresh run. `options` may hold `overrides`, a list of further `a.b=c` changes for this
        episode; or `same_machine`, true for the run before with other noise.

        A draw that falls, slides or tears a rope before the agent's first step, or that cannot be
        built, is drawn again. Raises InputError for another option, and for both of these.
        """
        super().reset(seed=seed)
        again, further = reset_options(options or {})
        if again:
            return self._again()
        refused: InputError | None = None
        for _ in range(DRAWS):
            try:
                data, truth = self._draw(further)
            except InputError as error:
                if not self._randomisation:
                    raise
                refused = error
                continue
            if self._sim.verdict == "stood":
                break
        else:
            raise refused or InputError(
                "never stands",
                field="randomisation",
                value=f"{DRAWS} draws",
                allowed="one that stands",
            )
        self._ended = False
        self._last_answer = self._observe(data), self._info(self._truth(data, truth), data)
        self._start = self.save()
        return self._last_answer

    def _again(self) -> tuple[Observation, dict[str, Any]]:
        """The beginning of the run before, with other noise from here on."""
        if self._start is None:
            raise InputError("no run before", field="options.same_machine", allowed="reset first")
        begun = self.restore(self._start)
        self._sim.reseed(int(self.np_random.integers(2**32)))
        return begun

    def save(self) -> Saved:
        """The episode at this instant. Raises InputError where none has begun."""
        if self._sim is None:
            raise InputError("no episode has begun", field="save", allowed="reset first")
        own = {
            name: value
            for name, value in vars(self).items()
            if isinstance(value, KEPT) and name != "_start"
        }
        return Saved(self._sim, self._sim.save(), copy.deepcopy(own))

    def restore(self, saved: Saved) -> tuple[Observation, dict[str, Any]]:
        """Go on from a state of this very episode's machine, to the last bit; returns what was
        returned at that instant. Raises InputError where another machine has been drawn since.
        """
        if saved.run is not self._sim:
            raise InputError(
                "belongs to another draw", field="state", allowed="one of the run since reset"
            )
        self._sim.restore(saved.state)
        vars(self).update(copy.deepcopy(dict(saved.own)))
        assert self._last_answer is not None
        return self._last_answer

    def _draw(self, further: list[str]) -> tuple[Array, Array]:
        """A new run and its first rows."""
        from testbed.world.simulation import Simulation

        self.close()
        drawn = draw_overrides(self._randomisation, self.np_random, self.scale)
        extra = [*self._overrides, *drawn, *further]
        run_seed = int(self.np_random.integers(2**32))
        spec = load_scenario(self._scenario, extra, seed=run_seed, duration=self._duration_s)
        self._sim = sim = Simulation(spec, gui=self.render_mode == "human" and has_display())
        believed = sim.machines.belief
        if self._fitted(believed) != (self.table, self.actions):
            raise InputError(
                "is another machine than the environment's",
                field="machine",
                value=f"{believed.total_mass_kg:.4g} kg",
                allowed="an environment of its own, for its own ranges",
            )
        self._begin(spec)
        self._observer = Observer(sim.data_columns, self.table)
        self._rows = rows_in(self._step_s, spec.rates.record_hz)
        self._last = None
        data, truth = self._settle()
        if not len(data) and self._sim.verdict == "stood":
            raise InputError(
                "leaves no step",
                field="duration_s",
                value=spec.duration_s,
                allowed="a longer episode",
            )
        return data, truth

    def step(
        self, action: NDArray[np.float32]
    ) -> tuple[Observation, float, bool, bool, dict[str, Any]]:
        """One step. Raises InputError for an action that is no vector of finite numbers, one a row
        of `actions`.
        """
        wanted = np.asarray(action, dtype=float)
        if wanted.shape != self.action_space.shape or not np.isfinite(wanted).all():
            allowed = f"{len(self.actions)} finite numbers"
            raise InputError(
                "cannot be used", field="action", value=wanted.tolist(), allowed=allowed
            )
        if self._ended:
            raise InputError("the episode has ended", field="step", allowed="reset first")
        wanted = np.clip(wanted, -1.0, 1.0)
        self._order(wanted)
        data, truth = self._run()
        if not len(data):  # the run ended before the next row
            assert self._last is not None
            data, truth = self._last
        known = self._truth(data, truth)
        lost = self._sim.verdict != "stood"
        over = bool(self._sim.finished and not lost)
        self._ended = bool(lost or over)
        amounts = self._amounts(known, wanted, bool(lost))
        parts = {name: self._weights[name] * amount for name, amount in amounts.items()}
        info = {**self._info(known, data), "reward_terms": parts}
        self._last_answer = self._observe(data), info
        return self._last_answer[0], float(sum(parts.values())), bool(lost), over, info

    def render(self) -> NDArray[np.uint8] | None:
        """A picture (360, 480, 3) for rgb_array; the window draws itself."""
        if self.render_mode != "rgb_array" or self._sim is None:
            return None
        picture: NDArray[np.uint8] = self._sim.picture(*PICTURE)
        return picture

    def close(self) -> None:
        """Give the engine's client back; the episode has ended then."""
        self._ended = True
        if self._sim is not None:
            self._sim.close()
            self._sim = None

    @property
    def next_s(self) -> float:
        """When the next step will be over, simulated time; infinite where there is none."""
        return math.inf if self._ended else float(self._sim.t_s) + self._step_s

    # ---- what a task may change ------------------------------------------------------------------

    def _begin(self, spec: Scenario) -> None:
        """Lay the agent's orders over the task's gait."""
        machine = self._sim.machine
        self._trim = Trim(self.scale)
        machine.gait = Layered(machine.gait, (self._trim,))

    def _settle(self) -> tuple[Array, Array]:
        """The run's first rows, after which orders hold; the wanted pulls begin at the ropes'
        tensions.
        """
        data, truth = self._sim.run_block(self._rows)
        if len(data):
            self._trim.pull_n = DataRow.from_table(data)["rope_tension"].mean(axis=0)
        return data, truth

    def _order(self, action: Array) -> None:
        """Take an action in [-1, 1] over into set points."""
        increase(self._trim, amounts(action, self.actions), self._sim.machines.belief)

    def _run(self) -> tuple[Array, Array]:
        """Let a step's time go by: its rows."""
        data, truth = self._sim.run_block(self._rows)
        return data, truth

    def _ordered(self) -> dict[str, float]:
        """What the agent and the drill have ordered so far, by the table's names."""
        known = self._sim.machine.drill_known()
        return {
            **increased(self._trim),
            "orders.thrust": known["ordered_thrust"],
            "orders.torque": known["ordered_torque"],
        }

    def _amounts(self, truth: Truth, action: Array, ended: bool) -> dict[str, float]:
        """How much of each of the reward's terms this step has, in the term's unit."""
        return holding_amounts(truth, action, ended)

    @property
    def most_left(self) -> float:
        """The most that the rest of the episode can pay; infinite where nobody knows."""
        return math.inf

    def action_masks(self) -> Flags:
        """(len(actions),) which rows of an action have an effect in the next step; in
        `info["action_mask"]` too.
        """
        return np.ones(len(self.actions), dtype=bool)

    # ---- reading ---------------------------------------------------------------------------------

    def _observe(self, data: Array) -> Observation:
        return self._in_form(self._observer.observe(data.mean(axis=0), self._ordered()))

    def _in_form(self, seen: Vector) -> Observation:
        """A flat observation in the form that was asked for."""
        if not self._by_name:
            return seen
        return {
            name: np.array([value], np.float32)
            for name, value in in_units(seen, self.table).items()
        }

    def _truth(self, data: Array, truth: Array) -> Truth:
        """What the reward may see of a step's rows, data and truth (n, columns); they become the
        step before.
        """
        rows = TruthRow.from_table(truth)
        before = rows if self._last is None else TruthRow.from_table(self._last[1])
        self._last = data[-1:], truth[-1:]
        stance = DataRow.from_table(data)["carrying"] == 1.0
        lost_n = self.scale.times("N") * LOST_N
        friction = self._sim.machine.engine.friction_under_feet
        return truth_of_step(rows, friction, stance, body_position(before[0]), lost_n)

    def _info(self, truth: Truth, data: Array) -> dict[str, Any]:
        """What a step tells beside its observation."""
        return {
            "t_s": float(data[-1, 0]),
            "verdict": str(self._sim.verdict),
            "lowest_normal_n": truth.lowest_normal_n,
            "friction_use": truth.friction_use,
            "feet_lost": truth.feet_lost,
            "loads_n": truth.loads_n.copy(),
            "action_mask": self.action_masks(),
        }
