"""Arrows of loads on pages of spatial mechanisms: in the frame that the load is given in."""

from __future__ import annotations

import numpy as np
import pytest

import mechdae as md
from mechdae.draw.fragments import fragments
from mechdae.draw.space.spatial_scene import read_spatial
from tests.shared.node import needs_node
from tests.shared.page_solids import placed, pose_of


@pytest.mark.parametrize(
    ("name", "load", "places", "head"),
    [
        ("five-rod-suspension", "road", ["carrier.W"], (0.0, 0.0, 1.0)),
        ("bevel-differential", "left", ["left_pin/"], None),
    ],
)
def test_arrows_move_with_the_place_of_a_load(name, load, places, head):
    result = md.solve(name)
    drawing = fragments(result, np.linspace(0.0, 1.0, len(result.status)))[1]
    parts = [part for part in drawing["solids"] if part["id"] == f"load-{load}"]
    assert parts
    assert {(*part["at"], part["turn"]) for part in parts} == {(*places, "")}
    if head is not None:  # from behind to the tip: in the direction of the file
        shapes = [shape for part in parts for shape in part["shapes"] if shape[0] == "head"]
        behind, tip = np.reshape(shapes[0][3], (2, 3))
        way = (tip - behind) / np.linalg.norm(tip - behind)
        assert way == pytest.approx(head, abs=1e-3)
    assert any(part["id"] == f"label-load-{load}" for part in drawing["parts"])


ANGLES = np.linspace(0.3, 6.0, 41)


@needs_node
def test_loads_act_as_the_file_says(tmp_path):
    """Directions and sizes of forces, senses of a torque, the centre of mass by their formulas."""
    arm = md.Mechanism(
        dimension=3,
        ground=md.Ground({"A": [0, 0, 0], "W": [0.3, 0.3, 0.3]}),
        bodies=[md.Body("arm", {"A": [0, 0, 0], "E": [0.2, 0, 0.1]}, mass=2.0, center=[0, 0.1, 0])],
        joints=[md.SpatialRevolute("A", "ground.A", "arm.A", axis=[0, 0, 1])],
        loads=[
            md.Force("pull", "arm.E", (6.0, "10*sin(A.angle)", "8*cos(A.angle)")),
            md.Force("push", "arm.E", (0.0, "5*sin(A.angle)", 0.0), frame="arm"),
            md.Torque("turn", "arm", (0.0, 0.0, "4*sin(A.angle)")),
            md.Torque("twirl", "arm", ("3*cos(A.angle)", "3*sin(A.angle)", 1.0)),
            md.Spring("coil", between=("ground.W", "arm.E"), stiffness=100.0),
            md.Spring("twist", coordinate="A.angle", damping=0.1),
        ],
        gravity=(0.0, 0.0, -9.81),
    )
    result = md.solve(arm, md.Sweep(driver=md.Driver("A.angle", at=ANGLES)))
    shares = np.linspace(0.0, 1.0, len(ANGLES))
    drawing = fragments(result, shares)[1]
    scene, rows = read_spatial(result), [3, 12, 25, 37]
    poses = [pose_of(scene, k) | {"share": shares[k], "senses": {}} for k in rows]
    ground = {ref: place for ref, place in poses[0]["places"].items() if "ground" in ref}
    nothing = poses[0] | {"places": ground, "turns": {}}  # it does not assemble
    *found, bare = placed(drawing, [*poses, nothing], np.eye(3).tolist(), 300.0, tmp_path)
    assert bare
    assert not [gid for gid, *_ in bare if gid.startswith(("load-", "driver"))]
    long = []
    for k, shapes in zip(rows, found, strict=True):
        sine, cosine = np.sin(ANGLES[k]), np.cos(ANGLES[k])
        arrows = {
            name: [(kind, np.array(own)) for gid, kind, own in shapes if gid == f"load-{name}"]
            for name in ("pull", "push", "turn", "twirl")
        }
        way = arrow_of(arrows["pull"])
        value = np.array([6.0, 10 * sine, 8 * cosine])
        np.testing.assert_allclose(
            way / np.linalg.norm(way), value / np.linalg.norm(value), atol=3e-3
        )
        long.append(np.linalg.norm(way) / np.linalg.norm(value))
        way = arrow_of(arrows["push"])
        across = np.array([-sine, cosine, 0.0]) * np.sign(sine)
        np.testing.assert_allclose(way / np.linalg.norm(way), across, atol=3e-3)
        lines = [own for kind, own in arrows["turn"] if kind == "line"]
        assert np.sign(sum(np.cross(a[:-1], a[1:])[:, 2].sum() for a in lines)) == np.sign(sine)
        round_ = np.vstack([own for kind, own in arrows["twirl"] if kind == "line"])
        arc = round_ - round_.mean(axis=0)
        turned = np.cross(arc[:-1], arc[1:]).sum(axis=0)
        wanted = np.array([3 * cosine, 3 * sine, 1.0]) / np.sqrt(10)
        np.testing.assert_allclose(turned / np.linalg.norm(turned), wanted, atol=5e-3)
        place = (scene.place("arm.A", k) + scene.place("arm.E", k)) / 2
        radii = np.linalg.norm(round_ - 300.0 * place, axis=1)  # all around the body's middle
        assert np.ptp(radii) < 0.5
        point, body, axis, size = drawing["along"]["arm/center"]
        place = scene.place(point, k) + scene.turns[body][k] @ np.array(axis) * size
        np.testing.assert_allclose(place, [-0.1 * sine, 0.1 * cosine, 0.0], atol=1e-12)
        (gravity,) = [
            np.array(own) for gid, kind, own in shapes if (gid, kind) == ("gravity", "head")
        ]
        assert np.argmax(np.abs(gravity[1] - gravity[0])) == 2
    assert np.ptp(long) < 2e-3 * max(long)
    held = {part["id"]: part for part in drawing["parts"]}
    assert held["load-coil"]["at"] == ["ground.W", "arm.E"]
    assert held["load-coil"]["span"]
    assert {"load-twist", "mass-arm", "mass-arm-tie", "label-load-gravity"} <= held.keys()
    assert any(part["id"] == "support-ground.W" for part in drawing["solids"])


