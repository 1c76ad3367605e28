"""Course reports: assignment, diagram, structure, one position in full, all in a table."""

from __future__ import annotations

from mechdae.parts.paper.reports.report import Report, report

__all__ = ["Report", "report"]
