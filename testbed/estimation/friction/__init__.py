"""Friction (5) identified from recordings."""
