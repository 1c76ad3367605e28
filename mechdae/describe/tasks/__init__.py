"""What to compute, as frozen values."""
