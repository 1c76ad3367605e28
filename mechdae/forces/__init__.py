"""Reactions, friction, losses and efforts along a sweep."""
