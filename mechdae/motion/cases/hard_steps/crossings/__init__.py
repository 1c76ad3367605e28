"""Change points: where branches cross, and where they nearly do."""
