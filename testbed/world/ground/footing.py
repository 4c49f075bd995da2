"""What each foot stands on: patches of other ground, loose ground that settles, the surface's
direction.

A foot takes on the stiffness of the place where it comes down and keeps it until it is lifted: a
loaded foot that slides onto firmer ground would otherwise stand deep inside it. Friction follows
the foot. Settlement belongs to a
footprint: it stays while the foot stands, and is there again if the foot comes back to it.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np

from testbed.effects.terms import HiddenFoot
from testbed.formats.arrays import Array
from testbed.laws.settlement import settled
from testbed.machine.names import LEGS
from testbed.scenario.terrain import Terrain
from testbed.world.engine import Engine
from testbed.world.ground.terrain import Ground

FOOTPRINT_M = 0.15
"""A foot that came this far in the air finds fresh ground: the foot plate's radius."""
AIR_N = 1.0
SELDOM = 5
"""While all feet stand, their places are looked up at every fifth tick: friction follows a sliding
foot by 50 ms.
"""
MOVED_M = 2.0e-6
"""The engine's ground is moved when settlement has changed by this much."""


@dataclass(frozen=True)
class Place:
    """Ground under one foot; plastic_n_m = inf where it does not settle."""

    friction: float
    stiffness_n_m: float
    damping_n_s_m: float
    plastic_n_m: float


