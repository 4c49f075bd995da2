"""The machine's numbers, each with unit, source and mark."""
