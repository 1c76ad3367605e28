"""Several results on the same axes: nothing is drawn over another, all are named."""

from __future__ import annotations

import numpy as np
import pytest
from matplotlib.colors import to_hex
from matplotlib.figure import Figure

import mechdae as md
from mechdae.draw import style
from mechdae.draw.variants import variant_names
from tests.shared.readable import assert_readable

RADII = (0.04, 0.05, 0.06)


@pytest.fixture(scope="module")
def cranks() -> list[md.Result]:
    problem = md.load("slider-crank")
    return [md.solve(problem, "turn", set={"r": r}, poses=25) for r in RADII]


def titles(ax) -> list[str]:
    return [own.get_text() for own in ax.texts if str(own.get_gid()).startswith("title")]


def test_diagrams_of_variants_share_a_scale(cranks) -> None:
    ax = md.plot(cranks[0], "diagram", pose=3)
    for result in cranks[1:]:
        assert md.plot(result, "diagram", ax, pose=3) is ax
    names = [f"variant-r = {1e3 * r:g} mm" for r in RADII]
    legend = {own.get_gid(): own for own in ax.texts if str(own.get_gid()).startswith("variant")}
    assert list(legend) == names
    colors = [to_hex(legend[name].get_color()) for name in names]
    assert colors == list(style.SERIES[:3])
    assert len(titles(ax)) == 1
    cranks_drawn = [own for own in ax.lines if own.get_gid() == "body-crank-bar"]
    lengths = {to_hex(own.get_color()): np.ptp(own.get_xydata(), axis=0) for own in cranks_drawn}
    for r, color in zip(RADII, style.SERIES, strict=False):
        assert np.hypot(*lengths[color]) == pytest.approx(r, rel=1e-9)
    # letters once
    letters = [own.get_gid() for own in ax.texts if str(own.get_gid()).startswith("label-")]
    assert len(letters) == len(set(letters))
    assert len([own for own in ax.texts if own.get_gid() == "scale-text"]) == 1


def test_curves_of_variants_have_colours_and_names(cranks) -> None:
    """Names are words: what stands between two dollars in them is no formula."""
    ax = md.plot(cranks[0], "curves", of="joints/guide/slide")
    for k, result in enumerate(cranks[1:], start=1):
        md.plot(result, "curves", ax, of="joints/guide/slide", label=f"{k}$ of 3$")
    drawn = [own for own in ax.lines if str(own.get_gid()).startswith("curve-")]
    assert [own.get_color() for own in drawn] == list(style.SERIES[:3])
    for own, result in zip(drawn, cranks, strict=True):
        first, step = own.get_markevery()
        asked = own.get_ydata()[first::step]
        assert asked == pytest.approx(1e3 * result.joints["guide"].slide)
    words = [own.get_text() for own in ax.texts]
    for name in ("r = 40 mm", r"1\$ of 3\$", r"2\$ of 3\$"):
        assert words.count(name) == 2  # in the key, and at the end of its curve
    assert len(titles(ax)) == 1
    assert len(ax.figure.axes) == 1
    assert_readable(ax)


def test_panels_of_variants_stay_in_their_place(cranks) -> None:
    figure = Figure(figsize=(8, 6))
    figure.set_canvas(type(figure.canvas)(figure))
    left = figure.add_axes((0.1, 0.1, 0.5, 0.6))
    of = ["joints/guide/slide", "joints/guide/slide_velocity"]
    for result in cranks:
        md.plot(result, "curves", left, of=of)
    assert len(figure.axes) == 2
    for panel in figure.axes:
        box = panel.get_position()
        assert box.x0 >= 0.1 - 1e-9
        assert box.y0 >= 0.1 - 1e-9
        assert box.y1 <= 0.7 + 1e-9
    assert len(titles(left)) == 1


def test_paths_of_variants(cranks) -> None:
    ax = md.plot(cranks[0], "coupler", of="crank.B")
    md.plot(cranks[2], "coupler", ax, of="crank.B")
    loci = [own for own in ax.lines if str(own.get_gid()).startswith("locus-")]
    assert [own.get_gid() for own in loci] == [f"locus-crank.B, r = {r} mm" for r in (40, 60)]
    assert len(titles(ax)) == 1
    assert_readable(ax)


def test_pictures_that_cannot_share_axes_say_so(cranks) -> None:
    ax = md.plot(cranks[0], "diagram")
    with pytest.raises(md.InputError, match="hold a picture of kind 'diagram'") as told:
        md.plot(cranks[1], "curves", ax)
    assert "ax.clear()" in told.value.hint
    with pytest.raises(md.InputError, match="Axes are needed, not 1"):
        md.plot(cranks[0], "diagram", 1)
    ax.clear()  # then they are empty axes
    assert titles(md.plot(cranks[1], "curves", ax)) == titles(md.plot(cranks[1], "curves"))


def test_axes_with_other_artists_are_drawn_in(cranks) -> None:
    ax = Figure().add_subplot()
    ax.plot([0, 1], [0, 1])
    md.plot(cranks[0], "diagram", ax)
    assert [own for own in ax.lines if own.get_gid() == "body-crank-bar"]


def test_names_of_variants(cranks) -> None:
    plain = [(result, {}) for result in cranks[:2]]
    assert variant_names(plain) == ["r = 40 mm", "r = 50 mm"]
    assert variant_names([plain[0], (cranks[1], {"label": "new"})]) == ["r = 40 mm", "new"]
    assert variant_names([plain[0], plain[0]]) == ["variant 1", "variant 2"]
    assert variant_names([(r, {"label": "x"}) for r in cranks[:2]]) == ["x (1)", "x (2)"]
