"""Directions to look from in space, what covers what, and the solids of symbols."""

from __future__ import annotations

import numpy as np
import pytest

from mechdae.draw import style
from mechdae.draw.space import solids
from mechdae.draw.space.solids import STEP, Item, crossings, depth_order, gaps, nearer, seen
from mechdae.draw.space.spatial_pose import edges_of, faces_of
from mechdae.draw.space.spatial_symbols import JointPlace, JointSide, revolute
from mechdae.draw.space.viewpoint import Viewpoint, Wireframe, best_view
from mechdae.results.rotations import matrices

SHALLOW = np.rad2deg(np.arctan(np.sqrt(0.5)))


def line(*points):
    return Item(np.array(points, dtype=float))


def face(*points):
    return Item(np.array(points, dtype=float), closed=True)


def area(corners):
    x, y = np.asarray(corners)[:, :2].T
    return 0.5 * abs(x @ np.roll(y, -1) - y @ np.roll(x, -1))


# -- directions ------------------------------------------------------------------------------------


def test_isometric_view_shortens_all_axes_alike():
    flat = Viewpoint(45.0, SHALLOW).flat(np.eye(3))
    np.testing.assert_allclose(np.hypot(*flat.T), np.sqrt(2 / 3), atol=1e-15)
    # x to the lower left, y to the lower right, z upright: 120 degrees apart
    np.testing.assert_allclose(
        flat / np.sqrt(2 / 3),
        [[-np.sqrt(0.75), -0.5], [np.sqrt(0.75), -0.5], [0.0, 1.0]],
        atol=1e-15,
    )


@pytest.mark.parametrize(
    ("view", "right", "up"),
    [
        (Viewpoint(-90.0, 0.0), [1, 0, 0], [0, 0, 1]),
        (Viewpoint(-90.0, 90.0), [1, 0, 0], [0, 1, 0]),
        (Viewpoint(180.0, 0.0), [0, -1, 0], [0, 0, 1]),
        (Viewpoint(0.0, 0.0, (0.0, 1.0, 0.0)), [1, 0, 0], [0, 1, 0]),
        (Viewpoint(0.0, 0.0, (1.0, 0.0, 0.0)), [0, 0, 1], [1, 0, 0]),
    ],
)
def test_views_along_axes(view, right, up):
    np.testing.assert_allclose(view.basis[:2], [right, up], atol=1e-15)


def test_the_chosen_view_is_not_along_a_line_nor_in_a_plane():
    square = np.array([[0, 0, 0], [1, 0, 0], [1, 0, 1], [0, 0, 1]], dtype=float)
    bars = ((0, 1), (1, 2), (2, 3), (0, 3))
    view = best_view([Wireframe(square, bars, np.zeros((0, 3)))], (0.0, 0.0, 1.0))
    assert abs(view.basis[2] @ [0, 1, 0]) > 0.6
    axes = np.eye(3)
    view = best_view([Wireframe(square[:2], ((0, 1),), axes)], (0.0, 0.0, 1.0))
    towards = np.abs(axes @ view.basis[2])
    assert (towards > np.sin(np.deg2rad(14))).all()
    assert (towards < np.cos(np.deg2rad(20))).all()


# -- what covers what ------------------------------------------------------------------------------


def test_depths_where_lines_cross():
    a, b = line((0, 0, 0), (10, 0, 10)), line((4, -5, 1), (4, 5, 1))
    ((x, y, ahead),) = crossings(a.points, b.points)
    assert (x, y) == pytest.approx((4.0, 0.0))
    assert ahead == pytest.approx(4.0 - 1.0)
    assert nearer(a, b) == 1
    assert nearer(b, a) == -1
    assert nearer(a, line((0, 9, 5), (10, 9, 5))) == 0


def test_lines_behind_a_face_are_dashed_there():
    """Middles alone would not tell which are: the face leans away."""
    leaning = face((0, 0, 0), (20, 0, -100), (20, 20, -100), (0, 20, 0))
    leaning.owner = "plate"
    before, behind = line((2, -5, 0), (2, 25, 0)), line((2, -5, -20), (2, 25, -20))
    assert [there for _, there in seen(before, [leaning])] == [True]
    pieces = seen(behind, [leaning])
    assert [there for _, there in pieces] == [True, False, True]
    hidden = pieces[1][0]
    assert np.ptp(hidden[:, 1]) == pytest.approx(20.0, abs=STEP)
    behind.owner = "plate"
    assert [there for _, there in seen(behind, [leaning])] == [True]


