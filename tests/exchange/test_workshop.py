"""Parts to cut and print: solids are closed, parts never meet, what is in the file is to scale.

Solids are read back from the STL file; where bodies are in other poses is told by two of their
points, and whether parts overlap by corners inside of polygons: nothing of how the parts were
made is used.
"""

from __future__ import annotations

import re
from collections import defaultdict
from dataclasses import replace
from math import pi
from pathlib import Path

import numpy as np
import pytest

import mechdae as md
from mechdae.tasks.motion_of import motion_of
from tests.shared.command import run
from tests.shared.passing_parts import passing

SHORT = ("four-bar-crank-rocker", "slider-crank", "quick-return-pin")
LONG = (
    "gorshkov-seven-link", "toggle-press", "jansen-leg", "klann-leg", "oscillating-cylinder",
    "double-watt", "scotch-yoke", "stephenson-six-bar",
)  # fmt: skip


def solids(text: str) -> dict[str, list[np.ndarray]]:
    """Return the triangles (m, 3, 3) of each solid by its name [mm]; several may have one."""
    found = defaultdict(list)
    for name, body in re.findall(r"solid ([^\n]+)\n(.*?)endsolid", text, re.DOTALL):
        numbers = re.findall(r"vertex (\S+) (\S+) (\S+)", body)
        found[name].append(np.array(numbers, float).reshape(-1, 3, 3))
    return found


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


def inside(points: np.ndarray, sides: np.ndarray) -> np.ndarray:
    """Return which points (n, k, 2) lie in the material between sides (m, 2, 2), even-odd."""
    x, y = points[..., None, 0], points[..., None, 1]
    (ax, ay), (bx, by) = sides[:, 0].T, sides[:, 1].T
    with np.errstate(divide="ignore", invalid="ignore"):
        crossed = ((ay > y) != (by > y)) & (x < (bx - ax) * (y - ay) / (by - ay) + ax)
    return crossed.sum(axis=-1) % 2 == 1


