"""Whole turns that gears, belts, racks and screws tell apart."""
