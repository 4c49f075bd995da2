"""From pressures to cylinder forces, foot loads and contact."""
