"""Assignments: variants of a problem with round numbers, a sheet and an answer key for each."""

from __future__ import annotations

from mechdae.parts.paper.assignments.assign import Assignment, Assignments, assign

__all__ = ["Assignment", "Assignments", "assign"]