class Footing:
    """Per-foot ground, brought up to date at every control tick. `feet` (4, 3): undersides at the
    start, world, m.

    `hidden`: what nobody declares of the ground under each foot, wherever it stands.
    """

    def __init__(
        self,
        terrain: Terrain,
        ground: Ground,
        engine: Engine,
        feet: Array,
        hidden: Sequence[HiddenFoot] = (HiddenFoot(),) * len(LEGS),
    ) -> None:
        self._hidden = tuple(hidden)
        self._ground, self._engine, self._terrain = ground, engine, terrain
        self._rotation = ground.rotation_slope_to_world
        start = feet @ self._rotation
        plastic = terrain.plastic_n_m or np.inf
        everywhere = Place(terrain.friction, terrain.stiffness_n_m, terrain.damping_n_s_m, plastic)
        self._places = [everywhere]
        self._of_ground = [True, *(patch.friction is None for patch in terrain.patches)]
        """Which places have the ground's friction and none of their own."""
        self._circles: list[tuple[float, float, float]] = []
        for patch in terrain.patches:
            x, y = (
                (patch.x_m, patch.y_m) if patch.foot is None else start[LEGS.index(patch.foot), :2]
            )
            self._circles.append((float(x), float(y), patch.radius_m))
            self._places.append(
                Place(
                    everywhere.friction if patch.friction is None else patch.friction,
                    patch.stiffness_n_m or everywhere.stiffness_n_m,
                    everywhere.damping_n_s_m
                    if patch.damping_n_s_m is None
                    else patch.damping_n_s_m,
                    patch.plastic_n_m or everywhere.plastic_n_m,
                )
            )
        self._loose = terrain.loose or sinking(self._hidden)
        self._on = [self._patch_at(foot) for foot in start]
        """Number of the place whose friction each foot has."""
        self._under = [self._place_of(leg) for leg in range(len(LEGS))]
        for leg, place in enumerate(self._under):
            engine.set_footing(leg, place.friction, place.stiffness_n_m, place.damping_n_s_m)
        self._depth, self._set = [0.0] * len(LEGS), [0.0] * len(LEGS)
        self._given_way = [0.0] * len(LEGS)
        self._ticks = 0
        self._print = start[:, :2].copy()

    def set_friction(self, friction: float) -> None:
        """Another friction wherever it is neither a patch's nor hidden under a foot."""
        for number, of_ground in enumerate(self._of_ground):
            if of_ground:
                self._places[number] = replace(self._places[number], friction=friction)
        for leg, place in enumerate(self._under):
            if self._of_ground[self._on[leg]] and self._hidden[leg].friction is None:
                self._under[leg] = replace(place, friction=friction)
                self._engine.set_footing(leg, friction, place.stiffness_n_m, place.damping_n_s_m)

    @property
    def loose(self) -> bool:
        """Whether any of the ground settles."""
        return self._loose

    @property
    def settlement_m(self) -> Array:
        """How far the ground has given way under each foot (4), m."""
        return np.asarray(np.array(self._depth) + np.array(self._given_way))

    @property
    def stiffness_n_m(self) -> Array:
        """Stiffness under each foot (4), N/m."""
        return np.array([p.stiffness_n_m for p in self._under])

    def own_friction(self, feet_in_world: Array) -> Array:
        """Friction of what is hidden under feet or of a patch with one of its own, (4,), with the
        undersides at these places (4, 3), m; nan where it is the ground's.
        """
        found = np.full(len(LEGS), np.nan)
        for leg, foot in enumerate(feet_in_world @ self._rotation):
            place, hidden = self._patch_at(foot), self._hidden[leg].friction
            if hidden is not None:
                found[leg] = hidden
            elif not self._of_ground[place]:
                found[leg] = self._places[place].friction
        return found

    def _place_of(self, leg: int) -> Place:
        """The place that a foot is on, with the friction that it hides."""
        place, friction = self._places[self._on[leg]], self._hidden[leg].friction
        return place if friction is None else replace(place, friction=friction)

    def _patch_at(self, foot: Array) -> int:
        """Number of the place under a foot given in the slope's frame: the last patch that holds
        it wins.
        """
        for number in range(len(self._circles), 0, -1):
            x, y, radius = self._circles[number - 1]
            if (foot[0] - x) ** 2 + (foot[1] - y) ** 2 <= radius**2:
                return number
        return 0

    def update(
        self, feet_in_world: Callable[[], Array], load_n: Array, normals: Array, dt: float
    ) -> None:
        """At the end of a tick: loads along the normal (4), N; writes normals (4, 3), world frame.

        Feet (4, 3), m, are asked for where one is in the air, otherwise at every SELDOM-th tick if
        it matters.
        """
        loads = load_n.tolist()
        self._ticks += 1
        in_air = min(loads) <= AIR_N
        due = in_air or self._ticks % SELDOM == 1
        local = heights = None
        if due and (in_air or self._loose or self._circles):
            local = feet_in_world() @ self._rotation
        if not self._ground.flat:
            if local is not None and (in_air or self._loose):
                heights, normals[:] = self._ground.surface(local[:, :2])
            if self._ticks == 1:  # no contacts yet
                normals[:] = [self._engine.feet.gap(leg)[1] for leg in range(4)]
            # On straight pieces a standing foot keeps its normal.
            if due or self._ground.heights_m is not None:
                self._engine.feet.normals(normals)
        if local is None and not self._loose:
            return
        if local is None:  # no foot changes its place, and under load only loose ground changes
            for leg, place in enumerate(self._under):
                if place.plastic_n_m < np.inf or self._hidden[leg].settling_m_s > 0.0:
                    self._settle(leg, None, 0.0, loads[leg], dt)
            return
        for leg, foot in enumerate(local):
            if self._circles:
                self._step_on(leg, foot, loads[leg] > AIR_N)
            if self._loose:
                self._settle(
                    leg, foot, 0.0 if heights is None else float(heights[leg]), loads[leg], dt
                )

    def _step_on(self, leg: int, foot: Array, loaded: bool) -> None:
        self._on[leg] = self._patch_at(foot)
        place, now = self._place_of(leg), self._under[leg]
        if loaded and place is not now:
            place = Place(place.friction, now.stiffness_n_m, now.damping_n_s_m, now.plastic_n_m)
        if place != now:
            self._under[leg] = place
            self._engine.set_footing(leg, place.friction, place.stiffness_n_m, place.damping_n_s_m)

    def _settle(
        self, leg: int, foot: Array | None, height_m: float, load_n: float, dt: float
    ) -> None:
        """Under load the ground goes down; a foot that is set down elsewhere finds it where it
        was.
        """
        now = self._depth[leg]
        if load_n > AIR_N:
            if foot is not None:
                self._print[leg] = foot[:2]
            now = settled(now, load_n, self._under[leg].plastic_n_m, self._terrain.settle_s, dt)
        elif foot is not None and np.hypot(*(foot[:2] - self._print[leg])) > FOOTPRINT_M:
            now = min(now, max(0.0, height_m - float(foot[2])))
        self._depth[leg] = now
        hidden = self._hidden[leg]
        if load_n > AIR_N and hidden.settling_m_s > 0.0:
            further = self._given_way[leg] + hidden.settling_m_s * dt
            self._given_way[leg] = min(further, hidden.settling_depth_m)
        sunk = now + self._given_way[leg]
        if abs(sunk - self._set[leg]) > MOVED_M:
            self._set[leg] = sunk
            self._engine.sink_ground(leg, sunk)


def sinking(hidden: Sequence[HiddenFoot]) -> bool:
    """Whether the ground gives way under any foot without anybody's declaring it."""
    return any(foot.settling_m_s > 0.0 for foot in hidden)


def footing_of(
    terrain: Terrain, ground: Ground, engine: Engine, feet: Array, hidden: Sequence[HiddenFoot]
) -> Footing | None:
    """None on one even ground that hides nothing: there is nothing to look up."""
    even = ground.flat and not terrain.patches and not terrain.loose
    if even and all(foot == HiddenFoot() for foot in hidden):
        return None
    return Footing(terrain, ground, engine, feet, hidden)
