"""Scalar filters for a force signal, one file a filter: its `Numbers`, a compiled `step`, and `run`
over an array (see base.py).
"""
