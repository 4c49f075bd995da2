"""Agents that were not trained: rules and models that act on an environment's observations."""
