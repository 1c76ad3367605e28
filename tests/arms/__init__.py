"""Tests of arms with six turning axes."""
