"""Recordings, rigs and model files: what passes between the testbed and the outside."""
