"""Diagrams: the symbols of joints, where they are, radii of wheels."""

from __future__ import annotations

import numpy as np
import pytest

import mechdae as md
from mechdae.draw.diagram import wheels
from tests.shared.drawn import (
    five_bar,
    four_bar,
    gids,
    planetary,
    seven_link,
    sine_mechanism,
    whitworth,
    with_gid,
    zoo,
)


@pytest.mark.parametrize(
    ("sample", "expected"),
    [
        (seven_link, {"joint-O-pin", "joint-BC-BE-pin", "support-O", "support-F"}),
        (seven_link, {"joint-slot-prismatic", "joint-guide-prismatic", "joint-guide-guide"}),
        (seven_link, {"driver-crank.angle", "number-rod", "label-ground.O", "scale-bar", "title"}),
        (five_bar, {"joint-mesh-gear", "body-coupler-wheel", "joint-A-wheel_pin-pin"}),
        (whitworth, {"joint-slot-pin-in-slot", "joint-slot-pin", "point-arm.B", "trace-arm.B"}),
        (four_bar, {"body-coupler-polygon", "point-coupler.P", "trace-coupler.P"}),
        (sine_mechanism, {"joint-cross-guide", "joint-cross-corner", "joint-way-guide"}),
        (zoo, {"joint-E-weld", "joint-bar-distance", "joint-teeth-rack", "joint-belt-strand"}),
        (zoo, {"joint-profile-curve", "joint-profile-roller", "joint-groove-pin-in-slot"}),
        (zoo, {"bridge-lever.M", "bridge-lever.O", "driver-way.slide"}),
    ],
)
def test_symbols_of_every_joint_kind(sample, expected):
    assert expected <= set(gids(md.plot(sample(), "diagram")))


def test_pins_are_where_the_joints_are():
    ax = md.plot(seven_link())
    (pin,) = with_gid(ax, "joint-A-pin")
    angle = np.deg2rad(38.117)
    assert pin.center == pytest.approx(0.1716 * np.array([np.cos(angle), np.sin(angle)]))
    assert ax.get_aspect() == 1.0
    assert len(with_gid(ax, "joint-BC-BE-pin")) == 1


def test_bar_is_hidden_by_the_block():
    ax = md.plot(seven_link())
    (bar,), (block,) = (with_gid(ax, gid) for gid in ("body-rod-bar", "joint-slot-prismatic"))
    assert bar.zorder < block.zorder
    assert block.get_facecolor() == (1.0, 1.0, 1.0, 1.0)
    pin, (start, end) = np.array(with_gid(ax, "joint-A-pin")[0].center), bar.get_xydata()
    share = (pin - start) @ (end - start) / ((end - start) @ (end - start))
    assert 0 < share < 1
    assert start + share * (end - start) == pytest.approx(pin, abs=1e-9)
    assert sorted(block.get_xy()[:4] @ (end - start) > pin @ (end - start)) == [0, 0, 1, 1]


def unit_length(ax):
    """Metres per unit of the sheet: a new figure has one unit per point."""
    return np.ptp(ax.get_xlim()) / (ax.get_window_extent().width * 72 / ax.get_figure().dpi)


def test_block_lies_along_its_guide():
    result = seven_link()
    (block,) = with_gid(md.plot(result), "joint-slot-prismatic")
    corners = block.get_xy()
    side = corners[1] - corners[0]
    assert np.arctan2(side[1], side[0]) == pytest.approx(result.bodies["rod"].angle[0])


@pytest.mark.parametrize("ratio", [-0.25, -1.0, -3.0, 0.25, 4.0])
def test_pitch_radii_give_equal_speeds_at_the_pitch_point(ratio):
    first, second = np.array([0.3, -0.1]), np.array([0.5, 0.4])
    distance = np.hypot(*(second - first))
    radii = wheels.pitch_radii(distance, ratio)
    toward = (second - first) / distance
    inside = ratio > 0 and radii[1] > radii[0]  # the first wheel lies inside the second
    touch = first - radii[0] * toward if inside else first + radii[0] * toward
    assert np.hypot(*(touch - first)) == pytest.approx(radii[0])
    assert np.hypot(*(touch - second)) == pytest.approx(radii[1])
    assert (sum(radii) if ratio < 0 else abs(radii[0] - radii[1])) == pytest.approx(distance)
    speeds = [w * np.array([-r[1], r[0]]) for w, r in ((ratio, touch - first), (1, touch - second))]
    np.testing.assert_allclose(*speeds, atol=1e-12)


def test_wheels_without_finite_circles():
    assert wheels.pitch_radii(0.1, 1.0) is None
    assert wheels.pitch_radii(0.0, -2.0) is None


def test_planetary_gear_is_drawn_to_its_teeth():
    ax = md.plot(planetary())
    radii = {
        round(circle.get_radius(), 9)
        for name in ("outer", "ring")
        for circle in with_gid(ax, f"joint-{name}-gear")
    }
    assert radii == {0.06, 0.03, 0.12}
    assert len(with_gid(ax, "joint-outer-gear") + with_gid(ax, "joint-ring-gear")) == 3
