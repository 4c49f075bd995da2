"""The physics as pure functions and compiled kernels, one law a file. No state looked up, no
engine.
"""
