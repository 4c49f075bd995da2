"""The paper's experiments, one figure a file: each a pure function from nothing to data and judged
claims.
"""
