"""Mechanisms that do not close: what stays open where."""
