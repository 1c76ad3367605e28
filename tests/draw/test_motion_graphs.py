"""Graphs of motions: marks where things stick, panels of rates, a window in time, quantities."""

from __future__ import annotations

from typing import Any

import matplotlib.pyplot as plt
import numpy as np
import pytest

import mechdae as md
from mechdae.errors import InputError
from tests.shared.command import run
from tests.shared.finer_curves import HALF, off, pixels
from tests.shared.readable import assert_readable


@pytest.fixture(autouse=True)
def closed() -> Any:
    yield
    plt.close("all")


@pytest.fixture(scope="module")
def block() -> md.Result:
    return md.solve("incline-block")


def law(result: md.Result) -> tuple[float, float, float]:
    """Return speed at first, deceleration and time of the stop of a block that slides upwards."""
    values = result.mechanism.values()
    slope = np.radians(20.0)
    a = values["g"] * (np.sin(slope) + values["mu"] * np.cos(slope))
    return values["v0"], a, values["v0"] / a


def curve(axes: Any, path: str) -> tuple[Any, Any]:
    panels = axes.get_figure(root=True).axes
    return next(
        (panel, line) for panel in panels for line in panel.lines
        if str(line.get_gid()).startswith(f"curve-{path}")
    )  # fmt: skip


def test_marks_stand_where_things_stick(block: md.Result) -> None:
    axes = md.plot(block, "curves")
    marks = [line for line in axes.lines if line.get_gid() == "event-stick"]
    assert len(marks) == 1
    assert float(marks[0].get_xdata()[0]) == pytest.approx(law(block)[2], abs=1e-6)
    assert any(text.get_text().startswith("sticks 0.25") for text in axes.texts)
    axes = md.plot(md.solve("belt-stick-slip", "first"), "curves")
    kinds = {str(line.get_gid()) for line in axes.lines if str(line.get_gid()).startswith("event")}
    assert kinds == {"event-stick", "event-slip"}
    looks = {line.get_marker() for line in axes.lines if str(line.get_gid()) in kinds}
    assert len(looks) == 2, "kinds of events are told apart by their marks"
    assert_readable(axes)


def test_a_joint_is_drawn_with_its_rates(block: md.Result) -> None:
    """Slide, speed and acceleration of a block that slides up and stops, by hand."""
    v, a, stop = law(block)
    axes = md.plot(block, "curves", of=["joints/guide"])
    labels = [panel.get_ylabel() for panel in axes.get_figure(root=True).axes]
    assert labels == ["slide [mm]", "slide velocity [m/s]", "slide acceleration [m/s²]"]
    _, line = curve(axes, "joints/guide/slide_velocity")
    t, speed = np.asarray(line.get_xdata(), float), np.asarray(line.get_ydata(), float)
    assert speed == pytest.approx(np.where(t < stop, v - a * t, 0.0), abs=1e-6)
    _, line = curve(axes, "joints/guide/slide_acceleration")
    before = np.asarray(line.get_ydata(), float)[t < stop - 1e-6]
    assert before == pytest.approx(-a, abs=1e-6)
    single = md.plot(block, "curves", of=["joints/guide/slide"])
    assert len(single.get_figure(root=True).axes) == 1
    point = md.plot(block, "curves", of=["points/block.P"])
    assert len(point.get_figure(root=True).axes) == 3


def test_a_window_is_as_smooth_as_the_whole(block: md.Result) -> None:
    """A quarter second out of ten: eleven poses, none of them within."""
    v, a, stop = law(block)
    axes = md.plot(block, "curves", start=0.05, end=0.3)
    assert axes.get_xlim() == pytest.approx((0.05, 0.3))
    panel, line = curve(axes, "joints/guide/slide")
    t = np.linspace(0.05, 0.3, 2001)
    slide = np.where(t < stop, v * t - a * t**2 / 2, v * stop / 2)
    drawn = np.stack([np.asarray(part, float) for part in line.get_data()], axis=1)
    assert off(pixels(panel, drawn), pixels(panel, np.stack([t, 1e3 * slide], axis=1))) < HALF
    low, high = panel.get_ylim()
    assert low < 1e3 * slide.min() < 1e3 * slide.max() < high
    assert high - low < 2e3 * np.ptp(slide), "the window fills the panel"


def test_a_window_along_a_driver_keeps_its_marks_and_dots() -> None:
    problem = md.load("four-bar-crank-rocker")
    result = md.solve(problem, "turn", poses=13)
    axes = md.plot(result, "curves", of=["bodies/rocker/angle"], start=100, end=200)
    _, line = curve(axes, "bodies/rocker/angle")
    first, step = line.get_markevery()
    dots = np.asarray(line.get_xdata(), float)[first::step]
    inside = dots[(dots >= 100) & (dots <= 200)]
    assert inside == pytest.approx([120, 150, 180])  # a pose every 30 degrees
    assert axes.get_xlim() == pytest.approx((100, 200))


@pytest.mark.parametrize(("start", "end"), [(20, 30), (5, 2), (0.26, 0.26)])
def test_windows_without_a_pose_are_answered(block: md.Result, start: float, end: float) -> None:
    with pytest.raises(InputError, match="time runs from 0 s to 10 s"):
        md.plot(block, "curves", start=start, end=end)


def test_windows_of_the_command(capsys: Any, tmp_path: Any) -> None:
    place = ("--out", str(tmp_path))
    code, out, _ = run(capsys, "plot", "incline-block", "--from", "0.1", "--to", "0.3", *place)
    assert code == 0
    assert "from-0.1-to-0.3" in out
    code, _, err = run(capsys, "plot", "incline-block", "--kind", "diagram", "--from", "1", *place)
    assert code == 2
    assert "--from is for curves" in err


def test_every_axis_says_what_it_shows() -> None:
    assert md.plot(md.solve("belt-stick-slip", "first"), "curves").get_ylabel() == "x [mm]"
    assert md.plot(md.solve("coasting-slider-crank"), "curves").get_ylabel() == "turned [deg]"
    axes = md.plot(md.solve("double-wishbone", "travel"), "curves")
    for panel in axes.get_figure(root=True).axes:
        assert panel.get_ylabel().split(" [")[0]
