"""Bodies that turn about one point, as mechanisms."""

from __future__ import annotations

from typing import Any

import numpy as np

import mechdae as md

G = 9.81
ACROSS, AXIAL, MASS, ARM = 0.02, 0.015, 2.0, 0.3


def pinned(
    inertia: Any, centre: Any = (0, 0, 0), gravity: float = 0.0, size: float = 1.0, **more: Any
) -> md.Mechanism:
    """Return a body on a ball joint; points P and Q lie at 1 on its axes z and x."""
    points = {"O": (0, 0, 0), "P": (0, 0, size), "Q": (size, 0, 0)}
    body = md.Body(
        "top", points, mass=MASS, center=np.array(centre) * size,
        inertia=[own * size**2 for own in inertia],
    )  # fmt: skip
    return md.Mechanism(
        dimension=3,
        ground=md.Ground({"O": (0, 0, 0)}),
        bodies=[body],
        joints=[md.Spherical("O", "ground.O", "top.O")],
        gravity=(0, 0, -gravity * size),
        **more,
    )


def heavy_top(size: float = 1.0, **more: Any) -> md.Mechanism:
    return pinned((ACROSS, ACROSS, AXIAL), (0, 0, ARM), G, size, **more)


def started(tilt: float, w: Any, size: float = 1.0) -> dict[str, Any]:
    """Return the keys of a start with the body turned by `tilt` about y, and its spin `w`."""
    s, c = np.sin(tilt), np.cos(tilt)
    Q = np.array([c, 0, -s]) * size
    P = np.array([s, 0, c]) * size
    vP, vQ = np.cross(w, P), np.cross(w, Q)
    start = {"top.P.x": P[0], "top.P.y": 0.0, "top.Q.y": 0.0}
    speeds = {f"top.P.{a}": vP[i] for i, a in enumerate("xyz")}
    speeds |= {f"top.Q.{a}": vQ[i] for i, a in enumerate("xyz")}
    return {"start": start, "start_speed": speeds}
