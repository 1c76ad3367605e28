"""Gears in space whose teeth are known, as free bodies."""

from __future__ import annotations

from math import cos, radians, sin
from typing import Any

import numpy as np

import mechdae as md
from tests.reference.spatial_bodies import Contact
from tests.shared.spatial_forces import place, pose_of

ALPHA = radians(20)


def teeth_as_contacts(result: md.Result, k: int, teeth: dict[str, Any]) -> Any:
    """Return the pose as free bodies; `teeth` gives the pitch point and the two flanks' normals.

    Of both flanks the one is taken that pushes.
    """
    tried = []
    for flank in range(2 ** len(teeth)):
        pose = pose_of(result, k, skip=tuple(teeth))
        for i, (name, (P, flanks)) in enumerate(teeth.items()):
            joint = result.mechanism.joints[name]
            own = np.concatenate([flanks[flank >> i & 1], np.zeros(3)])[:, None]
            pose.contacts[name] = Contact(joint.first_body, joint.second_body, P, own)
        reactions, efforts, left, _ = pose.solve()
        pushes = [
            reactions[name][:3] @ flanks[flank >> i & 1] >= 0
            for i, (name, (_, flanks)) in enumerate(teeth.items())
        ]
        if all(pushes):
            tried.append((reactions, efforts, left))
    assert len(tried) == 1
    reactions, efforts, left = tried[0]
    for name, (P, _) in teeth.items():  # about the second point of `between`
        own, arm = reactions[name], P - place(result, result.mechanism.joints[name].second, k)
        reactions[name] = own + np.concatenate([np.zeros(3), np.cross(arm, own[:3])])
    return reactions, efforts, left


def planets(mesh_loss: float | None = None, **more: Any) -> md.Mechanism:
    """Return sun and planet on a carrier that turns about z; the ring is the frame."""
    r_s, r_p, r_r = 0.024, 0.018, 0.06
    turn, loss = {"axis": [0, 0, 1]}, {"mesh_loss": mesh_loss}
    return md.Mechanism(
        dimension=3,
        ground=md.Ground({"O": [0, 0, 0], "M": [0, 0, 0.03]}),
        bodies=[
            md.Body("carrier", {"O": [0, 0, 0], "P": [r_s + r_p, 0, 0]}),
            md.Body("sun", {"O": [0, 0, 0], "M": [0, 0, 0.03]}),
            md.Body("planet", {"P": [0, 0, 0], "M": [0, 0, 0.03]}),
        ],
        joints=[
            md.SpatialRevolute("C", "ground.O", "carrier.O", **turn),
            md.SpatialRevolute("S", "carrier.O", "sun.O", **turn),
            md.SpatialRevolute("Q", "carrier.P", "planet.P", **turn),
            md.SpatialGear(
                "inner", "sun.M", "planet.M", carrier="carrier", ratio=-r_p / r_s, **loss
            ),
            md.SpatialGear(
                "ring", "ground.M", "planet.M", carrier="carrier", ratio=r_p / r_r, **loss
            ),
        ],
        **{"sketch": {"C": 0}} | more,
    )


def teeth_of_planets(angle: float) -> dict[str, Any]:
    """Return pitch points and flanks of the planets with their carrier at an angle."""
    out, along = np.array([cos(angle), sin(angle), 0]), np.array([-sin(angle), cos(angle), 0])
    up = np.array([0, 0, 0.03])
    outwards, inwards = (
        [s * cos(ALPHA) * along + side * sin(ALPHA) * out for s in (1, -1)] for side in (1, -1)
    )
    return {"inner": (0.024 * out + up, outwards), "ring": (0.06 * out + up, inwards)}
