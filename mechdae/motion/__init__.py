"""Poses and certified motion of a mechanism: set up, assembled, followed, measured."""
