"""Tests of the vector modules."""
