"""Elastic, unilateral feet with friction in equilibrium."""
