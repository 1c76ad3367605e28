"""Two wheels on the frame, and how far their teeth are from where they should be."""

from __future__ import annotations

from math import cos, pi, radians

import mechdae as md
from mechdae.parts.exchange.workshop.bodies import Rigid
from mechdae.parts.exchange.workshop.gearing import gearing_of
from mechdae.parts.exchange.workshop.teeth import least_gap
from mechdae.tasks.motion_of import motion_of


def pair(teeth=(20, 50), mesh="external", far=0.07, **keys: object) -> md.Problem:
    """Return two wheels on the frame, of the module 2 mm by default."""
    wheels = [md.Body(name, points={"O": [0, 0]}) for name in ("one", "two")]
    joints = [
        md.Revolute("A", "ground.A", "one.O"), md.Revolute("B", "ground.B", "two.O"),
        md.Gear("mesh", "one.O", "two.O", teeth=teeth, mesh=mesh, **keys),
    ]  # fmt: skip
    ground = md.Ground(points={"A": [0, 0], "B": [far, 0]})
    mechanism = md.Mechanism(ground, wheels, joints, sketch={"one": 0.1})
    return md.Problem(mechanism, {"turn": md.Sweep(md.Driver("one.angle", from_=0, to=7), poses=9)})


def faults() -> tuple[float, float]:
    """Return how far a tooth is from a space of its mate [pitches], and its gap from the known one.

    At the pitch point both wheels' teeth are at places that add up to half of a pitch; a tooth in
    the middle has a gap of j cos(alpha)/2 on either side, j being 0.04 modules.
    """
    motion = motion_of(pair(), None)
    (mesh,) = gearing_of(motion, Rigid(motion), {}).meshes
    places = 0.0
    for toward, name, wheel in ((0.0, "one", mesh.one), (pi, "two", mesh.mate)):
        angle = float(motion.result.bodies[name].angle[motion.first])
        places += (toward - angle - wheel.teeth.phase) * wheel.count / (2 * pi)
    gap, _ = least_gap(mesh.one.teeth, mesh.mate.teeth, 0.07)
    known = 0.04 * 0.002 * cos(radians(20)) / 2
    return abs(places % 1 - 0.5), abs(gap / known - 1)
