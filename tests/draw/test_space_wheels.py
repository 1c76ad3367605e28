"""Gears and racks in space: pitch surfaces by closed forms, in pictures and in live pages."""

from __future__ import annotations

import json
from math import atan2, cos, radians, sin

import numpy as np
import pytest

import mechdae as md
from mechdae.describe.joints.joint import Joint
from mechdae.draw.space.anchors import offsets
from mechdae.draw.space.spatial_scene import SpatialScene, read_spatial
from mechdae.draw.space.spatial_wheels import PitchPlane, sides, surfaces
from mechdae.parts.page.space_scenes import space_of
from tests.shared.drawn import gids
from tests.shared.live import WEB
from tests.shared.node import needs_node, run_script

Z1, Z2 = 18, 45
SKEW = 70.0


def wheels(axes, places, points, **keys) -> md.Mechanism:
    """Return two wheels in the frame, one of them driven, with the points of their mesh."""
    mesh = md.SpatialGear(
        "mesh", "one.M", "two.M", **({"teeth": (Z1, Z2), "mesh": "external"} | keys)
    )
    return md.Mechanism(
        dimension=3,
        ground=md.Ground({"A": places[0], "B": places[1]}),
        bodies=[
            md.Body("one", {"A": [0, 0, 0], "M": points[0]}),
            md.Body("two", {"B": [0, 0, 0], "M": points[1]}),
        ],
        joints=[
            md.SpatialRevolute("V", "ground.A", "one.A", axis=axes[0]),
            md.SpatialRevolute("W", "two.B", "ground.B", axis=axes[1]),
            mesh,
        ],
        sketch={"V": 0},
    )


def rack() -> md.Mechanism:
    return md.Mechanism(
        dimension=3,
        ground=md.Ground({"A": [0, 0, 0], "R": [0.03, 0.01, 0.0]}),
        bodies=[
            md.Body("wheel", {"A": [0, 0, 0], "M": [0, 0, 0.01]}),
            md.Body("rack", {"R": [0, 0, 0]}),
        ],
        joints=[
            md.SpatialRevolute("V", "ground.A", "wheel.A", axis=[0, 0, 1]),
            md.SpatialPrismatic("S", "ground.R", "rack.R", axis=[0, 2, 0]),
            md.SpatialRack("mesh", "wheel.M", "rack.R", radius=0.03),
        ],
        sketch={"V": 0},
    )


TURN = md.Sweep(driver=md.Driver("V.angle", at=[0.0, 0.7, 1.4]))
SIGMA = radians(SKEW)
TILTED = [sin(SIGMA), 0.0, cos(SIGMA)]
UPRIGHT, LEVEL = [[0, 0, 1], [0, 0, 1]], [[0, 0, 0], [0, 0, 0]]
LEANING = [[0, 0, 1], TILTED]
SCENES = {
    "external": wheels(
        [[0, 0, 3], [0, 0, 1]], ([0, 0, 0], [0.063, 0, 0.1]), ([0, 0, 0.2], [0, 0, 0.1])
    ),
    "internal": wheels(UPRIGHT, ([0, 0, 0], [0.03, 0, 0]), LEVEL, mesh="internal"),
    "bevel": wheels(
        LEANING, ([0, 0, 0.3], [0, 0, 0]), ([0, 0, -0.2], [0.1 * x for x in TILTED]), radius=0.02
    ),
    "skew": wheels(LEANING, ([0, 0, -0.4], [0.2 * TILTED[0], 0.05, 0.2 * TILTED[2]]), LEVEL),
    "rack": rack(),
}


def seen(name: str) -> tuple[SpatialScene, Joint, md.Result]:
    result = md.solve(SCENES[name], TURN)
    return read_spatial(result), result.mechanism.joints["mesh"], result


def test_parallel_wheels_touch_between_their_axes():
    scene, mesh, _ = seen("external")
    first, second = surfaces(scene, mesh, 1, {})
    assert first.radii == pytest.approx([0.018] * 2, rel=1e-12)
    assert second.radii == pytest.approx([0.045] * 2, rel=1e-12)
    np.testing.assert_allclose(first.middle, [0, 0, 0.2], atol=1e-15)
    np.testing.assert_allclose(second.middle, [0.063, 0, 0.2], atol=1e-15)


def test_an_internal_wheel_touches_beyond():
    scene, mesh, _ = seen("internal")
    first, second = surfaces(scene, mesh, 1, {})
    assert second.radii[0] - first.radii[0] == pytest.approx(0.03, rel=1e-12)
    assert second.radii[0] / first.radii[0] == pytest.approx(Z2 / Z1, rel=1e-12)


