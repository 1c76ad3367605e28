"""What mechanisms on paper add."""

from __future__ import annotations

from mechdae.additions import Added, Adds

ADDS: Adds = {
    "commands": {
        "explain": Added(
            "mechdae.parts.paper.commands.explain",
            after="page",
            about="a pose on paper: equations of each group with their numbers",
        ),
        "report": Added(
            "mechdae.parts.paper.commands.report",
            after="edit",
            about="a course report: assignment, structure, positions, forces",
        ),
        "assign": Added(
            "mechdae.parts.paper.commands.assign",
            after="report",
            about="variants of a problem for a class, with sheets and answer keys",
        ),
    },
}
