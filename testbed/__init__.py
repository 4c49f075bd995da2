"""ROBOCLIMBER testbed: heavy hydraulic legged machines on steep ground."""

__version__ = "0.1.0"
