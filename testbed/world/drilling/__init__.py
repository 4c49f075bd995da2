"""The drill, its cycle and the rock."""
