"""Graphs of results: curves, paths of points, losses, polar diagrams, maps."""
