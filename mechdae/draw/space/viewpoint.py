"""From where a spatial mechanism is looked at: in parallel projection, with least clutter."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from functools import cached_property

import numpy as np
from numpy.typing import ArrayLike, NDArray

from mechdae.describe.mechanism import Mechanism
from mechdae.draw.labels.layout import feet, meet
from mechdae.errors import InputError
from mechdae.records import dataclass

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Viewpoint:
    """A direction to look from.

    Parameters
    ----------
    azimuth, elevation
        Of the eye [deg]: the turn about the upward direction, from the axis that follows it, and
        the height above the horizon.
    upward
        (3,) unit vector that is upright in the picture.
    name
        What the view is called, "" without a name.
    """

    azimuth: float
    elevation: float
    upward: tuple[float, float, float] = (0.0, 0.0, 1.0)
    name: str = ""

    @cached_property
    def basis(self) -> Array:
        """Rows: to the right, upwards in the picture, towards the eye; (3, 3)."""
        up = np.array(self.upward)
        k = int(np.argmax(np.abs(up)))
        first = np.eye(3)[(k + 1) % 3]
        first = first - up * (first @ up)
        first = first / np.linalg.norm(first)
        second = np.cross(up, first)
        a, e = np.deg2rad(self.azimuth), np.deg2rad(self.elevation)
        ahead = np.cos(a) * first + np.sin(a) * second
        eye = np.cos(e) * ahead + np.sin(e) * up
        right = -np.sin(a) * first + np.cos(a) * second
        return np.array([right, np.cross(eye, right), eye])

    def seen(self, vectors: ArrayLike) -> Array:
        """Return vectors or places (..., 3) as right, up, towards the eye."""
        return np.asarray(vectors, dtype=float) @ self.basis.T

    def flat(self, places: ArrayLike) -> Array:
        """Return places (..., 3) in the picture, (..., 2), in the same unit."""
        return self.seen(places)[..., :2]


def upward_of(mechanism: Mechanism) -> tuple[float, float, float]:
    """Return what is up: against gravity; without it z, of vector loops y, where azimuths turn."""
    values = mechanism.values()
    pull = [values.get(f"gravity.{axis}", 0.0) for axis in mechanism.axes]
    size = float(np.linalg.norm(pull))
    if size > 0:
        x, y, z = (float(-part / size) + 0.0 for part in pull)
        return x, y, z
    pointing = any(joint.pointer for joint in mechanism.joints.values())
    return (0.0, 1.0, 0.0) if pointing else (0.0, 0.0, 1.0)


def viewpoint(mechanism: Mechanism, view: str | Sequence[float] | Viewpoint) -> Viewpoint:
    """Return the viewpoint that is asked for: ``"azimuth,elevation"`` or two numbers [deg].

    Raises
    ------
    InputError
        Not two numbers, or an elevation beyond the vertical.
    """
    if isinstance(view, Viewpoint):
        return view
    hint = "azimuth and elevation in degrees, like 30,20"
    parts = view.split(",") if isinstance(view, str) else view
    try:
        azimuth, elevation = (float(part) for part in parts)
    except (TypeError, ValueError):
        raise InputError(
            f"'{view}' is no direction to look from", where="view", hint=hint
        ) from None
    if not np.isfinite([azimuth, elevation]).all() or abs(elevation) > 90.0:
        raise InputError("an elevation is from -90 to 90 degrees", where="view", hint=hint)
    return Viewpoint(azimuth, elevation, upward_of(mechanism))


def orthographic(mechanism: Mechanism) -> dict[str, Viewpoint]:
    """Return the three views of a technical drawing: front, top and left side."""
    up = upward_of(mechanism)
    front = 0.0 if abs(up[1]) > 0.9 else -90.0
    named: Mapping[str, tuple[float, float]] = {
        "front view": (front, 0.0),
        "top view": (front, 90.0),
        "left view": (front - 90.0, 0.0),
    }
    return {name: Viewpoint(a, e, up, name) for name, (a, e) in named.items()}


Indices = NDArray[np.intp]
AZIMUTHS = tuple(range(-170, 190, 10))
ELEVATIONS = (15, 20, 25, 30, 35, 40, 50)
USUAL = (-60.0, 25.0)
"""Of views that are as good as each other the one nearest to this one is taken."""
APART = 0.13
"""Points nearer than this share of the picture are hard to tell apart,"""
ASIDE = 0.07
"""and so are a point and a bar that it does not belong to."""
SHORT = 0.8
"""Bars that look shorter than this share of their length,"""
SHARP = 0.4
"""bars with a common end whose angle has a sine below this,"""
NARROW = np.sin(np.deg2rad(14.0))
"""axes nearer to the picture's plane than this: circles around them are lines,"""
END_ON = np.cos(np.deg2rad(20.0))
"""and axes that point at the eye are avoided."""
COSTS = {
    "points": 1.0,
    "aside": 0.8,
    "crossing": 0.7,
    "short": 3.0,
    "sharp": 1.2,
    "axes": 0.35,
    "usual": 0.10,
}


@dataclass(frozen=True)
class Wireframe:
    """What is seen of a pose: places, bars between them, axes.

    Parameters
    ----------
    points
        (k, 3) distinct places.
    bars
        Pairs of indices of places.
    axes
        (j, 3) unit directions of joints.
    """

    points: Array
    bars: tuple[tuple[int, int], ...]
    axes: Array


def candidates(upward: tuple[float, float, float]) -> list[Viewpoint]:
    """Return the viewpoints that are compared."""
    return [Viewpoint(float(a), float(e), upward) for e in ELEVATIONS for a in AZIMUTHS]


