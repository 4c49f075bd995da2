"""Valve loops, posture, gait, ropes, force distribution, supervision."""
