"""Explanations of spatial mechanisms: vector equations of three components, forces of six."""
