"""The laboratory: each benchmark a folder of its own."""
