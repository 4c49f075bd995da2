"""Blind tests of the diagnosis."""
