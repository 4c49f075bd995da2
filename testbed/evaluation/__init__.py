"""Recordings in and out, metrics, benchmarks, the paper's experiments."""
