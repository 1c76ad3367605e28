"""Rollers that cut into their curve: poses that solve the equations and cannot be built.

The centre of a roller runs on the curve's parallel at its radius. Where the curve is bent
towards the roller more than the roller is, the parallel has turned back: the roller cuts
into the curve at the contact. Elsewhere it may cut into another part of the curve, which is
then nearer to the centre than the radius.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import Any

import casadi as ca
import numpy as np

from mechdae.equations.cases.curve_contacts import Contact
from mechdae.equations.reduction import Scene
from mechdae.motion.kinematics.path_events import event_at
from mechdae.motion.kinematics.prepared import Run, Setting
from mechdae.records import dataclass
from mechdae.results.status import stretches
from mechdae.types import Floats, Json, Points, Unknowns

PLACES = 1024
"""Places of the curve that are compared."""
CHUNK = 256
ROUGH = 1e-9
"""Share of the radius by which a roller may seem to cut: rounding."""
FINE = 32
"""Places that a cell of the curve is divided into, where a cut begins."""
WITHIN = 17
"""Places at which a gap between poses is looked at, again and again."""
SETTLED = 1e-10
"""Share of the way to which the beginning of a cut is found."""


@dataclass(frozen=True)
class Undercut:
    """A run of poses, first to last, in which a joint's roller cuts ``depth`` deep [m].

    ``ends`` are the places on the path where it begins and ends, once they are refined.
    """

    joint: str
    first: int
    last: int
    depth: float
    ends: tuple[float, float] | None = None


def cuts(scene: Scene, x: Unknowns, u: Floats) -> list[Undercut]:
    """Return where rollers cut into their curves, at poses x (n, nx), u (n, nu)."""
    owners = {name for group in scene.groups for name in group.joints}
    found = []
    for name, contact in scene.model.contacts.items():
        if not len(x) or not contact.rolls or name not in owners:
            continue
        depth = depths(contact, scene, _contacts(contact, scene, x, u))
        with np.errstate(invalid="ignore"):
            bad = depth > 0
        for a, b in stretches(bad):
            found.append(Undercut(name, a, b - 1, float(depth[a:b].max())))
    return found


def cut_events(setting: Setting, run: Run) -> tuple[list[Json], list[Json]]:
    """Return events and intervals of the poses in which a roller cuts into its curve."""
    groups = {name: group for group in setting.scene.groups for name in group.joints}
    events, intervals = [], []
    x, values, s = run.poses.x, run.values, run.places
    between_poses = not setting.plan.named
    if between_poses:
        nodes, X, U = run.path.on_curves()
        between = (nodes > s.min()) & (nodes < s.max())
        s = np.concatenate([s, nodes[between]])
        order = np.argsort(s, kind="stable")
        x, values = np.vstack([x, X[between]])[order], np.vstack([values, U[between]])[order]
        s = s[order]

    def at(places: Floats) -> tuple[Floats, Floats]:
        return run.evaluator.at(run.path, places).x, run.path.drivers(places)

    for cut in cuts(setting.scene, x, values):
        begins, stops = float(s[cut.first]), float(s[cut.last])
        ends = [values[k] for k in (cut.first, cut.last)]
        if between_poses:
            begins, stops = refined(setting.scene, cut, s, at).ends or (begins, stops)
            ends = list(run.path.drivers(np.array([begins, stops])))
        first, last = (u.tolist() if len(u) > 1 else float(u[0]) for u in ends)
        event = event_at(setting, run.path, begins, groups[cut.joint], True)
        events.append(event | {"kind": "undercut", "at": first, "joint": cut.joint})
        interval = {"from": first, "to": last, "joint": cut.joint, "depth": cut.depth}
        if "time" in event:
            interval["time"] = [begins, stops]
        intervals.append(interval)
    return events, intervals


def refined(
    scene: Scene, cut: Undercut, s: Floats, poses: Callable[[Any], tuple[Any, Any]]
) -> Undercut:
    """Return a cut with the places where it begins and ends, which poses only enclose.

    Parameters
    ----------
    s : (n,) array
        Places of the poses on the path, growing, that the cut was found at.
    poses
        Unknowns (k, nx) and drivers (k, nd) at places (k,).
    """
    contact = scene.model.contacts[cut.joint]
    least = SETTLED * float(s[-1] - s[0])
    ends = []
    for inside, outside in ((cut.first, cut.first - 1), (cut.last, cut.last + 1)):
        within = float(s[inside])
        beyond = float(s[outside]) if 0 <= outside < len(s) else within
        while abs(beyond - within) > least:
            places = np.linspace(within, beyond, WITHIN)
            with np.errstate(invalid="ignore"):
                cutting = depths(contact, scene, _contacts(contact, scene, *poses(places))) > 0
            cutting[0], cutting[-1] = True, False
            first = int(np.argmin(cutting))  # the run that the poses belong to ends there
            within, beyond = float(places[first - 1]), float(places[first])
        ends.append(within)
    return replace(cut, ends=(ends[0], ends[1]))


def _contacts(contact: Contact, scene: Scene, x: Unknowns, u: Floats) -> Floats:
    """Return the place of the contact on its curve at each pose."""
    place = ca.Function("s", [scene.x, scene.u, scene.model.p], [scene.expression(contact.s)])
    return np.array(place(x.T, u.T, scene.model.p_values[:, None])).ravel()


def depths(contact: Contact, scene: Scene, s: Floats) -> Floats:
    """Return how deep the roller cuts with the contact at `s` (n,) [m]; 0 where it does not."""
    low, high = contact.range
    grid = low + (high - low) * np.arange(PLACES + 1) / PLACES
    radius, curve, center, _ = _parallel(contact, scene, grid)
    depth = _depth(radius, curve, center)
    inside = low + np.remainder(s - low, high - low) if contact.closed else s
    _, _, here, ahead = _parallel(contact, scene, inside)
    known = np.flatnonzero(np.isfinite(inside))
    result = np.zeros(len(s))
    result[known] = np.interp(inside[known], grid, depth)
    # where the cut begins the values between the places are not told by interpolation
    cell = np.clip(np.searchsorted(grid, inside[known]) - 1, 0, PLACES - 1)
    edge = (depth[:-1] > 0) != (depth[1:] > 0)
    beside = np.concatenate([[edge[-1] and contact.closed], edge, [edge[0] and contact.closed]])
    begins = known[(beside[:-2] | edge | beside[2:])[cell]]
    result[begins] = _finely(contact, scene, here[begins], curve, grid)
    # at the contact itself a cut may be too shallow for the places compared
    turned = known[ahead[known] <= 0]
    result[turned] = np.maximum(result[turned], np.finfo(float).tiny)
    return result


def _depth(radius: float, curve: Points, center: Points) -> Floats:
    """Return how much nearer than the radius the places of the curve come to centres."""
    near = np.empty(len(center))
    for k in range(0, len(center), CHUNK):
        gap = center[k : k + CHUNK, None] - curve[None]
        near[k : k + CHUNK] = np.sqrt(np.sum(gap * gap, axis=2).min(axis=1))
    depth = radius - near
    depth[depth <= ROUGH * radius] = 0.0
    return depth


def _finely(contact: Contact, scene: Scene, center: Points, curve: Points, grid: Floats) -> Floats:
    """Return the same as `_depth`, with the curve looked at closely where it is nearest.

    The nearest of the places is never nearer than the curve: a cut is not seen too early.
    """
    low, high = contact.range
    step = (high - low) / PLACES
    offsets = step * np.linspace(-1, 1, 2 * FINE + 1)
    result = np.empty(len(center))
    for k in range(len(center)):
        gap = center[k] - curve
        middle = grid[np.argmin(np.sum(gap * gap, axis=1))]
        for shrink in (1.0, 1.0 / FINE):
            places = middle + offsets * shrink
            places = (
                low + np.remainder(places - low, high - low) if contact.closed
                else np.clip(places, low, high)
            )  # fmt: skip
            radius, near, _, _ = _parallel(contact, scene, places)
            gap = center[k] - near
            middle = places[np.argmin(np.sum(gap * gap, axis=1))]
        result[k] = _depth(radius, near, center[k : k + 1])[0]
    return result


def _parallel(contact: Contact, scene: Scene, s: Floats) -> tuple[float, Points, Points, Floats]:
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