def best_view(poses: Sequence[Wireframe], upward: tuple[float, float, float]) -> Viewpoint:
    """Return the viewpoint with the least clutter in all poses together."""
    views = candidates(upward)
    basis = np.array([view.basis for view in views])
    total = sum((clutter(pose, basis) for pose in poses), np.zeros(len(views)))
    total = total / max(len(poses), 1) + _unusual(views)
    return views[int(np.argmin(np.round(total, 9)))]


def _unusual(views: Sequence[Viewpoint]) -> Array:
    """Return how far views are from the usual one, and from views along an axis."""
    azimuth, elevation = np.array([(view.azimuth, view.elevation) for view in views]).T
    away = (1.0 - np.cos(np.deg2rad(azimuth - USUAL[0]))) / 2
    high = np.abs(elevation - USUAL[1]) / 25.0
    along = np.abs(np.sin(2 * np.deg2rad(azimuth)))
    result: Array = COSTS["usual"] * (away + high) + 0.8 * np.maximum(0.0, 0.5 - along)
    return result


def clutter(pose: Wireframe, basis: Array) -> Array:
    """Return how hard to read a pose is from each of v viewpoints, (v,).

    ``basis`` (v, 3, 3) are those of `Viewpoint`.
    """
    flat = np.einsum("vij,kj->vki", basis[:, :2], pose.points)
    span = np.ptp(flat, axis=1).max(axis=1) if len(pose.points) else np.zeros(len(basis))
    flat = flat / np.where(span > 0, span, 1.0)[:, None, None]
    cost = COSTS["points"] * _together(flat, pose.points) + COSTS["axes"] * _edge_on(
        pose.axes, basis
    )
    if pose.bars:
        cost = cost + _of_bars(pose, flat, basis)
    return cost


def _together(flat: Array, points: Array) -> Array:
    """Return what points cost that seem nearer to each other than they need to."""
    i, j = np.triu_indices(len(points), 1)
    size = float(np.ptp(points, axis=0).max()) if len(points) else 0.0
    there = np.linalg.norm(points[i] - points[j], axis=1) / (size or 1.0)
    apart = np.hypot(*np.moveaxis(flat[:, i] - flat[:, j], -1, 0))
    result: Array = (np.maximum(0.0, 1.0 - apart / np.minimum(APART, there)) ** 2).sum(axis=1)
    return result


def _edge_on(axes: Array, basis: Array) -> Array:
    """Return what axes across the line of sight and along it cost."""
    if not len(axes):
        return np.zeros(len(basis))
    towards = np.abs(np.einsum("vj,kj->vk", basis[:, 2], axes))
    narrow = np.maximum(0.0, 1.0 - towards / NARROW)
    end_on = np.maximum(0.0, (towards - END_ON) / (1.0 - END_ON))
    result: Array = (narrow + 2.0 * end_on).sum(axis=1)
    return result


def _of_bars(pose: Wireframe, flat: Array, basis: Array) -> Array:
    ends = np.array(pose.bars)
    a, b = flat[:, ends[:, 0]], flat[:, ends[:, 1]]
    space = pose.points[ends[:, 1]] - pose.points[ends[:, 0]]
    seen = np.einsum("vij,kj->vki", basis[:, :2], space)
    lengths = np.linalg.norm(space, axis=1)
    share = np.hypot(seen[..., 0], seen[..., 1]) / lengths
    short = np.maximum(0.0, 1.0 - share / SHORT) ** 2
    cost = COSTS["short"] * (short * lengths / lengths.max()).sum(axis=1)
    cost = cost + COSTS["aside"] * _aside(flat, a, b, ends)
    total: Array = cost + COSTS["sharp"] * _sharp(a, b, ends)
    total += COSTS["crossing"] * _crossings(a, b, ends)
    return total


def _sharp(a: Array, b: Array, ends: Indices) -> Array:
    """Return what two bars with a common end cost that seem to lie on each other."""
    cost = np.zeros(len(a))
    for i in range(len(ends)):
        for j in range(i):
            for k, m in ((0, 0), (0, 1), (1, 0), (1, 1)):
                if ends[i, k] == ends[j, m]:
                    u = (b[:, i] - a[:, i]) * (1 if k == 0 else -1)
                    v = (b[:, j] - a[:, j]) * (1 if m == 0 else -1)
                    size = np.hypot(*u.T) * np.hypot(*v.T)
                    size = np.where(size > 0, size, 1.0)
                    sine = np.abs(u[:, 0] * v[:, 1] - u[:, 1] * v[:, 0]) / size
                    folded = np.where((u * v).sum(axis=1) > 0, 1.0, 0.4)
                    cost += folded * np.maximum(0.0, 1.0 - sine / SHARP) ** 2
    return cost


def _aside(flat: Array, a: Array, b: Array, ends: Indices) -> Array:
    """Return what points cost that lie on bars to which they do not belong."""
    away = flat[:, :, None] - feet(flat[:, :, None], a[:, None], b[:, None])
    gap = np.hypot(*np.moveaxis(away, -1, 0))
    k = np.arange(flat.shape[1])[:, None]
    strange = (k != ends[:, 0]) & (k != ends[:, 1])
    result: Array = (np.maximum(0.0, 1.0 - gap / ASIDE) * strange).sum(axis=(1, 2))
    return result


def _crossings(a: Array, b: Array, ends: Indices) -> Array:
    """Return how many bars cross that have no end in common."""
    i, j = np.triu_indices(len(ends), 1)
    apart = ~(ends[i][:, :, None] == ends[j][:, None, :]).any(axis=(1, 2))
    i, j = i[apart], j[apart]
    result: Array = meet(a[:, i], b[:, i], a[:, j], b[:, j]).sum(axis=1).astype(float)
    return result
