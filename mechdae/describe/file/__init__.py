"""Problem files: reading, writing, checks, JSON Schema."""
