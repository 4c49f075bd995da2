"""Detectors of contact loss: from measurements to a score per foot; a threshold turns a score into
an alarm.

derived.py makes what they look at beside the estimates; base.py says what a detector is; each is
one file and one line in table.py.
"""
