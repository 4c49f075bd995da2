"""Holding out on a slope: keep every foot loaded, friction use low and the body still."""

from __future__ import annotations

from testbed.envs.base import RoboclimberEnv


class StandEnv(RoboclimberEnv):
    """`Roboclimber/Stand-v0`: the scenario stand_slope_45 as an environment."""


class DrillEnv(RoboclimberEnv):
    """`Roboclimber/Drill-v0`: the scenario drill_slope_45 as an environment."""
