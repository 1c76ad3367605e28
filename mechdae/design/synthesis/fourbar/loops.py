"""Four-bar loops of a mechanism: lengths, pivots and coupler point as expressions of p.

Whatever the user calls his parameters, a loop of four revolutes with the driven link as crank
has ground r1, crank r2, coupler r3, rocker r4, a fixed pivot and a direction of the ground line;
a point of the coupler has coordinates along A-B and across it.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import casadi as ca

from mechdae.describe.mechanism import GROUND
from mechdae.equations.reduction import Scene
from mechdae.records import dataclass
from mechdae.types import Sym

if TYPE_CHECKING:
    from mechdae.describe.joints.pairs import Revolute


SX = ca.SX


@dataclass(frozen=True)
class FourBar:
    """A four-bar loop.

    ``lengths`` (4,): ground, crank, coupler, rocker. ``offsets``: body -> direction of its link
    line in its own frame [rad], from the pin nearer to the crank's pivot (for the rocker: from its
    fixed pin).
    """

    lengths: Sym
    pivot: Sym
    turn: Sym
    crank: str
    coupler: str
    rocker: str
    offsets: dict[str, Sym]

    def point(self, scene: Scene, reference: str) -> Sym:
        """Return a coupler point, or the origin of the coupler, along and across A-B, (2,)."""
        body = reference.split(".")[0]
        model = scene.model
        place = model.local(reference) if "." in reference else model.local_origin(body)
        gap = place - model.local(self._pin)
        a = self.offsets[body]
        return ca.vertcat(
            ca.cos(a) * gap[0] + ca.sin(a) * gap[1], ca.cos(a) * gap[1] - ca.sin(a) * gap[0]
        )

    @property
    def _pin(self) -> str:
        return self.pins["A"]

    pins: dict[str, str] = None  # type: ignore[assignment]


def four_bar(scene: Scene) -> FourBar | None:
    """Return the four-bar loop next to the driver, None where there is none.

    The driven link turns about a pin on a body that does not move, and a dyad RRR closes the
    loop on such a body too.
    """
    mechanism = scene.model.mechanism
    if mechanism.dimension != 2 or len(scene.drivers) != 1 or not scene.drivers[0].is_angle:
        return None
    driven = [group for group in scene.groups if group.driven]
    if len(driven) != 1 or len(driven[0].bodies) != 1:
        return None
    crank = driven[0].bodies[0]
    fixed = {GROUND, *[b for g in scene.groups if g.kind == "weld" for b in g.bodies]}
    base = [mechanism.joints[name] for name in driven[0].joints]
    if len(base) != 1 or not base[0].hinge or not set(base[0].bodies) & fixed:
        return None
    for group in scene.groups:
        joints = [mechanism.joints[name] for name in group.joints]
        if group.kind != "RRR" or len(group.bodies) != 2:
            continue
        inner = mechanism.joints[group.inner[0]]
        outer = [joint for joint in joints if joint is not inner]
        first = next((j for j in outer if crank in j.bodies), None)
        last = next((j for j in outer if set(j.bodies) & fixed), None)
        if first is None or last is None or first is last:
            continue
        coupler = next(b for b in first.bodies if b != crank)
        rocker = next(b for b in last.bodies if b not in fixed)
        if {coupler, rocker} != set(group.bodies):
            continue
        return _described(scene, base[0], first, inner, last, (crank, coupler, rocker))
    return None


def _described(
    scene: Scene, base: Any, first: Any, inner: Any, last: Any, links: tuple[str, str, str]
) -> FourBar:
    model = scene.model
    crank, coupler, rocker = links
    sides = (
        ("A0", base, crank), ("A on crank", first, crank), ("A", first, coupler),
        ("B", inner, coupler), ("B on rocker", inner, rocker), ("B0", last, rocker),
    )  # fmt: skip
    pins: dict[str, str] = {name: joint.ends_at(body)[0] for name, joint, body in sides}

    def gap(a: str, b: str) -> Sym:
        return model.local(b) - model.local(a)

    def fixed_place(joint: Revolute, body: str) -> Sym:
        return scene.expression(model.point(joint.ends_at(body)[1]))

    A0, B0 = fixed_place(base, crank), fixed_place(last, rocker)
    lines = {
        crank: gap(pins["A0"], pins["A on crank"]),
        coupler: gap(pins["A"], pins["B"]),
        rocker: gap(pins["B0"], pins["B on rocker"]),
    }
    ground = B0 - A0
    lengths = [ca.sqrt(ca.sumsqr(line)) for line in (ground, *lines.values())]
    offsets = {body: ca.atan2(line[1], line[0]) for body, line in lines.items()}
    turn = ca.atan2(ground[1], ground[0])
    return FourBar(ca.vertcat(*lengths), A0, turn, crank, coupler, rocker, offsets, pins)
