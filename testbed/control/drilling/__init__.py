"""How hard the drill may press."""
