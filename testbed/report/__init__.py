"""Pictures, HTML pages and console tables."""