def test_bevel_wheels_are_the_pitch_cones():
    """The half angle is atan2(sin S, z2/z1 + cos S), S the angle of the axes towards the teeth."""
    scene, mesh, _ = seen("bevel")
    first, second = surfaces(scene, mesh, 1, {})
    assert np.mean(first.radii) == pytest.approx(0.02, rel=1e-12)
    assert np.mean(second.radii) == pytest.approx(0.02 * Z2 / Z1, rel=1e-12)
    sigma = SIGMA
    for wheel, ratio in ((first, Z2 / Z1), (second, Z1 / Z2)):
        delta = atan2(sin(sigma), ratio + cos(sigma))
        for end, radius in zip(wheel.ends, wheel.radii, strict=True):
            assert np.linalg.norm(end) * np.tan(delta) == pytest.approx(radius, rel=1e-12)


def test_wheels_on_crossing_axes_touch_on_the_relative_screw_axis():
    """Throats of the hyperboloids: r1 / r2 = (1 + k cos S) / (k (k + cos S)), r1 + r2 = h."""
    scene, mesh, _ = seen("skew")
    first, second = surfaces(scene, mesh, 1, {})
    k, c = Z2 / Z1, cos(SIGMA)
    r1, r2 = first.radii[0], second.radii[0]
    assert r1 + r2 == pytest.approx(0.05, rel=1e-12)
    assert r1 / r2 == pytest.approx((1 + k * c) / (k * (k + c)), rel=1e-12)
    np.testing.assert_allclose(first.middle, [0, 0, 0], atol=1e-15)
    np.testing.assert_allclose(second.middle, [0, 0.05, 0], atol=1e-15)


def test_a_rack_touches_its_wheel_wherever_it_comes():
    scene, mesh, _ = seen("rack")
    for pose in range(3):
        wheel, plane = surfaces(scene, mesh, pose, {})
        assert isinstance(plane, PitchPlane)
        assert wheel.radii == pytest.approx([0.03, 0.03], rel=1e-12)
        assert plane.corners[:, 0] == pytest.approx([0.03] * 4, rel=1e-12)
        assert plane.corners[:, 2].mean() == pytest.approx(0.01, rel=1e-12)
        # it is one piece, which has moved by radius times angle; the ends are 0.9 radii beyond
        low, high = plane.corners[0, 1], plane.corners[1, 1]
        travel = 0.03 * 0.7 * np.array([pose - 2, pose])
        assert [low, high] == pytest.approx(travel + 0.9 * 0.03 * np.array([-1, 1]), rel=1e-9)


def test_wheels_about_one_line_are_named_below():
    mechanism = wheels(UPRIGHT, ([0, 0, 0], [0, 0, 0.1]), LEVEL)
    axes = md.plot(md.solve(mechanism, TURN))
    assert any("not drawn: mesh" in text.get_text() for text in axes.texts)


@pytest.mark.parametrize("name", SCENES)
def test_they_are_drawn(name):
    kind = "rack" if name == "rack" else "gear"
    drawn = gids(md.plot(md.solve(SCENES[name], TURN)))
    assert f"joint-mesh-{kind}" in drawn


def numbers(part):
    """Return what tells one surface from another."""
    if isinstance(part, PitchPlane):
        return part.corners.tolist()
    return [part.ends.tolist(), list(part.radii)]


@needs_node
def test_the_page_has_the_same_surfaces(tmp_path):
    cases, wanted = [], []
    for name in SCENES:
        scene, mesh, result = seen(name)
        scene_data = md.page(md.Problem(SCENES[name], {"turn": TURN}), "turn").data["scene"]
        data = next(own for own in scene_data["joints"] if own["name"] == "mesh")["mesh"]
        reach = space_of(result, "en")[0]["reaches"].get("mesh")
        for pose in range(3):
            places = {ref: scene.place(ref, pose).tolist() for ref in scene.tracks}
            cases.append([data, places, reach])
            wanted.append([numbers(part) for part in surfaces(scene, mesh, pose, {})])
    found = run_script(
        f'import {{ pitchSurfaces }} from "{(WEB / "wheels.js").as_posix()}";\n'
        "const still = (body, vector) => vector;\n"
        "const numbers = (own) => own.corners || [own.ends, own.radii];\n"
        f"const told = {json.dumps(cases)}.map(([mesh, places, reach]) =>\n"
        "  pitchSurfaces(mesh, places, still, 0.1, reach).map(numbers));\n"
        "console.log(JSON.stringify(told));\n",
        tmp_path,
    )
    for own, told in zip(wanted, found, strict=True):
        assert len(own) == len(told) == 2
        for a, b in zip(own, told, strict=True):
            for x, y in zip(a, b, strict=True):
                np.testing.assert_allclose(y, x, atol=1e-13)


def test_a_bearing_at_the_apex_is_drawn_where_its_wheel_is():
    places, points = ([0, 0, 0], [0, 0, 0]), ([0, 0, 0.05], [0.05, 0, 0])
    scene = read_spatial(
        md.solve(wheels([[0, 0, 1], [1, 0, 0]], places, points, radius=0.02), TURN)
    )
    found = sides(scene, 1)
    assert all(way > 0 for way in found.values())
    assert all(way > 0 for way in offsets(scene, 1, found).values())
    turned = {name: -way for name, way in found.items()}
    assert all(way < 0 for way in offsets(scene, 1, turned).values())
