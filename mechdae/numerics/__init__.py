"""Numerical methods on NumPy arrays that know nothing of mechanisms."""
