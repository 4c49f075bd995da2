"""What the feet carry: expected from balance, or found from motion."""
