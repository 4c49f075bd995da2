"""Motions of the machine: standing, swaying, walking. A new one is a file here and a line in
table.py.
"""
