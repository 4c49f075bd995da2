"""What the own estimate is worth on machines that nobody declared."""
