"""Wear: pressure times sliding speed, sliding distance of contacts whose surfaces are given."""
