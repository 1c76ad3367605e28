"""Mechanisms on paper: explanations, reports, assignments."""
