"""What the whole robot lacks: which leg, which effect."""
