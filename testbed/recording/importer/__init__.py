"""Recordings from other tools' files: CSV, Parquet, MCAP, with a map that says which column is
what.
"""
