"""Curves are drawn of poses so near each other that straight lines are within half a pixel."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import matplotlib.pyplot as plt
import numpy as np
import pytest

import mechdae as md
from mechdae.draw import smooth
from mechdae.draw.diagram.scene import choose_pose, read_scene
from mechdae.draw.graphs.series import vector_of
from mechdae.draw.space.spatial_scene import read_spatial
from tests.shared.finer_curves import HALF, farthest, off, pixels
from tests.shared.mechanisms import four_bar

HARD = ("belt-stick-slip", "four-stroke-engine", "gorshkov-seven-link", "incline-block",
        "scotch-yoke-jam", "toggle-press")  # fmt: skip


def line_of(axes: Any, gid: str) -> Any:
    figure = axes.get_figure(root=True)
    found = next(a for a in figure.findobj() if str(a.get_gid() or "").startswith(gid))
    return found, np.stack(found.get_data(), axis=1)


def test_a_block_stops_where_it_stops() -> None:
    """Eleven poses of ten seconds; it slides up for a quarter of the first: x = v0 t - a t^2/2."""
    result = md.solve("incline-block")
    assert len(result.time) == 11
    values = result.mechanism.values()
    speed, mu, slope = values["v0"], values["mu"], np.radians(20.0)
    stop = speed / (values["g"] * (np.sin(slope) + mu * np.cos(slope)))
    t = np.linspace(0.0, float(result.time[-1]), 4001)
    slide = np.where(t < stop, speed * t * (1 - t / (2 * stop)), speed * stop / 2)
    axes = md.plot(result, "curves")
    _, line = line_of(axes, "curve-joints/guide/slide")
    assert off(pixels(axes, line), pixels(axes, np.stack([t, 1e3 * slide], axis=1))) < HALF
    plt.close("all")


@pytest.mark.parametrize("seed", range(8))
def test_coupler_curves_of_random_four_bars_of_few_poses(seed: int) -> None:
    """Drawn lines against the closed form at 50 times as many angles, to half a pixel."""
    random = np.random.default_rng(seed)
    a, (b, c, d) = 1.0, random.uniform([2.5, 2.4, 2.6], [3.5, 3.0, 3.2])
    x, y = random.uniform(-2.0, 3.0, 2)
    mechanism = four_bar(a, b, c, d, coupler=0.7, rocker=1.4)
    bodies = dict(mechanism.bodies)
    points = {**bodies["coupler"].points, "P": (x, y)}
    bodies["coupler"] = md.Body("coupler", points)
    mechanism = md.Mechanism(
        ground=mechanism.ground, bodies=list(bodies.values()),
        joints=list(mechanism.joints.values()), sketch={"coupler": 0.7, "rocker": 1.4},
    )  # fmt: skip
    count = int(random.integers(5, 30))
    turn = md.Sweep(md.Driver("crank.angle", from_=0.0, to=2 * np.pi), poses=count)
    result = md.solve(mechanism, turn)
    u = np.linspace(0.0, 2 * np.pi, 50 * count)
    pin = a * np.exp(1j * u)
    way = d - pin
    lift = np.arccos((b**2 + abs(way) ** 2 - c**2) / (2 * b * abs(way)))
    truth = pin + (x + 1j * y) * way / abs(way) * np.exp(1j * lift)
    axes = md.plot(result, "coupler", of=["coupler.P"])
    _, line = line_of(axes, "locus-coupler.P")
    scale = 1.0 if np.abs(line).max() < 30 else 1e3
    places = scale * np.stack([truth.real, truth.imag], axis=1)
    assert off(pixels(axes, line), pixels(axes, places)) < HALF
    paths = smooth.traced(read_scene(result), result, read_scene).paths
    plt.close("all")
    size = max(float(np.ptp(own, axis=0).max()) for own in paths.values())
    pixel = smooth.PICTURE / size
    assert off(paths["coupler.P"] * pixel, places / scale * pixel) < HALF


def test_a_helix_is_round() -> None:
    """The rim of the screw press, a pose in each quarter of a turn: chords stay on the helix."""
    result = md.solve("screw-press", "stroke")
    paths = smooth.traced(read_spatial(result), result, read_spatial).paths
    rim = paths["spindle.rim"]
    across = rim[:, :2]
    centre = (across.max(axis=0) + across.min(axis=0)) / 2
    radius = np.hypot(*(across - centre).T)
    chords = np.hypot(*((across[1:] + across[:-1]) / 2 - centre).T)
    pixel = smooth.PICTURE / max(float(np.ptp(own, axis=0).max()) for own in paths.values())
    assert float((radius[:-1] - chords).max()) * pixel < HALF


def test_a_few_named_poses_are_dots() -> None:
    result = md.solve("cusp-coupler", "cusp")
    axes = md.plot(result, "coupler")
    line, data = line_of(axes, "locus-coupler.P")
    assert line.get_linestyle() == "None"
    assert line.get_marker() == "o"
    assert len(data) == 7
    axes = md.plot(md.solve("delta-robot", "path"), "curves")
    line, data = line_of(axes, "curve-")
    assert line.get_linestyle() == "None"
    assert len(data) == 3
    assert all(float(own) == int(own) for own in axes.get_xticks())  # poses are counted
    plt.close("all")


def test_asked_poses_are_dots_on_the_curve() -> None:
    mechanism = four_bar(1.0, 3.0, 2.5, 3.2, coupler=0.7, rocker=1.4)
    turn = md.Sweep(md.Driver("crank.angle", from_=0.0, to=2 * np.pi), poses=9)
    result = md.solve(mechanism, turn)
    axes = md.plot(result, "curves", of=["bodies/rocker/angle"])
    line, data = line_of(axes, "curve-")
    _, every = line.get_markevery()
    np.testing.assert_allclose(
        np.radians(data[::every, 1]), result.bodies["rocker"].angle, rtol=0, atol=1e-12
    )
    plt.close("all")


def test_enough_poses_are_drawn_as_they_are(monkeypatch: pytest.MonkeyPatch) -> None:
    """Nothing is solved for a picture whose poses are near each other."""
    result = md.solve("four-bar-crank-rocker")
    monkeypatch.setattr(md.Result, "finer", lambda *_: pytest.fail("solved again"))
    md.plot(result, "diagram")
    md.plot(result, "curves")
    md.plot(result, "coupler")
    plt.close("all")


def test_chords_are_seen(monkeypatch: pytest.MonkeyPatch) -> None:
    """Planted: the poses are joined as they are."""
    from mechdae.draw.graphs import curves

    monkeypatch.setattr(curves, "smooth", lambda result, seen: result)
    with pytest.raises(AssertionError):
        test_a_block_stops_where_it_stops()


@pytest.mark.parametrize("problem", HARD)
def test_curves_with_kinks_poles_and_limits(problem: str) -> None:
    """Kinks where something sticks, roots at limit positions, forces that end in jams."""
    assert farthest(problem) < HALF


def test_paths_end_at_stops() -> None:
    """Nothing is drawn of where a stop does not let the mechanism go."""
    problem = md.load("four-bar-crank-rocker")
    pin, stop = problem.mechanism.joints["D"], np.deg2rad(120)
    held = md.Revolute("D", pin.first, pin.second, limits=(0.0, stop))
    mechanism = replace(problem.mechanism, joints=problem.mechanism.joints.with_("D", held))
    driver = md.Driver("crank.angle", from_=0, to=2 * np.pi)
    result = md.solve(mechanism, md.Sweep(driver=driver, poses=37))
    assert {"ok", "stopped"} == set(result.status)
    scene, sizes = read_scene(result), mechanism.values()
    assert result.status[choose_pose(scene, "sweep")] == "ok"
    finest = smooth.smooth_vectors(result, ["coupler.C"])
    least = sizes["d"] + sizes["c"] * np.cos(stop)  # where the rocker is at its stop
    for track in (
        smooth.traced(scene, result, read_scene).paths["coupler.C"],
        vector_of(finest, "coupler.C")[3],
    ):
        x = track[np.isfinite(track).all(axis=1), 0]
        assert least <= x.min() < least + 2e-3
        assert len(x) < len(track)
