"""What timings add."""

from __future__ import annotations

from mechdae.additions import Added, Adds

ADDS: Adds = {
    "commands": {
        "bench": Added(
            "mechdae.parts.bench.commands.bench",
            after="modules",
            about="speed against error",
        ),
    },
}
