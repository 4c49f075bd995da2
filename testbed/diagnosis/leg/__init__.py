"""What one leg or axis lacks, from its recordings."""
