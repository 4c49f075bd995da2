"""Speed against the bare engine."""
