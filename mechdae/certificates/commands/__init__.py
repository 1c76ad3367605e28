"""The command of certificates."""
