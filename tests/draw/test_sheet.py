"""The sheet of a diagram: its title, its scale, the axes it is drawn on, its options."""

from __future__ import annotations

import pytest
from matplotlib.figure import Figure

import mechdae as md
from mechdae.draw.diagram import diagram
from mechdae.draw.words import Words
from tests.shared.drawn import (
    POSES,
    four_bar,
    gids,
    seven_link,
    with_gid,
    zoo,
)


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
    assert diagram.nice_length(about) == pytest.approx(length)
    assert diagram.length_text(length, Words()) == text


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
