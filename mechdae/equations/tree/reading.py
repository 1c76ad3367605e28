"""The coordinates of a tree model from the places of its bodies, whatever these were found with."""

from __future__ import annotations

from collections.abc import Mapping

import casadi as ca

from mechdae.describe.mechanism import GROUND
from mechdae.equations.coordinates import QUATERNION
from mechdae.equations.tree.spatial_frames import TreeFrame, spherical
from mechdae.equations.tree.tree_model import TreeModel
from mechdae.types import Sym

SX = ca.SX
WIDTH = 12
"""Numbers of a placed body: its origin, then its rotation matrix by columns."""


def placements(model: TreeModel) -> Sym:
    """Return origin and rotation matrix of each body of the tree, stacked, over q."""
    bodies = [edge.child for edge in model.edges]
    return ca.vertcat(*[ca.vertcat(model.origin(b), ca.vec(model.frame(b).R)) for b in bodies])


def reading(model: TreeModel, bodies: list[str], at: Sym) -> tuple[Sym, Sym]:
    """Return what the coordinates of a model are where its bodies have other places.

    Parameters
    ----------
    bodies
        The bodies placed, in the order of `at`.
    at : SX (12 bodies,)
        As `placements` gives them.

    Returns
    -------
    SX (nq,), SX (9 balls,)
        Values of the coordinates, 0 for those of quaternions; rotation matrices of these, by
        columns, in the order of the coordinates. Angles lie within half a turn of 0.
    """
    frames: dict[str, TreeFrame] = {GROUND: TreeFrame(SX(3, 1), SX.eye(3), SX.eye(3))}
    for k, body in enumerate(bodies):
        entries = at[WIDTH * k : WIDTH * (k + 1)]
        frames[body] = TreeFrame(entries[:3], ca.reshape(entries[3:], 3, 3), SX.eye(3))
    values: dict[tuple[str, str], Sym] = {}
    turns: list[Sym] = []
    owners = dict.fromkeys(c.owner for c in model.coordinates)
    for owner in owners:
        found, Q = _of_owner(model, owner, frames)
        values |= {(owner, word): value for word, value in found.items()}
        if (owner, QUATERNION[0]) in model.places:
            turns.append(ca.vec(Q))
    ordered = [values.get(key, SX(0)) for key in model.q_names]
    return ca.vertcat(*ordered), ca.vertcat(*turns) if turns else SX(0, 1)


def _of_owner(
    model: TreeModel, owner: str, frames: Mapping[str, TreeFrame]
) -> tuple[dict[str, Sym], Sym]:
    """Return what a joint's coordinates are by name, and its rotation matrix."""
    if owner in model.mechanism.bodies:  # a body that is placed by itself
        frame = frames[owner]
        place = frame.point(_own(model, f"{owner}.{model.anchor(owner)}"))
        return dict(zip("xyz", ca.vertsplit(place), strict=True)), frame.R
    joint = model.mechanism.joints[owner]
    first, second = (frames[body] for body in joint.bodies[:2])
    if joint.pointer:
        ends = [f.point(_own(model, p)) for f, p in ((first, joint.first), (second, joint.second))]
        return spherical(joint, model.numbers, ends[1] - ends[0]), SX.eye(3)
    A1, A2 = (f.side(model._side(owner, bool(k))) for k, f in enumerate((first, second)))
    gap = second.point(_own(model, joint.second)) - first.point(_own(model, joint.first))
    Q, t = A1.T @ A2, A1.T @ gap
    found = {"x": t[0], "y": t[1], "slide": t[2], "angle": ca.atan2(Q[1, 0], Q[0, 0])}
    found["angle2"] = ca.atan2(Q[2, 1], Q[2, 2])
    lead = model._lead(owner)
    if lead is not None:
        whole = 2 * ca.pi
        found["angle"] += whole * ca.floor((t[2] / lead - found["angle"]) / whole + 0.5)
    return found, Q


def _own(model: TreeModel, reference: str) -> Sym:
    """Return a point's coordinates in its body."""
    return ca.vertcat(*[model.numbers[f"{reference}.{axis}"] for axis in "xyz"])
