"""Spatial mechanisms: coordinates of a tree of joints, equations of the others."""
