"""Scalar filters for a force signal, one file a filter (base.py says what it holds); all of them in
table.py.

`reference.py` holds the published two on filterpy, for recordings and the figures of the paper.
"""
