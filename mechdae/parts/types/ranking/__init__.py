"""Variants of a mechanism that were solved: which assemble, what they are worth, which is first."""
