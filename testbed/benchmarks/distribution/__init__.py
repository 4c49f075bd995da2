"""Force-distributing controllers against an oracle."""
