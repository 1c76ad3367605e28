"""A body that six distances hold from bodies that are known: all poses, at most 40."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from mechdae.describe.coordinate_kinds import LENGTH, UNIT
from mechdae.equations.groups import Group
from mechdae.equations.reduction import Scene
from mechdae.motion.cases.larger_groups.rigid_parts import (
    Coordinates,
    GroupPoses,
    OtherShape,
    ShapedGroup,
)
from mechdae.motion.cases.space.known_sides import KnownSides, RodsAndJoints
from mechdae.numerics.homotopy.platforms import platform_poses
from mechdae.numerics.homotopy.study_quadrics import MOST

if TYPE_CHECKING:
    from mechdae.types import Floats


LEGS = 6
BASIS = f"homotopy: {MOST} complex poses are certified, as many as there can be"
FAR = "homotopy: {} complex poses and {} at infinity are certified, as many as there can be"


class SixLegs(ShapedGroup):
    """A platform on six legs of given lengths: bars, and links that spin between ball joints."""

    def __init__(self, scene: Scene, group: Group, p: Floats) -> None:
        model: Any = scene.model
        parts = RodsAndJoints(model, group)
        if group.superfluous or len(parts.bodies) != 1:
            raise OtherShape
        (self.hub,) = parts.bodies
        self._own = [c for c in model.coordinates if c.owner == self.hub]
        if len(parts.rods) != LEGS or not (self._free and all(j.bar for j in parts.joints)):
            raise OtherShape
        places: dict[str, str] = {}
        for k, rod in enumerate(parts.rods):
            places[f"platform {k}"], places[f"base {k}"] = rod.ends(self.hub, group)
        lengths = {f"length {k}": rod.length for k, rod in enumerate(parts.rods)}
        self._point = places["platform 0"]
        self.sides: KnownSides = KnownSides(scene, group, p, places, {}, lengths)

    @property
    def _free(self) -> bool:
        """Whether place and quaternion of the body are its coordinates."""
        return [c.kind for c in self._own] == [LENGTH] * 3 + [UNIT] * 4

    def solve(self, q: Coordinates, u: Floats) -> GroupPoses:
        at = self.sides.at(q)
        base, platform = (
            [at[f"{word} {k}"].ravel() for k in range(LEGS)] for word in ("base", "platform")
        )
        lengths = [float(at[f"length {k}"].item()) for k in range(LEGS)]
        found = platform_poses(base, platform, lengths)
        poses = [
            self._coordinates(place, e)
            for place, e in zip(found.position, found.quaternion, strict=True)
        ]
        basis = FAR.format(found.regular, found.far) if found.far else BASIS
        return GroupPoses(
            poses,
            found.proven,
            basis if found.proven else "",
            generic=MOST,
            singular=found.singular + found.far,
            bounded=True,
            placed=(self._point, *found.complex_places(platform[0])),
        )

    def _coordinates(self, place: Floats, e: Floats) -> dict[tuple[str, str], float]:
        """Return the coordinates of a displacement of points given from the body's anchor."""
        values = [*place, *e]
        return {c.key: float(value) for c, value in zip(self._own, values, strict=True)}