class Assembly:
    """The solids of a file, and the bodies that they move with."""

    def __init__(self, name: str, poses: int, **sizes: float) -> None:
        self.problem = md.load(name)
        made = md.export(self.problem, format="stl", **sizes)
        self.solids, self.made = solids(made.text), made
        whole = motion_of(self.problem, None)
        self.mechanism = whole.mechanism
        parts = len(whole.result.status) - 1
        self.first = whole.first
        self.result = whole.result.finer(max(1, poses // parts))
        self.rows = np.flatnonzero(np.isin(self.result.status, ["ok", "limit", "ambiguous"]))
        self.begin = whole.result

    def body_of(self, name: str) -> tuple[str, str] | str:
        """Return the body of a solid, or both ends of a bar between two points."""
        kind, _, pin = name.partition(" ")
        joints = self.mechanism.joints
        if kind in ("pin", "spacer") and pin:
            joint = joints.get(pin) or joints[pin.rpartition(".")[0]]
            if joint.bar:
                return joint.first, joint.second
            return joint.second_body
        if name in joints:
            return joints[name].first, joints[name].second
        return "ground" if name.startswith("frame") else name

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
                fa, fb = frames[bodies[i]], frames[bodies[j]]
                world = fa[:, 0][:, None] + turned(corners, fa[:, 1], 1)
                there = turned(world - fb[:, 0][:, None], fb[:, 1], -1)
                for rows in np.array_split(np.arange(len(there)), max(1, len(there) // 200)):
                    if inside(there[rows], locals_[j]).any():
                        found.append((one, other))
                        break
        return found


def turned(places: np.ndarray, ways: np.ndarray, sense: int) -> np.ndarray:
    """Return places (k, 2) or (n, k, 2) turned to or from the directions (n, 2)."""
    cos, sin = ways[:, 0][:, None], sense * ways[:, 1][:, None]
    x, y = places[..., 0], places[..., 1]
    return np.stack([cos * x - sin * y, sin * x + cos * y], axis=-1)


@pytest.mark.parametrize("name", SHORT)
def test_no_part_meets_another_one(name: str) -> None:
    found = Assembly(name, 720)
    assert not found.overlaps()
    for several in found.solids.values():
        assert all(open_sides(triangles) == 0 for triangles in several)


@pytest.mark.slow
@pytest.mark.parametrize("name", LONG)
def test_no_part_of_larger_mechanisms_meets_another_one(name: str) -> None:
    found = Assembly(name, 600)
    assert not found.overlaps()
    for several in found.solids.values():
        assert all(open_sides(triangles) == 0 for triangles in several)


def test_parts_in_one_layer_would_be_seen_to_meet() -> None:
    """The check of this file sees a coupler in the layer of the crank."""
    found = Assembly("four-bar-crank-rocker", 72)
    (crank,), (coupler,) = found.solids["crank"], found.solids["coupler"]
    coupler[:, :, 2] += crank[:, :, 2].min() - coupler[:, :, 2].min()
    assert ("crank", "coupler") in found.overlaps()


def test_a_solid_has_the_volume_of_its_plate() -> None:
    """A bar with round ends and two holes: a rectangle, a circle, less two circles."""
    problem = md.four_bar(ground=100, crank=40, coupler=120, rocker=80, units="mm,deg")
    sizes = {"width": 0.012, "thickness": 0.004, "pin": 0.005, "clearance": 1e-4}
    text = md.export(problem, format="stl", **sizes).text
    ((bar,),) = (solids(text)["crank"],)
    a, b, c = bar.transpose(1, 0, 2)
    volume = float(np.einsum("ij,ij->", a, np.cross(b, c))) / 6
    exact = 4 * (40 * 12 + pi * 36 - 2 * pi * 2.6**2)
    assert volume == pytest.approx(exact, rel=2e-3)
    heights = sorted(set(np.round(bar[:, :, 2].ravel(), 6)))
    assert heights == [4.0, 8.0]


def test_a_sheet_is_in_millimetres_and_holds_all_parts() -> None:
    problem = md.four_bar(ground=100, crank=40, coupler=120, rocker=80, units="mm,deg")
    made = md.export(problem, format="svg-cut", width=0.012, pin=0.005, clearance=0.0, kerf=2e-4)
    width, height = map(float, re.search(r'width="(\S+)mm" height="(\S+)mm"', made.text).groups())
    assert f'viewBox="0 0 {width:.3f} {height:.3f}"' in made.text
    radii = [float(r) for r in re.findall(r'd="[^"]*?A(\S+)', made.text)]
    assert sorted(set(radii)) == [2.4, 6.1]  # half of the cut on either side of the line
    assert radii.count(6.1) == 4
    assert radii.count(2.4) == 8
    rows = made.files["parts.csv"].splitlines()
    assert [row.split(",")[0] for row in rows[1:5]] == ["crank", "coupler", "rocker", "frame"]
    assert "pin A,1,,,diameter 5 mm; length 7.5 mm; layers 0 to 1" in rows


def test_holes_have_the_clearance_of_their_joint() -> None:
    problem = md.load("slider-crank").with_values({"r": 0.1})
    joints = dict(problem.mechanism.joints)
    joints["B"] = replace(joints["B"], clearance=3e-4)
    joints["guide"] = replace(joints["guide"], clearance=5e-4)
    loose = replace(problem, mechanism=replace(problem.mechanism, joints=joints))
    made = md.export(loose, format="svg-cut", pin=0.01, clearance=1e-4)
    radii = [float(r) for r in re.findall(r'd="[^"]*?A(\S+)', made.text)]
    assert {r for r in radii if r < 6} == {5.1, 5.3, 5.5}


def test_what_passes_between_two_poses_is_met() -> None:
    """Two circles of radius 0.01500001 touch for 0.0008 rad, those of 0.0149999 pass."""
    for radius in (0.0149999, 0.01500001):
        gap, met = passing(radius)
        assert met is (gap < 0)


@pytest.mark.parametrize(
    ("words", "text"),
    [
        (("geared-five-bar",), "joints.mesh: no parts are made of joints of kind gear"),
        (("rssr",), "parts are made of mechanisms of the plane"),
        (("slider-crank", "--pin", "-3"), "'-3' is not a length"),
        (("slider-crank", "--pin", "0"), "pin: a length above 0 is needed"),
        (("slider-crank", "--pin", "90mm"), "holes O and B of crank are"),
        (("slider-crank", "--pin", "5mm", "--width", "5mm"), "have no wall around holes"),
        (("elliptic-trammel",), "they would be one hole"),
        (("whitworth-quick-return",), "no order of layers"),
        (("five-bar-robot", "--task", "circle"), "one driver"),
    ],
)
def test_what_cannot_be_made_is_said(words, text: str, tmp_path: Path, capsys) -> None:
    form = ("--format", "svg-cut", "--out", str(tmp_path / "sheet.svg"))
    code, out, err = run(capsys, "export", *words, *form)
    assert (code, out) == (2, "")
    assert text in err
    assert not list(tmp_path.iterdir())


def test_the_command_says_what_it_wrote(tmp_path: Path, capsys) -> None:
    words = ("export", "slider-crank", "--width", "30mm", "--pin", "1cm", "--air", "0.5")
    target = tmp_path / "crank.svg"
    code, out, _ = run(capsys, *words, "--format", "svg-cut", "--out", str(target))
    assert code == 0
    assert out.split() == [str(target), str(tmp_path / "crank.parts.csv")]
    assert "width 30 mm" in (tmp_path / "crank.parts.csv").read_text()
    assert run(capsys, *words, "--format", "dxf", "--out", str(tmp_path / "x.dxf"))[0] == 2
