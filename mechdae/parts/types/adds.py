"""What types of mechanisms add."""

from __future__ import annotations

from mechdae.additions import Added, Adds

ADDS: Adds = {
    "commands": {
        "chains": Added(
            "mechdae.parts.types.commands.chains",
            after="sensitivity",
            about="kinematic chains, inversions, drivers, Assur groups",
        ),
        "variants": Added(
            "mechdae.parts.types.commands.variants",
            after="chains",
            about="orders, fixed links, kinds of pairs, constructions of a mechanism",
        ),
        "rank": Added(
            "mechdae.parts.types.commands.rank",
            after="variants",
            about="variants of a mechanism by size, criteria and weights",
        ),
    },
    "tasks": {
        "composition": Added("mechdae.parts.types.described.task:Composition", after="synthesis"),
    },
    "task functions": {
        "composition": Added("mechdae.parts.types.described.kind:KIND", after="synthesis"),
    },
    "pictures": {"sheet": Added("mechdae.parts.types.drawn.pictures:SHEET", after="front")},
    "texts": {"composition": Added("mechdae.parts.types.drawn.scheme_text:TEXTS")},
}
