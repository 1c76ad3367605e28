"""One certified motion: its path, limit positions, change points, poses along it."""
