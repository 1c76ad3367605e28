"""Graphs of what runs through infinity: cut there, clipped, and the picture says where."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

import mechdae as md
from mechdae.draw.graphs.poles import clip_of, cuts

TURN = np.linspace(0.0, 2 * np.pi, 361)
TEXT = """
schema = 1
title = "Four-bar with an output that has poles"
[parameters]
a = 0.04
b = 0.12
c = 0.08
d = 0.1
[ground]
points = { A = [0, 0], D = ["d", 0] }
[bodies.crank]
points = { A = [0, 0], B = ["a", 0] }
[bodies.rod]
points = { B = [0, 0], C = ["b", 0] }
[bodies.rocker]
points = { D = [0, 0], C = ["c", 0] }
[joints]
A = { kind = "revolute", between = ["ground.A", "crank.A"] }
B = { kind = "revolute", between = ["crank.B", "rod.B"] }
C = { kind = "revolute", between = ["rod.C", "rocker.C"] }
D = { kind = "revolute", between = ["ground.D", "rocker.D"] }
[sketch]
crank_deg = 60
rod_deg = 20
rocker_deg = 80
[outputs]
advantage = "crank.angle.speed/rocker.angle.speed"
[tasks.turn]
kind = "sweep"
driver = { coordinate = "crank.angle", from_deg = 0, to_deg = 360 }
measures = ["instant-centres"]
"""


@pytest.mark.parametrize("shift", np.linspace(0.02, 0.98, 9))
@pytest.mark.parametrize(
    "form", [lambda x: 1 / x, lambda x: 5 - 3 / x + x, lambda x: 1 / np.sinh(x)]
)
def test_changes_of_sign_through_infinity_are_cut(form, shift) -> None:
    x = np.linspace(-1.0, 1.0, 101) - 0.02 * (1.0 - shift)
    at = cuts(form(x))
    assert at == [int(np.flatnonzero(x < 0)[-1])]
    clip = clip_of(x, form(x), at)
    assert clip.beyond[0].at == pytest.approx(0.0, abs=0.02 * 0.2)
    assert clip.high - clip.low < np.ptp(form(x))


@pytest.mark.parametrize(
    "values",
    [
        np.sin(5 * TURN),
        np.sign(np.sin(TURN + 0.01)),  # friction that turns round
        np.where(np.cos(TURN) > 0.98, 1e3, 1.0),  # a push over a few poses
        np.exp(-((TURN - 3.0) ** 2) / 0.002),  # a smooth peak
        np.maximum(0.0, 1.0 - np.abs(TURN - 3.0) / 0.12),  # a spike with straight sides
        np.random.default_rng(1).normal(size=361),
        np.where(TURN > 3.0, 5.0, -5.0) + 0.1 * np.sin(TURN),
        np.full(361, 2.0),
    ],
)
def test_what_is_no_pole_stays_whole(values) -> None:
    assert cuts(values) == []
    assert clip_of(TURN, values, []) is None


def test_growth_without_end_before_a_limit_is_clipped() -> None:
    x = np.linspace(1e-4, 1.0, 361)
    clip = clip_of(x, 1 / x, [])
    assert [own.at for own in clip.beyond] == [x[0]]
    assert not clip.beyond[0].pole
    assert clip.high < 100 < 1e4 == pytest.approx(clip.beyond[0].value)


def test_a_plateau_beside_a_pole_stays_in_the_picture() -> None:
    x = np.linspace(-1.0, 1.0, 201) + 0.003
    values = np.where((x > 0.5) & (x < 0.55), 150.0, 1 / x)
    clip = clip_of(x, values, cuts(values))
    assert clip.high >= 150.0
    assert [own.pole for own in clip.beyond] == [True]


def dead_centres() -> list[float]:
    """Crank angles [deg] at which crank and rod are in line: the rocker stands still."""
    a, b, c, d = 0.04, 0.12, 0.08, 0.1
    stretched = np.arccos(((a + b) ** 2 + d**2 - c**2) / (2 * (a + b) * d))
    folded = np.arccos(((b - a) ** 2 + d**2 - c**2) / (2 * (b - a) * d)) + np.pi
    return np.rad2deg([stretched, folded]).tolist()


@pytest.fixture(scope="module")
def result(tmp_path_factory) -> md.Result:
    path: Path = tmp_path_factory.mktemp("poles") / "poles.toml"
    path.write_text(TEXT)
    return md.solve(md.load(path), "turn")


def lines_at(panel) -> list[float]:
    return sorted(
        float(own.get_xdata()[0]) for own in panel.lines if str(own.get_gid()).startswith("beyond-")
    )


def test_an_output_with_poles_is_read_beside_them(result: md.Result) -> None:
    panel = md.plot(result, "curves", of="advantage")
    assert lines_at(panel) == pytest.approx(dead_centres(), abs=0.05)
    low, high = panel.get_ylim()
    drawn = next(own for own in panel.lines if own.get_gid() == "curve-advantage-advantage")
    values = drawn.get_ydata()
    assert np.isnan(values).sum() == 2  # not drawn through infinity
    inside = (values >= low) & (values <= high)
    assert 0.85 < inside.mean() < 1.0
    assert np.nanmax(np.abs(values)) > 2 * high
    said = [own.get_text() for own in panel.texts]
    assert any(text.startswith("beyond the picture") for text in said)


def test_centres_are_not_drawn_through_infinity(result: md.Result) -> None:
    """The centre of the rod is at infinity where it does not turn."""
    speed = result.bodies["rod"].angular_velocity
    turns = np.flatnonzero(speed[1:] * speed[:-1] < 0)
    assert len(turns) == 2
    panel = md.plot(result, "curves", of="centres/ground-rod")
    for axis in "xy":
        gid = f"curve-centres/ground-rod-ground-rod {axis}"
        line = next(own for own in panel.lines if own.get_gid() == gid)
        gaps = np.flatnonzero(np.isnan(line.get_ydata()))
        assert len(gaps) == 2
        angles = np.rad2deg(result.drivers["crank.angle"].position)
        for gap, turn in zip(gaps, turns, strict=True):
            before, behind = line.get_xdata()[gap - 1], line.get_xdata()[gap + 1]
            assert angles[turn] - 1e-9 <= before < behind <= angles[turn + 1] + 1e-9
    panel = md.plot(result, "coupler", of="centres/ground-rod")
    locus = next(own for own in panel.lines if own.get_gid() == "locus-ground-rod")
    assert np.isnan(locus.get_xdata()).sum() == 2
    assert np.ptp(panel.get_xlim()) < 5.0  # the mechanism is 0.1 m wide, centres are 20 m away
    assert panel.get_xlabel().startswith("x")
    words = " ".join(own.get_text() for own in panel.texts)
    assert "paths of instant centres" in words
    assert "beyond the picture" in words
