"""Commands of types of mechanisms."""
