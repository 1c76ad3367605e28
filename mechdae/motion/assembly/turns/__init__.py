"""Whole turns of angles: which make another mode, and which make no difference."""
