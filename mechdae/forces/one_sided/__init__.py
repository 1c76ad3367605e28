"""Contacts that can push and not pull, or the other way round: where they would lift off."""
