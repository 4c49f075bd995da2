"""The simulated truth: engine, terrain, ropes, drill, hydraulics, sensors, undeclared effects."""
