"""What an estimator must pass."""
