"""Solids of STL files, and the bodies that they move with: closed, and apart from each other.

Where bodies are in other poses is told by two of their points, and whether parts overlap by
corners inside of polygons: nothing of how the parts were made is used.
"""

from __future__ import annotations

import re
from collections import defaultdict
from itertools import pairwise
from pathlib import Path

import numpy as np

import mechdae as md
from mechdae.tasks.motion_of import motion_of


def solids(text: str) -> dict[str, list[np.ndarray]]:
    """Return the triangles (m, 3, 3) of each solid by its name [mm]; several may have one."""
    found = defaultdict(list)
    for name, body in re.findall(r"solid ([^\n]+)\n(.*?)endsolid", text, re.DOTALL):
        numbers = re.findall(r"vertex (\S+) (\S+) (\S+)", body)
        found[name].append(np.array(numbers, float).reshape(-1, 3, 3))
    return found


def step_volumes(text: str, path: Path) -> list[float]:
    """Return the volumes of solids of a STEP file [mm^3], all of them valid for its kernel."""
    from OCP.BRepCheck import BRepCheck_Analyzer
    from OCP.BRepGProp import BRepGProp
    from OCP.GProp import GProp_GProps
    from OCP.STEPControl import STEPControl_Reader
    from OCP.TopAbs import TopAbs_SOLID
    from OCP.TopExp import TopExp_Explorer

    path.write_text(text, encoding="utf-8")
    reader = STEPControl_Reader()
    reader.ReadFile(str(path))
    reader.TransferRoots()
    found, volumes = TopExp_Explorer(reader.OneShape(), TopAbs_SOLID), []
    while found.More():
        assert BRepCheck_Analyzer(found.Current()).IsValid()
        properties = GProp_GProps()
        BRepGProp.VolumeProperties_s(found.Current(), properties)
        volumes.append(properties.Mass())
        found.Next()
    return volumes


def open_sides(triangles: np.ndarray) -> int:
    """Return how many sides have no partner that leads the other way."""
    corners = np.round(triangles * 1e5).astype(np.int64)
    ways = defaultdict(int)
    for a, b, c in corners.tolist():
        for one, other in ((a, b), (b, c), (c, a)):
            ways[tuple(one), tuple(other)] += 1
    return sum(count != ways.get((b, a), 0) or count > 1 for (a, b), count in ways.items())


def sides_below(triangles: np.ndarray) -> np.ndarray:
    """Return the sides (k, 2, 2) of a solid's lower face, holes too."""
    low = triangles[:, :, 2].min()
    flat = triangles[(np.abs(triangles[:, :, 2] - low) < 1e-9).all(axis=1)][:, :, :2]
    ways = {}
    for triangle in np.round(flat, 5).tolist():
        for k in range(3):
            one, other = tuple(triangle[k]), tuple(triangle[(k + 1) % 3])
            if ways.pop((other, one), None) is None:
                ways[one, other] = True
    return np.array(list(ways))


BAND = 8
"""Sides for each band across a solid in which points are looked at together."""


