"""Equations that only some mechanisms have."""
