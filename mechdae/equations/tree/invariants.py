"""Equations of a cut ball joint, those first that do not hold the coordinate its body hangs on.

A ball joint between the bodies B and N closes with g = 0, three equations in all coordinates of
the loop. B hangs on another joint: with d from there to the ball's centre on N, and c to the one on
B, what does not depend on that joint's own coordinates is said first: small blocks are left.

    revolute, universal   |d|^2 = |c|^2,  w.d = w.c,  (w x c).d = 0
    prismatic             n.d = n.c,  m.d = m.c,  a.d = a.c + slide
    universal, prismatic  |d|^2 = |q|^2,  n.d = n.q,  m.d = m.q

w is the axis that is fixed in B, q leads from the cross to c where the slide is driven. The last
rows hold for a direction of opposite sense too: what must be positive is given with them.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import casadi as ca

from mechdae.describe.joints.joint import Joint
from mechdae.equations.tree.closures import UNIT, Closed, CutJoint, Rows
from mechdae.equations.tree.joint_chains import (
    Freedom,
    Way,
    WayProduct,
    WayProducts,
    X,
    Z,
    back,
    joined,
)
from mechdae.equations.tree.spatial_frames import TreeFrame, placed
from mechdae.records import dataclass
from mechdae.types import Sym

SX = ca.SX


def crossed(joint: Joint | None) -> bool:
    """Return whether a joint has two crossed pins."""
    return bool(getattr(joint, "crossed", False))


@dataclass(frozen=True)
class Hung:
    """A body with a ball joint, and the joint that it hangs on.

    ``frame`` is the body's and ``parent`` that of its neighbour, both seen from one frame; ``ball``
    the ball's centre in the body (3,) from its anchor. ``joint`` is what it hangs on, ``driven`` or
    not, ``before`` what the neighbour hangs on.
    """

    frame: TreeFrame
    parent: TreeFrame
    ball: Sym
    joint: Joint
    before: Joint | None
    driven: bool
    forward: bool

    @property
    def crossed(self) -> bool:
        """Whether it hangs on two crossed pins."""
        return crossed(self.joint)

    @property
    def c(self) -> Sym:
        """From the anchor to the ball in the frame's basis."""
        return ca.sparsify(self.frame.turn.T @ self.ball)


@dataclass(frozen=True)
class Invariants:
    """Rows of a ball joint, and what must be positive where it is closed."""

    rows: Rows
    positive: list[Any]


def invariants(hung: Hung, other: TreeFrame, centre: Sym, size: float) -> Invariants | None:
    """Return the rows of a ball joint of a hung body; None: the plain ones are as good.

    Parameters
    ----------
    other, centre
        The frame of the other body and the ball's centre in it from its anchor.
    size
        A length of the mechanism, by which products of lengths are divided.
    """
    make = _form(hung)
    if make is None:
        return None
    return make(hung, other, centre, size)


def _form(hung: Hung) -> Callable[..., Invariants | None] | None:
    pin = hung.joint.hinge and hung.joint.freedoms == 1
    if hung.crossed or (pin and not hung.driven):
        return _on_axis
    if hung.joint.guide and not hung.driven:
        return _on_slide
    return _on_leg if hung.joint.guide and crossed(hung.before) else None


def _gap(start: Way, place: Sym, other: TreeFrame, centre: Sym) -> CutJoint:
    """Return what is between the end of a way, its place, and the ball's centre on the other."""
    eye, way = SX.eye(3), other.to(centre, SX.eye(3))
    hung = ((1.0, other.direction(centre), centre),) if other.on_ball else ()
    assert way is not None
    return CutJoint(other.point(centre) - place, eye, eye, ways=(start, way), hung=hung)


def _along(part: str, start: Sym, basis: Sym, d: CutJoint, known: Sym) -> Closed:
    """Return start.d - known = 0 for a direction in a basis."""
    assert d.ways is not None
    way = joined(back(d.ways[0]), d.ways[1])
    reach = WayProducts((WayProduct(way, start),), SX(-known))
    return Closed(part, ca.dot(ca.sparsify(basis @ start), d.gap) - known, "m", reach)


def _on_axis(hung: Hung, other: TreeFrame, centre: Sym, size: float) -> Invariants | None:
    frame, c = hung.frame, hung.c
    pin = X if hung.crossed and hung.forward else Z
    normal = ca.sparsify(ca.cross(UNIT[pin], c))
    if normal.nnz() == 0:
        return None
    assert frame.way is not None
    d = _gap(frame.way, frame.r, other, centre)
    square = ca.sumsqr(c) / (2 * size)
    far = Closed("away", d.half_square / size - square, "m", d.square_reach(1 / size, -square))
    across = SX(c)
    across[pin] = 0
    rows = [
        far,
        _along("along", UNIT[pin], frame.basis, d, c[pin]),
        _along("turned", normal / size, frame.basis, d, SX(0)),
    ]
    return Invariants(rows, [ca.dot(frame.basis @ across, d.gap)])


def _on_slide(hung: Hung, other: TreeFrame, centre: Sym, size: float) -> Invariants | None:
    frame, c = hung.frame, hung.c
    assert frame.way is not None
    slide = frame.way[-1]
    assert isinstance(slide, Freedom)
    before = frame.way[:-1]
    r, basis = placed(before)
    d = _gap(before, r, other, centre)
    shift = [SX(0), SX(0), slide.sense * slide.symbols[0]]
    parts = zip(("n", "m", "a"), UNIT, c.elements(), shift, strict=True)
    return Invariants([_along(w, e, basis, d, k + s) for w, e, k, s in parts], [])


def _on_leg(hung: Hung, other: TreeFrame, centre: Sym, size: float) -> Invariants | None:
    frame, parent = hung.frame, hung.parent
    assert frame.way is not None
    assert parent.way is not None
    inside = frame.way[len(parent.way) :]
    still, basis = placed(inside[:-1])
    moved, _ = placed(inside)
    still, q = still + basis @ hung.c, moved + basis @ hung.c
    d = _gap(parent.way, parent.r, other, centre)
    square = ca.sumsqr(q) / (2 * size)
    rows = [Closed("away", d.half_square / size - square, "m", d.square_reach(1 / size, -square))]
    for k, word in enumerate(("n", "m")):
        start = ca.sparsify(basis[:, k])
        rows.append(_along(word, start, parent.basis, d, ca.dot(start, still)))
    axis = basis[:, 2]
    return Invariants(rows, [ca.dot(parent.basis @ axis, d.gap) * ca.dot(axis, q)])
