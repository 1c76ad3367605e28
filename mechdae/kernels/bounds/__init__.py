"""Bounds of casadi expressions: over all poses, over boxes, over small moves."""