def inside(points: np.ndarray, sides: np.ndarray) -> np.ndarray:
    """Return which points (..., 2) lie in the material between sides (m, 2, 2), even-odd."""
    x, y = points[..., 0].ravel(), points[..., 1].ravel()
    (ax, ay), (bx, by) = sides[:, 0].T, sides[:, 1].T
    edges = np.linspace(min(ay.min(), by.min()), max(ay.max(), by.max()), len(sides) // BAND + 2)
    found = np.zeros(len(x), bool)
    band = np.searchsorted(edges, y, side="right") - 1
    order = np.argsort(band, kind="stable")
    starts = np.searchsorted(band[order], np.arange(len(edges)))
    for k, (low, high) in enumerate(pairwise(edges)):
        rows = order[starts[k] : starts[k + 1], None]
        near = (np.maximum(ay, by) >= low) & (np.minimum(ay, by) <= high)
        a, b, c, d = ax[near], ay[near], bx[near], by[near]
        with np.errstate(divide="ignore", invalid="ignore"):
            crossed = ((b > y[rows]) != (d > y[rows])) & (
                x[rows] < (c - a) * (y[rows] - b) / (d - b) + a
            )
        found[rows[:, 0]] = crossed.sum(axis=1) % 2 == 1
    return found.reshape(points.shape[:-1])


class Assembly:
    """The solids of a file, and the bodies that they move with."""

    def __init__(self, name: str | md.Problem, poses: int, **sizes: float) -> None:
        self.problem = md.load(name) if isinstance(name, str) else name
        made = md.export(self.problem, format="stl", **sizes)
        self.solids, self.made = solids(made.text), made
        whole = motion_of(self.problem, None, driven=True)
        self.mechanism = whole.mechanism
        parts = len(whole.result.status) - 1
        self.first = whole.first
        self.result = whole.result.finer(-(-poses // parts))
        self.rows = np.flatnonzero(np.isin(self.result.status, ["ok", "limit", "ambiguous"]))
        self.begin = whole.result

    def body_of(self, name: str) -> tuple[str, str] | str:
        """Return the body of a solid, or both ends of a bar between two points."""
        kind, _, pin = name.partition(" ")
        joints = self.mechanism.joints
        if kind in ("pin", "spacer") and pin:
            joint = joints.get(pin) or joints.get(pin.rpartition(".")[0])
            if joint is None:  # a dowel: CRANK wheel.1
                return self.body_of(pin)
            if joint.bar:
                return joint.first, joint.second
            return joint.second_body
        if name in joints:
            return joints[name].first, joints[name].second
        body = name if name in self.mechanism.bodies else kind
        return "ground" if name.startswith("frame") else body

    def frames(self, body: tuple[str, str] | str, result, rows) -> np.ndarray:
        """Return origin and direction (n, 2, 2) that move with a body [mm]."""
        if body == "ground":
            return np.tile(np.array([[0.0, 0.0], [1.0, 0.0]]), (len(rows), 1, 1))
        if isinstance(body, tuple):
            one, other = (self.place(point, result, rows) for point in body)
            way = (other - one) / np.hypot(*(other - one).T)[:, None]
        else:
            one = self.place(
                next(f"{body}.{p}" for p in self.mechanism.body(body).points), result, rows
            )
            angle = np.asarray(result.bodies[body].angle)[rows]
            way = np.stack([np.cos(angle), np.sin(angle)], axis=1)
        return np.stack([one * 1e3, way], axis=1)

    def place(self, point: str, result, rows) -> np.ndarray:
        if not point.startswith("ground."):
            return np.asarray(result.points[point].position)[rows]
        values = self.mechanism.values()
        return np.tile([values[f"{point}.x"], values[f"{point}.y"]], (len(rows), 1))

    def local(self, name: str, places: np.ndarray) -> np.ndarray:
        """Return places (k, 2) of the file in the frame of a solid's body."""
        (origin, way) = self.frames(self.body_of(name), self.begin, [self.first])[0]
        return (places - origin) @ np.array([[way[0], -way[1]], [way[1], way[0]]])

    def overlaps(self) -> list[tuple[str, str]]:
        """Return pairs of solids of which a corner is inside the other one in some pose."""
        each = [(name, s) for name, several in self.solids.items() for s in several]
        bodies = [self.body_of(name) for name, _ in each]
        frames = {b: self.frames(b, self.result, self.rows) for b in set(bodies)}
        flat = [sides_below(s) for _, s in each]
        locals_ = [
            self.local(name, sides.reshape(-1, 2)).reshape(-1, 2, 2)
            for (name, _), sides in zip(each, flat, strict=True)
        ]
        found = []
        for i, (one, a) in enumerate(each):
            for j, (other, b) in enumerate(each):
                shared = min(a[:, :, 2].max(), b[:, :, 2].max()) - max(
                    a[:, :, 2].min(), b[:, :, 2].min()
                )
                if bodies[i] == bodies[j] or shared < 1e-6:
                    continue
                corners = locals_[i][::3, 0]
                fa, fb = near(frames[bodies[i]], locals_[i], frames[bodies[j]], locals_[j])
                world = fa[:, 0][:, None] + turned(corners, fa[:, 1], 1)
                there = turned(world - fb[:, 0][:, None], fb[:, 1], -1)
                for rows in np.array_split(np.arange(len(there)), max(1, len(there) // 200)):
                    if inside(there[rows], locals_[j]).any():
                        found.append((one, other))
                        break
        return found


def near(
    fa: np.ndarray, a: np.ndarray, fb: np.ndarray, b: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Return the frames of the poses in which circles around two solids meet."""
    middles = [sides.reshape(-1, 2).mean(axis=0) for sides in (a, b)]
    radii = [
        np.hypot(*(sides.reshape(-1, 2) - middle).T).max()
        for sides, middle in zip((a, b), middles, strict=True)
    ]
    places = [
        f[:, 0] + turned(m[None], f[:, 1], 1)[:, 0] for f, m in zip((fa, fb), middles, strict=True)
    ]
    met = np.hypot(*(places[0] - places[1]).T) <= sum(radii)
    return fa[met], fb[met]


def turned(places: np.ndarray, ways: np.ndarray, sense: int) -> np.ndarray:
    """Return places (k, 2) or (n, k, 2) turned to or from the directions (n, 2)."""
    cos, sin = ways[:, 0][:, None], sense * ways[:, 1][:, None]
    x, y = places[..., 0], places[..., 1]
    return np.stack([cos * x - sin * y, sin * x + cos * y], axis=-1)
