"""Groups read as rigid parts with pins, guides and bars, and all their poses by paths."""
