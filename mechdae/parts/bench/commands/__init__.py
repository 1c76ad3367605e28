"""The command that times."""
