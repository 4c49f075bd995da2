"""Sharing the load out between feet and ropes."""
