"""Rollers that cut into their curve: poses that solve the equations and cannot be built.

The centre of a roller runs on the curve's parallel at its radius. Where the curve is bent
towards the roller more than the roller is, the parallel has turned back: the roller cuts
into the curve at the contact. Elsewhere it may cut into another part of the curve, which is
then nearer to the centre than the radius.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import casadi as ca
import numpy as np

from mechdae.model.contacts import Contact
from mechdae.model.reduction import Scene

PLACES = 1024
"""Places of the curve that are compared."""
CHUNK = 256
ROUGH = 1e-9
"""Share of the radius by which a roller may seem to cut: rounding."""


@dataclass(frozen=True)
class Cut:
    """A run of poses, first to last, in which a joint's roller cuts ``depth`` deep [m]."""

    joint: str
    first: int
    last: int
    depth: float


def cuts(scene: Scene, x: Any, u: Any) -> list[Cut]:
    """Return where rollers cut into their curves, at poses x (n, nx), u (n, nu)."""
    owners = {name for group in scene.groups for name in group.joints}
    found = []
    for name, contact in scene.model.contacts.items():
        if not len(x) or not contact.rolls or name not in owners:
            continue
        inputs = [scene.x, scene.u, scene.model.p]
        place = ca.Function("s", inputs, [scene.expression(contact.s)])
        p = scene.model.p_values
        depth = depths(contact, scene, np.array(place(x.T, u.T, p[:, None])).ravel())
        with np.errstate(invalid="ignore"):
            bad = depth > 0
        edges = np.flatnonzero(np.diff(np.concatenate([[0], bad.astype(int), [0]])))
        for a, b in zip(edges[::2].tolist(), edges[1::2].tolist(), strict=True):
            found.append(Cut(name, a, b - 1, float(depth[a:b].max())))
    return found


def depths(contact: Contact, scene: Scene, s: Any) -> Any:
    """Return how deep the roller cuts with the contact at `s` (n,) [m]; 0 where it does not."""
    low, high = contact.range
    grid = low + (high - low) * np.arange(PLACES + 1) / PLACES
    radius, curve, center, _ = _parallel(contact, scene, grid)
    depth = _depth(radius, curve, center)
    inside = low + np.remainder(s - low, high - low) if contact.closed else s
    _, _, own, ahead = _parallel(contact, scene, inside)
    known = np.flatnonzero(np.isfinite(inside))
    result = np.zeros(len(s))
    result[known] = np.interp(inside[known], grid, depth)
    # where the cut begins the values between the places are not told by interpolation
    cell = np.clip(np.searchsorted(grid, inside[known]) - 1, 0, PLACES - 1)
    begins = known[(depth[cell] > 0) != (depth[cell + 1] > 0)]
    result[begins] = _depth(radius, curve, own[begins])
    # at the contact itself a cut may be too shallow for the places compared
    turned = known[ahead[known] <= 0]
    result[turned] = np.maximum(result[turned], np.finfo(float).tiny)
    return result


def _depth(radius: float, curve: Any, center: Any) -> Any:
    """Return how much nearer than the radius the places of the curve come to centres."""
    near = np.empty(len(center))
    for k in range(0, len(center), CHUNK):
        gap = center[k : k + CHUNK, None] - curve[None]
        near[k : k + CHUNK] = np.sqrt(np.sum(gap * gap, axis=2).min(axis=1))
    depth = radius - near
    depth[depth <= ROUGH * radius] = 0.0
    return depth


def _parallel(contact: Contact, scene: Scene, s: Any) -> tuple[float, Any, Any, Any]:
    """Return the radius, places on the curve and of the centre, and how the centre advances.

    The last is the centre's speed over that of the contact: 1 - curvature * radius.
    """
    model, joint = scene.model, contact.joint
    radius = model.numbers[f"{joint.name}.roller_radius"]
    dx, dy = ca.vertsplit(contact.tangent)
    sign = 1 if joint.side == "right" else -1
    normal = sign * ca.vertcat(dy, -dx) / ca.sqrt(dx**2 + dy**2)
    center = contact.point + radius * normal
    ahead = ca.dot(ca.jacobian(center, contact.s) * contact.turn, contact.tangent)
    share = ahead / ca.dot(contact.tangent, contact.tangent)
    function = ca.Function("parallel", [contact.s, model.p], [contact.point, center, share])
    size = ca.Function("radius", [model.p], [radius])
    values = function(np.asarray(s, float)[None, :], model.p_values[:, None])
    curve, centers, shares = (np.array(value) for value in values)
    return float(size(model.p_values)), curve.T, centers.T, shares.ravel()