def test_three_rods_that_cover_each_other_in_a_ring_are_all_drawn():
    corners = [np.array([np.cos(t), np.sin(t), 0.0]) * 50 for t in 2 * np.pi * np.arange(3) / 3]
    lift = np.array([0.0, 0.0, 8.0])
    rods = [line(1.4 * corners[k] + lift, 1.4 * corners[(k + 1) % 3] - lift) for k in range(3)]
    longer = np.array([[1.2, -0.2], [-0.2, 1.2]])
    rods = [Item(longer @ rod.points) for rod in rods]
    ahead = [nearer(rods[k], rods[(k + 1) % 3]) for k in range(3)]
    assert len(set(ahead)) == 1
    assert ahead[0] != 0
    assert sorted(depth_order(rods)) == [0, 1, 2]


@pytest.mark.parametrize("last", [-1e-13, 0.0, 1e-13])
def test_a_stand_is_behind_its_barrel(last):
    """Their middles are at one depth: the last digits, which differ by machine, decide nothing."""
    frame = np.array([(1.0, 0.0, 0.0), (0.0, 0.5, -(0.75**0.5)), (0.0, 0.75**0.5, 0.5)])
    at = JointPlace("A", np.zeros(3), np.zeros(3), frame, frame[2], up=frame[2])
    nowhere = np.zeros((0, 3))
    ground = JointSide("ground", style.INK, nowhere, fixed=True)
    items = revolute(at, ground, JointSide("crank", style.INK, nowhere)).items
    stand = next(item for item in items if item.gid == "support-A")
    stand.points[:, 2] += last
    middle = [items[k].gid for k in depth_order(items) if abs(items[k].depth) < 1e-9]
    assert middle == ["support-A", "joint-A-revolute"]


def test_gaps_only_where_a_line_passes_well_in_front():
    far = line((0, 0, 0), (40, 0, 0))
    (gap,) = gaps(line((20, -20, 30), (20, 20, 30)), [far])
    np.testing.assert_allclose(gap.mean(axis=0), [20, 0])
    assert not gaps(line((20, -20, 2), (20, 20, 2)), [far])
    assert not gaps(line((38, -20, 30), (38, 20, 30)), [far])  # at the end of the far one


# -- solids ----------------------------------------------------------------------------------------


@pytest.mark.parametrize("lean", [0.0, 30.0, 75.0, 90.0])
def test_outline_of_a_cylinder(lean):
    """Its area is that of a circle seen obliquely and a rectangle: pi r^2 cos + 4 r h sin."""
    half, radius, angle = 9.0, 5.0, np.deg2rad(lean)
    axis = np.array([np.sin(angle) * 0.6, np.sin(angle) * 0.8, np.cos(angle)])
    item = solids.barrel(np.array([3.0, 4.0, 5.0]), axis, half, radius, "x")
    polygon = 36 * np.sin(2 * np.pi / 36) / 2  # of the circle that is drawn, for pi
    wanted = polygon * radius**2 * abs(axis[2]) + 4 * radius * half * np.hypot(*axis[:2])
    assert area(item.points) == pytest.approx(wanted, rel=5e-3)
    assert item.depth == pytest.approx(5.0)


def test_faces_of_a_block_that_are_seen():
    """A cube seen along its diagonal is a regular hexagon with area sqrt(3) of its faces."""
    frame = Viewpoint(45.0, SHALLOW).seen(np.eye(3))
    item = solids.box(np.zeros(3), frame, np.array([0.5, 0.5, 0.5]), "x")
    shown = [own for own in (facet.flat() for facet in item.facets) if own is not None]
    assert len(shown) == 3
    assert area(item.points) == pytest.approx(np.sqrt(3))
    assert sum(area(own) for own in shown) == pytest.approx(np.sqrt(3))


def test_faces_of_bodies():
    cube = np.array([(x, y, z) for x in (0, 1) for y in (0, 1) for z in (0, 1)], dtype=float)
    faces = faces_of(cube)
    assert sorted(len(own) for own in faces) == [4] * 6
    assert len(edges_of(faces)) == 12
    simplex = np.vstack([np.zeros(3), np.eye(3)])
    assert (len(faces_of(simplex)), len(edges_of(faces_of(simplex)))) == (4, 6)
    flat = np.array([(0, 0, 3), (2, 0, 3), (2, 1, 3), (0, 1, 3), (1, 0.5, 3)], dtype=float)
    ((*corners,),) = faces_of(flat)
    assert set(corners) == {0, 1, 2, 3}
    assert faces_of(np.outer([1.0, 3.0, 2.0], [1, 2, 2])) in ([[0, 1]], [[1, 0]])


def test_rotation_of_a_quaternion():
    half = np.sqrt(0.5)
    (turn,) = matrices(np.array([[half, 0.0, 0.0, half]]))
    np.testing.assert_allclose(turn @ [1, 2, 3], [-2, 1, 3], atol=1e-15)
