"""The machine we believe in: URDF, cylinder linkage, Pinocchio terms, expected foot loads."""
