"""The compiled hydraulics against stiff solvers and its own books."""
