"""Scalar filters for a force signal: one file a filter, all with the same two compiled functions.

`step(state, z, p) -> x` takes one sample and changes `state` in place; `run(z, p) -> x` filters an array.
`reference.py` holds the published two on filterpy, for recordings and the figures of the paper.
"""
