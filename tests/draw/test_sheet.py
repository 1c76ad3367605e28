"""The sheet of a diagram: its title, its scale, the axes it is drawn on, its options."""

from __future__ import annotations

import re

import pytest
from matplotlib.figure import Figure

import mechdae as md
from mechdae.draw import style
from mechdae.draw.diagram import heads
from mechdae.draw.words import Words
from tests.shared.drawn import (
    POSES,
    four_bar,
    gids,
    seven_link,
    with_gid,
    zoo,
)
from tests.shared.live import WEB


def test_options():
    result = four_bar()
    bare = gids(md.plot(result, traces=False, labels=False))
    assert not [gid for gid in bare if gid.startswith(("trace", "label", "number", "ghost"))]
    assert gids(md.plot(result, ghosts=3)).count("ghost") == 3 * 5
    with pytest.raises(md.UnknownName, match="unknown option of a picture") as told:
        md.plot(result, trace=False)
    assert "traces" in told.value.hint


def test_given_axes_are_used():
    axes = Figure().subplots(1, 2)
    assert md.plot(four_bar(), ax=axes[1]) is axes[1]
    assert not gids(axes[0])


def test_subtitle_tells_the_driver_value():
    (subtitle,) = with_gid(md.plot(seven_link()), "subtitle")
    assert "crank.angle = 38.117°" in subtitle.get_text()
    (subtitle,) = with_gid(md.plot(zoo()), "subtitle")
    assert "way.slide = 0.1 m" in subtitle.get_text()


@pytest.mark.parametrize(
    ("about", "length", "text"),
    [(0.13, 0.1, "100 mm"), (0.0499, 0.02, "20 mm"), (7.0, 5.0, "5 m"), (1.0, 1.0, "1 m")],
)
def test_scale_bar_has_a_round_length(about, length, text):
    assert heads.nice_length(about) == pytest.approx(length)
    assert heads.length_text(length, Words()) == text


def test_long_titles_are_fitted():
    result = four_bar(POSES[:1])
    result.title = "A very long title of a mechanism " * 8
    axes = md.plot(result)
    (title, rest) = (with_gid(axes, gid)[0] for gid in ("title", "title-rest"))
    assert title.get_text().endswith("…")
    assert rest.get_text().endswith("…")
    result.title = "Crank and rocker, coupler and frame; " * 3
    axes = md.plot(result)
    (title, rest) = (with_gid(axes, gid)[0] for gid in ("title", "title-rest"))
    assert f"{title.get_text()} {rest.get_text()}" == result.title
    result.title = "Four-bar"
    assert not with_gid(md.plot(result), "title-rest")


def luminance(colour):
    """Return the relative luminance of WCAG 2.2."""
    parts = [int(colour[k : k + 2], 16) / 255 for k in (1, 3, 5)]
    linear = [
        part / 12.92 if part <= 0.04045 else ((part + 0.055) / 1.055) ** 2.4 for part in parts
    ]
    return 0.2126 * linear[0] + 0.7152 * linear[1] + 0.0722 * linear[2]


def contrast(first, second):
    low, high = sorted((luminance(first), luminance(second)))
    return (high + 0.05) / (low + 0.05)


def test_contrast_is_that_of_wcag():
    assert contrast("#000000", "#ffffff") == pytest.approx(21.0)
    assert contrast("#777777", "#ffffff") == pytest.approx(4.48, abs=0.01)


@pytest.mark.parametrize("theme", [style.LIGHT, style.DARK], ids=["light", "dark"])
def test_lines_are_seen_on_their_paper(theme):
    """Three to one, WCAG 1.4.11; text 4.5 to one."""
    paper = theme.paint(style.PAPER)
    for colour in set(style.DRAWN) - {style.GHOST}:
        assert contrast(theme.paint(colour), paper) >= 3.0, colour
    for colour in (style.INK, style.LOAD, style.FAINT):
        assert contrast(theme.paint(colour), paper) >= 4.5, colour
    for colour in style.SERIES if theme is style.LIGHT else ():
        assert contrast(colour, paper) >= 3.0, colour


def test_lines_of_pages_are_seen_on_their_paper():
    css = (WEB / "page.css").read_text(encoding="utf-8")
    for block in re.findall(r":root[^{]*\{([^}]*)\}", css):
        colours = dict(re.findall(r"--(\w+): (#[0-9a-f]{6})", block))
        for name in (
            "ink",
            "driven",
            "trace",
            "arrow",
            "force",
            "wheel",
            "ground",
            "load",
            "faint",
        ):
            assert contrast(colours[name], colours["paper"]) >= 3.0, name
