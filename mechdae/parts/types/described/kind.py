"""What computes and shows a task of composition."""

from __future__ import annotations

from mechdae.tasks.dispatch.solve import TaskKind

KIND = TaskKind(
    "mechdae.parts.types.schemes.job:composed",
    show="mechdae.parts.types.described.shown:scheme_structure",
    design="mechdae.parts.types.schemes.job:compose",
    log="pieces.jsonl",
)
