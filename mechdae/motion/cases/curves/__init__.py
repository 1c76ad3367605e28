"""Contacts on curves: their places, corners, modes."""
