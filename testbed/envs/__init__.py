"""Gymnasium environments around the same loop."""
