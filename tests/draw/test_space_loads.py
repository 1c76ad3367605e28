"""Loads in pictures of spatial mechanisms: directions, lengths, senses, what is end-on."""

from __future__ import annotations

import numpy as np
import pytest

import mechdae as md
from mechdae.draw.space.viewpoint import Viewpoint
from tests.shared.drawn import gids, with_gid

VIEW = (-50.0, 30.0)
SEEN = Viewpoint(*VIEW)


def arm(loads, **more) -> md.Mechanism:
    """Return a heavy arm on a hinge, with a point at its end, and a slide beside it."""
    return md.Mechanism(
        dimension=3,
        ground=md.Ground({"A": [0, 0, 0], "S": [0.2, 0.1, 0], "W": [0.3, 0.3, 0.3]}),
        bodies=[
            md.Body("arm", {"A": [0, 0, 0], "E": [0.2, 0, 0.1]}, mass=2.0, center=[0.1, 0, 0]),
            md.Body("block", {"S": [0, 0, 0], "T": [0, 0, 0.1]}),
        ],
        joints=[
            md.SpatialRevolute("A", "ground.A", "arm.A", axis=[0, 0, 2]),
            md.SpatialPrismatic("S", "ground.S", "block.S", axis=[0, 1, 0]),
        ],
        loads=loads,
        **more,
    )


def drawn(loads, view=VIEW, pose=0, **more):
    drivers = [md.Driver("A.angle", at=[0.3, 0.9], speed=2.0), md.Driver("S.slide", at=[0.1, 0.2])]
    result = md.solve(arm(loads, **more), md.Sweep(drivers=drivers))
    return md.plot(result, pose=pose, view=view)


def lines_of(axes, gid) -> list[np.ndarray]:
    """Return the pieces of an arrow in the picture [m], without its head; near ones are last."""
    lines = [own for own in with_gid(axes, gid) if hasattr(own, "get_xdata")]
    return [np.column_stack([own.get_xdata(), own.get_ydata()]) for own in lines]


def ends_of(axes, gid) -> np.ndarray:
    """Return where a straight arrow begins and where its head ends [m]."""
    head = next(own for own in with_gid(axes, gid) if not hasattr(own, "get_xdata"))
    tip, points = head.get_xy()[0], np.vstack(lines_of(axes, gid))
    return np.array([points[np.argmax(np.hypot(*(points - tip).T))], tip])


def heading(axes, gid) -> np.ndarray:
    """Return where the head of a straight arrow points."""
    way = np.diff(ends_of(axes, gid), axis=0)[0]
    return way / np.hypot(*way)


@pytest.mark.parametrize("value", [(3.0, -1.0, 2.0), (0.0, 0.0, -5.0)])
def test_a_force_points_where_it_is_seen_to(value):
    axes = drawn([md.Force("pull", "arm.E", value)])
    wanted = SEEN.flat(np.array(value))
    np.testing.assert_allclose(heading(axes, "load-pull"), wanted / np.hypot(*wanted), atol=1e-9)


def test_a_force_of_a_body_turns_with_it():
    axes = drawn([md.Force("pull", "arm.E", (1.0, 0.0, 0.0), frame="arm")], pose=1)
    wanted = SEEN.flat(np.array([np.cos(0.9), np.sin(0.9), 0.0]))
    np.testing.assert_allclose(heading(axes, "load-pull"), wanted / np.hypot(*wanted), atol=1e-9)


def test_lengths_are_those_in_space():
    """Two forces of 10 N and 8 N with one direction each, foreshortened by its own angle."""
    forces = [
        md.Force("first", "arm.E", (0.0, 0.0, 10.0)),
        md.Force("second", "block.T", (0.0, 8.0, 0.0)),
    ]
    axes = drawn(forces)
    long = []
    for name, value in (("first", (0, 0, 1)), ("second", (0, 1, 0))):
        way = np.diff(ends_of(axes, f"load-{name}"), axis=0)[0]
        long.append(np.hypot(*way) / np.hypot(*SEEN.flat(np.array(value, dtype=float))))
    assert long[1] / long[0] == pytest.approx(0.8, rel=1e-6)


@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_a_torque_turns_as_it_is_seen_to(sign):
    axes = drawn([md.Torque("drive", "arm", (0.0, 0.0, 4.0 * sign))])
    pieces = lines_of(axes, "load-drive")
    middle = np.vstack(pieces).mean(axis=0)
    turned = 0.0
    for x, y in ((own - middle).T for own in pieces):
        turned += float((x[:-1] * np.diff(y) - y[:-1] * np.diff(x)).sum())
    assert np.sign(turned) == sign  # the axis is seen from above


