"""Diagrams of spatial mechanisms: axonometric, near parts in front of far ones."""
