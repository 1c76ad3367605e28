"""Labels: places where they cover nothing, letters and numbers."""
