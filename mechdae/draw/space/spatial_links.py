"""The links of a spatial diagram: bars between joints, faces of bodies with several points."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import field
from itertools import combinations

import numpy as np

from mechdae.draw import style
from mechdae.draw.diagram.shapes import hull
from mechdae.draw.primitives import Anchor, Array
from mechdae.draw.space import solids
from mechdae.draw.space.depth import Item
from mechdae.draw.space.spatial_symbols import Start
from mechdae.records import dataclass

SAME = 1.0
"""Places nearer than that are one, in units of the sheet."""
FLAT = 0.02
"""Points this close to a line or a plane, as a share of their spread, lie on it."""


@dataclass
class SpatialLink:
    """The places of a body, in units of the sheet, and where bars to others begin.

    Parameters
    ----------
    places
        (3,) each, distinct.
    starts
        Of each the place where a bar to a target begins; None: at the place.
    bases
        Of each what it keeps to in a page; ``turn`` what the body turns with, "" without one.
    """

    name: str
    color: str
    dashed: bool = False
    places: list[Array] = field(default_factory=list)
    starts: list[Start | None] = field(default_factory=list)
    bases: list[str] = field(default_factory=list)
    turn: str = ""

    def add(self, place: Array, base: str, start: Start | None = None) -> None:
        """Add a place; of one that is there the start is completed."""
        for k, known in enumerate(self.places):
            if float(np.linalg.norm(known - place)) < SAME:
                self.starts[k] = self.starts[k] or start
                return
        self.places.append(place)
        self.starts.append(start)
        self.bases.append(base)

    def anchor(self, *places: int) -> Anchor:
        """Return what a line or face between places moves with."""
        bases = tuple(self.bases[k] for k in places)
        return Anchor(bases, self.turn or (">".join(bases) if len(bases) == 2 else ""))

    def begin(self, k: int, target: Array) -> Array:
        """Return where the bar from place `k` to a target begins."""
        start = self.starts[k]
        return self.places[k] if start is None else start(target)


def faces_of(points: Array) -> list[list[int]]:
    """Return the faces of the convex hull of places (k, 3): lists of indices in order.

    Two for places on a line (its ends), one for those in a plane.
    """
    count = len(points)
    if count < 3:
        return [list(range(count))]
    centered = points - points.mean(axis=0)
    _, spread, axes = np.linalg.svd(centered, full_matrices=True)
    if spread[1] <= FLAT * spread[0]:
        along = centered @ axes[0]
        return [[int(np.argmin(along)), int(np.argmax(along))]]
    if count == 3 or spread[2] <= FLAT * spread[0]:
        return [hull(centered @ axes[:2].T)]
    found: dict[frozenset[int], list[int]] = {}
    size = float(spread[0])
    for i, j, k in combinations(range(count), 3):
        normal = np.cross(points[j] - points[i], points[k] - points[i])
        length = float(np.linalg.norm(normal))
        if length <= 1e-9 * size**2:
            continue
        height = (points - points[i]) @ normal / length
        if height.max() <= 1e-6 * size or height.min() >= -1e-6 * size:
            members = np.flatnonzero(np.abs(height) <= 1e-6 * size)
            u = (points[j] - points[i]) / np.linalg.norm(points[j] - points[i])
            v = np.cross(normal / length, u)
            flat = (points[members] - points[i]) @ np.array([u, v]).T
            found.setdefault(frozenset(members.tolist()), members[hull(flat)].tolist())
    return list(found.values())


def edges_of(faces: Sequence[Sequence[int]]) -> list[tuple[int, int]]:
    """Return the pairs of places that are connected, each once."""
    found: dict[tuple[int, int], None] = {}
    for face in faces:
        pairs = zip(face, [*face[1:], face[0]], strict=True) if len(face) > 2 else [tuple(face)]
        for pair in pairs:
            if len(set(pair)) == 2:
                found[min(pair), max(pair)] = None
    return list(found)


def link_items(link: SpatialLink) -> tuple[list[Item], list[tuple[Array, Array]], Array | None]:
    """Return the items of a link, its bars on the sheet, and its corners if it is one face."""
    if len(link.places) < 2:
        return [], [], None
    points = np.array(link.places)
    faces = faces_of(points)
    gid = f"body-{link.name}-bar"
    items, bars = list[Item](), list[tuple[Array, Array]]()
    for face in faces:
        if len(face) > 2:
            items.append(
                Item(
                    points[face], closed=True, gid=f"body-{link.name}-face", color="none",
                    width=0.0, weight=0.0, owner=link.name, anchor=link.anchor(*face),
                )
            )  # fmt: skip
    width, dash = (style.LINE, style.DASHED) if link.dashed else (style.BAR, None)
    edges = edges_of(faces)
    joined = {k for edge in edges for k in edge}
    for k in range(len(points)):  # what lies inside of a face or between the ends of a bar
        if k not in joined and not _on_edge(points, edges, k):
            near = min(joined, key=lambda j: round(float(np.linalg.norm(points[j] - points[k])), 6))
            edges.append((k, near))
    for a, b in edges:
        ends = np.array([link.begin(a, points[b]), link.begin(b, points[a])])
        if float(np.linalg.norm(ends[1] - ends[0])) > 1e-6:
            bar = solids.polyline(ends, gid, link.color, width, dash=dash, anchor=link.anchor(a, b))
            bar.owner = link.name
            items.append(bar)
            bars.append((ends[0, :2], ends[1, :2]))
    corners = points[faces[0], :2] if len(faces) == 1 and len(faces[0]) > 2 else None
    return items, bars, corners


def _on_edge(points: Array, edges: Sequence[tuple[int, int]], k: int) -> bool:
    for a, b in edges:
        way = points[b] - points[a]
        length = float(np.linalg.norm(way))
        off = float(np.linalg.norm(np.cross(way, points[k] - points[a]))) / length
        if length > 0 and off <= SAME:
            return True
    return False
