"""Designs measured on their own files: what was asked for, with no code of the search."""