@pytest.mark.parametrize("size", [2, 3])
def test_a_size_that_changes_is_not_written(size):
    """Of a torque too, whose arrow stays as long as it is."""
    place, kind = [0.0] * size, md.Revolute if size == 2 else md.SpatialRevolute
    axis = {} if size == 2 else {"axis": [0, 0, 1]}
    values = ("5 + 4*sin(A.angle)", 1.5)
    arm = md.Mechanism(
        dimension=size,
        ground=md.Ground({"A": place}),
        bodies=[md.Body("arm", {"A": place, "E": [0.2, *place[1:]]})],
        joints=[kind("A", "ground.A", "arm.A", **axis)],
        loads=[
            md.Torque(name, "arm", value if size == 2 else (0.0, 0.0, value))
            for name, value in zip(("changes", "stays"), values, strict=True)
        ],
    )
    result = md.solve(arm, md.Sweep(driver=md.Driver("A.angle", at=ANGLES)))
    drawing = fragments(result, np.linspace(0.0, 1.0, len(ANGLES)))[1]
    texts = [
        shape[5]
        for part in drawing["parts"]
        if part["id"].startswith("label-load")
        for shape in part["shapes"]
    ]
    assert sorted(texts) == ["changes", "stays = 1.5 N m"]


def arrow_of(shapes) -> np.ndarray:
    """Return the way from the start of an arrow to its tip."""
    (head,) = [own for kind, own in shapes if kind == "head"]
    return head[1] - next(own for kind, own in shapes if kind == "line")[0]
