"""Equilibria, their stability, small motions around them."""
