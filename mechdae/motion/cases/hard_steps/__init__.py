"""Steps of a path that are not proved, and what is met there."""
