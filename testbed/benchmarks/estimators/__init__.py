"""Every estimator on the same runs."""
