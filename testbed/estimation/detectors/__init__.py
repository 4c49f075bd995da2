"""Detectors of contact loss: from measurements to a score per foot; a threshold turns a score into an alarm.

signals.py makes what all of them look at; each detector is one file and one line in table.py.
"""
