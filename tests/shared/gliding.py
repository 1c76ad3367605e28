"""A sleeve on a shaft and a body on a ball, with friction, that move under forces."""

from __future__ import annotations

from typing import Any

import numpy as np

import mechdae as md

G = 9.81
M, J, F, R = 2.0, 0.004, 0.2, 0.05


def sleeve(inertia: float = J, *loads: Any, **keys: Any) -> md.Mechanism:
    """Return a body that slides and turns on a level shaft along x."""
    keys = {"friction": F, "pin_radius": R} | keys
    return md.Mechanism(
        dimension=3,
        ground=md.Ground({"O": (0, 0, 0)}),
        bodies=[md.Body("sleeve", {"O": (0, 0, 0)}, mass=M, inertia=(inertia, 0.01, 0.01))],
        joints=[md.Cylindrical("C", "ground.O", "sleeve.O", axis=(1, 0, 0), **keys)],
        loads=loads,
        gravity=(0, 0, -G),
    )


def coast(mechanism: md.Mechanism, speed: float, turning: float, **keys: Any) -> md.Result:
    start = {"start": {"C.slide": 0.0, "C.angle": 0.0}}
    speeds = {"start_speed": {"C.slide": speed, "C.angle": turning}}
    return md.solve(mechanism, md.Motion(**start, **speeds, **({"until": 3.0} | keys)))


BALL, ROUGH = 0.03, 0.4
RHO = BALL * np.sin(np.arctan(ROUGH))


def on_ball(centre: Any, inertia: Any, joint: Any = None) -> md.Mechanism:
    ball = md.Spherical("O", "ground.O", "rod.O", friction=ROUGH, ball_radius=BALL)
    points = {"O": (0, 0, 0), "P": (0, 0, -1), "Q": (1, 0, 0)}
    return md.Mechanism(
        dimension=3,
        ground=md.Ground({"O": (0, 0, 0)}),
        bodies=[md.Body("rod", points, mass=M, center=centre, inertia=inertia)],
        joints=[joint or ball],
        gravity=(0, 0, -G),
    )


def turning(w: Any, **keys: Any) -> md.Motion:
    """Return the motion that begins upright with an angular velocity."""
    p, q = np.cross(w, [0, 0, -1]), np.cross(w, [1, 0, 0])
    speeds = {"rod.P.x": p[0], "rod.P.y": p[1], "rod.Q.y": q[1]}
    return md.Motion(
        start={"rod.P.x": 0.0, "rod.P.y": 0.0, "rod.Q.y": 0.0}, start_speed=speeds, **keys
    )
