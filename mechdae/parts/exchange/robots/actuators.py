"""What drives a mechanism in a simulator: springs and dampers that hold its drivers' values.

A spring of stiffness M w^2, M the mass that a driver moves, gives in by g / w^2 times what its
weight's path is to the driver's; with the damper 2 M w it does not swing.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from mechdae.describe.tasks.kinds import Sweep
from mechdae.errors import MechdaeError
from mechdae.parts.exchange.robots.link_tree import LinkTree, driven_joint
from mechdae.tasks.solver import Solver
from mechdae.types import Floats

SWING = 200.0
"""Angular frequency of a driver's mass on its spring [rad/s], a tenth of what a step of 0.5 ms can
follow."""
FOLLOWED = 0.5
"""Phase of a spring's swing on the drive's own inertia in a step [rad]."""
BEYOND = 0.05
"""Share of a driver's range by which its limits are further out."""


@dataclass(frozen=True)
class Actuator:
    """A spring and damper on a coordinate of the tree: N/m and N s/m, or N m and N m s.

    ``start`` is the value in the pose of the tree, ``low`` and ``high`` are its limits.
    """

    driver: str
    coordinate: str
    start: float
    low: float
    high: float
    stiffness: float
    damping: float

    def armature(self, step: float) -> float:
        """Return the inertia of the drive itself with which steps [s] follow the spring alone.

        A massless rod on it would be thrown further in a step than loops can hold.
        """
        return self.stiffness * (step / FOLLOWED) ** 2


def actuators(tree: LinkTree) -> tuple[list[Actuator], list[str]]:
    """Return what drives the joints that are drivers, and the drivers that are no such joints."""
    motion = tree.motion
    drivers = {name: np.asarray(v.position, float) for name, v in motion.result.drivers.items()}
    masses = _moved(tree, drivers)
    words = {m.coordinate: m for m in tree.motions() if m.kind in ("hinge", "slide")}
    found, others = list[Actuator](), list[str]()
    for k, (driver, values) in enumerate(drivers.items()):
        joint, kind = driven_joint(motion, driver), driver.rpartition(".")[2]
        on = words.get(f"{joint}.{kind}") or words.get(driver)
        if on is None or masses is None or not masses[k] > 0:
            others.append(driver)
            continue
        reached = values[motion.rows] + (on.start - values[motion.first])
        more = BEYOND * (float(np.ptp(reached)) or (1.0 if on.kind == "hinge" else tree.size))
        ends = float(reached.min()) - more, float(reached.max()) + more
        gains = float(masses[k]) * SWING**2, 2 * float(masses[k]) * SWING
        found.append(Actuator(driver, on.coordinate, on.start, *ends, *gains))
    return found, others


def _moved(tree: LinkTree, drivers: dict[str, Floats]) -> Floats | None:
    """Return the mass or moment of inertia that each driver moves in the pose of the tree.

    Masses are taken to be at the points of their bodies, in equal parts.
    """
    motion = tree.motion
    if not drivers or not isinstance(motion.problem.task(motion.task), Sweep):
        return None
    at = np.array([values[motion.first] for values in drivers.values()])
    masses = np.zeros(len(at))
    try:
        pose = Solver(motion.problem, motion.task).poses(None, at if len(at) == 1 else at[None])
        for name, link in tree.links.items():
            for point in link.points:
                rate = pose.jacobian(f"points/{name}.{point}/position")[0]
                masses += link.mass.mass / len(link.points) * (rate**2).sum(axis=0)
            if motion.mechanism.dimension == 2:
                turn = pose.jacobian(f"bodies/{name}/angle")[0]
                masses += link.mass.inertia[2, 2] * (turn**2).sum(axis=0)
    except MechdaeError:  # no rates by the drivers
        return None
    return masses if np.isfinite(masses).all() else None
