"""What formats of other programs add."""

from __future__ import annotations

from mechdae.additions import Added, Adds

ADDS: Adds = {
    "commands": {
        "new": Added(
            "mechdae.parts.exchange.commands.new",
            after="schema",
            about="a commented problem file to start from",
        ),
        "export": Added(
            "mechdae.parts.exchange.commands.export",
            after="assign",
            about="formats of other programs (dxf, mjcf, sdf, urdf, c, js), parts to cut and print",
        ),
    },
}
