"""Groups in space, and axes that have a sense."""
