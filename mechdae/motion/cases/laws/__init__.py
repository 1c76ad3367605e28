"""Drivers that follow laws of time."""
