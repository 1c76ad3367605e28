"""Joints that move between limits."""
