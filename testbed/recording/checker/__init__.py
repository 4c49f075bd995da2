"""What is wrong with a recording: its clock, its sensors, and its signs and scales against the laws
of the machine.
"""
