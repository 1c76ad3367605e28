"""Robust goals: errors with standard deviations by tolerances added, exact derivatives."""
