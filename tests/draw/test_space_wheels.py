"""Gears and racks in space: pitch surfaces by closed forms, in pictures and in live pages."""

from __future__ import annotations

from math import atan2, cos, sin

import numpy as np
import pytest

import mechdae as md
from mechdae.describe.joints.joint import Joint
from mechdae.draw.space.anchors import offsets
from mechdae.draw.space.spatial_scene import SpatialScene, read_spatial
from mechdae.draw.space.spatial_wheels import PitchPlane, sides, surfaces
from tests.shared.drawn import gids
from tests.shared.wheels_in_space import (
    LEVEL,
    SCENES,
    SIGMA,
    TURN,
    UPRIGHT,
    Z1,
    Z2,
    wheels,
)


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
