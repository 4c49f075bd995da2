"""The machine's URDF: generated, checked, merged, drawn."""
