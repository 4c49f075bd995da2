"""Detectors of contact loss: from measurements to a score per foot; a threshold turns a score into
an alarm.

sample.py makes what they look at beside the estimates; base.py says what a detector is; each is
a class and a line in table.py.
"""
