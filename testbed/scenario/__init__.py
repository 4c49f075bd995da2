"""Scenario and sweep files, read into frozen, checked objects."""
