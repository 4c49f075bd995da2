"""The order and names of legs, joints and axes, used everywhere."""

from __future__ import annotations

LEGS: tuple[str, ...] = ("fl", "fr", "rl", "rr")
JOINTS: tuple[str, ...] = ("rotation", "radial", "vertical")
AXES: tuple[str, ...] = tuple(f"{leg}_{joint}" for leg in LEGS for joint in JOINTS)
"""Twelve hydraulic axes, leg by leg: index = 3 * leg + joint."""

ROTATION: tuple[int, ...] = (0, 3, 6, 9)
RADIAL: tuple[int, ...] = (1, 4, 7, 10)
VERTICAL: tuple[int, ...] = (2, 5, 8, 11)
SIDES: tuple[str, ...] = ("left", "right")
GRAVITY_M_S2 = 9.81
