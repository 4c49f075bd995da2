"""The estimators that run beside the machine, sample by sample."""
