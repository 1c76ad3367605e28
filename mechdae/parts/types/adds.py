"""What types of mechanisms add."""

from __future__ import annotations

from mechdae.additions import Added, Adds, TaskKind

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
        "composition": TaskKind(
            "mechdae.parts.types.described.task:Composition",
            run="mechdae.parts.types.schemes.job:composed",
            show="mechdae.parts.types.described.shown:scheme_structure",
            text="mechdae.parts.types.drawn.scheme_text:TEXTS",
            design="mechdae.parts.types.schemes.job:compose",
            log="pieces.jsonl",
            after="synthesis",
        ),
    },
    "pictures": {"sheet": Added("mechdae.parts.types.drawn.pictures:SHEET", after="front")},
}
