"""Comparisons of the package with other methods; not part of what is installed."""
