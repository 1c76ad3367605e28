"""Starts for any mechanism."""
