"""Theory of the four-bar: starts, exact designs, cognates."""
