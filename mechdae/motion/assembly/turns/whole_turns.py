"""Whole turns of geared bodies: which sketched angle decides them, how the modes are named.

The equations of gears, belts and racks hold unwrapped angles, so poses that differ by whole
turns of a body may be different modes. All other equations take such turns away: of a block
and its guide one may be sketched at 170 and the other at -190 degrees.
"""

from __future__ import annotations

import math
from collections.abc import Mapping

import numpy as np

from mechdae.describe.coordinate_kinds import ANGLE
from mechdae.describe.mechanism import GROUND, Mechanism
from mechdae.equations.reduction import Scene
from mechdae.kernels.run.local import Local, local
from mechdae.types import Floats, Unknowns

NOISE = 1e-6
"""Share of a turn within which a pose is half a turn away."""


class WholeTurns:
    """Whole turns of the angles of a scene, counted from the sketch.

    Parameters
    ----------
    scene
        Its unknowns and what follows from them.
    angles
        Sketched angles of bodies [rad].
    p
        Values of the parameters.
    """

    def __init__(self, scene: Scene, angles: Mapping[str, float], p: Floats) -> None:
        self.scene, self.angles, self.p = scene, angles, p
        self._deciding: dict[int, list[tuple[str, Local]]] = {}
        self._rigid = _turning_together(scene.model.mechanism)
        self.geared = [name for name in _geared(scene.model.mechanism) if name in angles]
        """Sketched bodies whose unwrapped angles are in an equation."""

    def told(self, i: int) -> list[tuple[str, Local]]:
        """Return the sketched geared bodies that turn like angle `i`, its own body first.

        With each comes its angle as a function of a pose.
        """
        if self.scene.unknowns[i].kind is not ANGLE:
            return []
        if i not in self._deciding:
            own, found = self.scene.unknowns[i].owner, []
            for body in sorted(self.geared, key=lambda name: name != own):
                angle = self.scene.turn_of(body)
                together = self._rigid[body] == self._rigid.get(own)
                if together and angle is not None and self.scene.held(angle)[0] == [i]:
                    found.append((body, self._angle(body)))
            self._deciding[i] = found
        return self._deciding[i]

    def _angle(self, body: str) -> Local:
        return local(self.scene, (body, ANGLE), lambda: self.scene.turn_of(body))

    def wanted(self, i: int, x: Unknowns, u: Floats) -> float:
        """Return the value of unknown angle `i` that the sketch asks for; 0 where it is silent.

        Of bodies that turn together it is the one that gears hang on that decides.
        """
        for body, angle in self.told(i):
            return float(x[i] - (angle(x, u, self.p).item() - self.angles[body]))
        return self.angles.get(self.scene.unknowns[i].owner, 0.0)

    def start(self, i: int, x: Unknowns, u: Floats) -> float:
        """Return the sketched angle `i` on the turn that the sketch asks for, nan without one."""
        own = self.angles.get(self.scene.unknowns[i].owner)
        if not self.told(i):
            return np.nan if own is None else own
        wanted = self.wanted(i, x, u)
        return wanted if own is None else own + 2 * np.pi * round((wanted - own) / (2 * np.pi))

    def number(self, i: int, x: Unknowns, u: Floats) -> int:
        """Return the whole turns of angle `i` between the sketch and a pose.

        Of two poses half a turn from the sketch it is always the lower one that counts as near.
        """
        turned = float(x[i]) - self.wanted(i, x, u)
        return math.floor(turned / (2 * math.pi) + 0.5 + NOISE)


def _geared(mechanism: Mechanism) -> list[str]:
    """Return the bodies whose unwrapped angles are in an equation, in declared order."""
    named = set()
    for joint in mechanism.joints.values():
        if joint.meshes:
            named |= {joint.first_body, getattr(joint, "carrier", None)}
            named |= {joint.second_body} if joint.wheels == 2 else set()
    return [name for name in mechanism.bodies if name in named]


def _turning_together(mechanism: Mechanism) -> dict[str, str]:
    """Return by body one of those that keep their angle to it: guided or welded ones."""
    leader = {name: name for name in (GROUND, *mechanism.bodies)}

    def of(name: str) -> str:
        while leader[name] != name:
            name = leader[name]
        return name

    for joint in mechanism.joints.values():
        if joint.keeps_angle:
            leader[of(joint.first_body)] = of(joint.second_body)
    return {name: of(name) for name in leader}