def test_what_is_seen_end_on_is_a_ring():
    axes = drawn([md.Force("pull", "arm.E", (0.0, 0.0, -5.0))], view=(0.0, 90.0))
    kinds = {type(own).__name__ for own in with_gid(axes, "load-pull")}
    assert "_Circle" in kinds
    assert not any(hasattr(own, "get_xdata") for own in with_gid(axes, "load-pull"))


def test_all_kinds_are_drawn():
    loads = [
        md.Force("pull", "arm.E", ("2*t", 0.0, 1.0)),
        md.Resistance("drag", "A.angle", 1.0, 1.0),
        md.Resistance("rub", "S.slide", 2.0, 2.0),
        md.Spring("coil", between=("ground.W", "arm.E"), stiffness=100.0, damping=3.0),
        md.Spring("twist", coordinate="A.angle", stiffness=1.0, damping=0.1),
        md.Spring("push", coordinate="S.slide", stiffness=10.0),
    ]
    axes = drawn(loads, gravity=(0.0, 0.0, -9.81))
    names = ("pull", "drag", "rub", "coil", "twist", "push")
    assert {f"load-{name}" for name in names} | {"gravity", "mass-arm"} <= set(gids(axes))
    assert {f"label-load-{name}" for name in names} <= set(gids(axes))


def test_loads_can_be_left_out():
    result = md.solve("screw-press", "stroke")
    assert "load-work" in gids(md.plot(result))
    assert "load-work" not in gids(md.plot(result, loads=False))


def test_frames_have_one_scale_of_forces():
    """A force that grows with a slide from 0.1 to 0.2: its first arrow is half as long."""
    drivers = [md.Driver("A.angle", at=[0.3, 0.3]), md.Driver("S.slide", at=[0.1, 0.2])]
    mechanism = arm([md.Force("pull", "arm.E", (0.0, 0.0, "100*S.slide"))])
    result = md.solve(mechanism, md.Sweep(drivers=drivers))
    frames = md.plot(result, "animation", view=VIEW).drawn([0, 1], True)
    long = [np.hypot(*np.diff(ends_of(sheet.ax, "load-pull"), axis=0)[0]) for sheet in frames]
    assert long[0] / long[1] == pytest.approx(0.5, rel=1e-6)


def test_points_and_their_forces_are_seen_on_faces_of_their_body():
    """A point in the middle of a plate is in the plate's plane: it is drawn after the face."""
    points = {"A": [0, 0, 0], "B": [1, 0, 0], "D": [0, 1, 0], "C": [0.4, 0.4, 0]}
    plate = md.Mechanism(
        dimension=3,
        ground=md.Ground({"A": [0, 0, 0]}),
        bodies=[md.Body("plate", points)],
        joints=[md.SpatialRevolute("A", "ground.A", "plate.A", axis=[1, 0, 0])],
        loads=[md.Force("push", "plate.C", (0.0, 0.0, -3.0))],
    )
    for view in ((20.0, 40.0), (200.0, -30.0)):
        axes = md.plot(md.solve(plate, md.Sweep(driver=md.Driver("A.angle", at=[0.3]))), view=view)
        face = max(own.zorder for own in with_gid(axes, "body-plate-face"))
        for gid in ("point-plate.C", "load-push"):
            assert min(own.zorder for own in with_gid(axes, gid)) > face


@pytest.mark.parametrize(
    ("rows", "frame"), [([[0, 2], [1, 3]], "world"), ([[0, -2], [1, -3]], "arm")]
)
def test_the_torque_of_a_table_turns_about_its_axis(rows, frame) -> None:
    """The size at 0.3 rad, in the sense of the same torque given by components."""
    axis = np.array([0.0, 3.0, 4.0])
    value = np.interp(0.3, *np.array(rows).T) * axis / 5
    table = md.TableLoad("M", "A.angle", rows=rows, body="arm", axis=axis, frame=frame)
    torque = md.Torque("M", "arm", value, frame=frame)
    one, other = (drawn([load]) for load in (table, torque))
    assert any("2.3" in text.get_text() for text in one.texts)
    ours, theirs = (np.vstack(lines_of(axes, "load-M")).round(9) for axes in (one, other))
    assert set(map(tuple, ours)) == set(map(tuple, theirs))  # equally near ones in any order
    missing = md.TableLoad("M", "t", rows=[[0, 1], [1, 2]], body="arm", axis=axis)
    assert len(lines_of(drawn([missing]), "load-M")) > len(lines_of(one, "load-M"))
