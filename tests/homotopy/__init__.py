"""Tests of homotopies."""
