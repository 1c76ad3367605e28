"""What clearance adds."""

from __future__ import annotations

from mechdae.additions import Added, Adds, TaskKind

ADDS: Adds = {
    "tasks": {
        "play": TaskKind(
            "mechdae.parts.play.task:Play",
            run="mechdae.parts.play.run:play",
            show="mechdae.motion.kinematics.show:driven_structure",
            trial="mechdae.motion.kinematics.show:tried",
            text="mechdae.parts.play.text:TEXTS",
            after="reactions",
        ),
    },
    "series": {
        f"{name}_band": Added("mechdae.parts.play.first:band")
        for name in ("position", "distance", "angle", "slide")
    },
    "pictures": {"band": Added("mechdae.parts.play.drawn.pictures:BAND", after="coupler")},
}
