"""Pictures of a width on paper: their size, letters of 6 pt at least, and no empty halves."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
import pytest
from matplotlib.figure import Figure
from matplotlib.patches import Circle
from matplotlib.text import Text

import mechdae as md
from mechdae.cli import main
from mechdae.draw import style
from mechdae.errors import InputError
from tests.shared.drawn import filled

INCH = 25.4
PICTURES = [
    ("four-bar-crank-rocker", "turn", "diagram"), ("toggle-press", "cycle", "diagram"),
    ("rssr", "turn", "diagram"), ("four-bar-crank-rocker", "turn", "curves"),
    ("four-bar-crank-rocker", "turn", "coupler"), ("slider-crank-friction", "cycle", "losses"),
]  # fmt: skip


def letters(figure):
    """Return the sizes [pt] of all texts that are there."""
    texts = figure.findobj(lambda part: isinstance(part, Text) and part.get_text().strip())
    return [text.get_fontsize() for text in texts if text.get_visible()]


@pytest.mark.parametrize(("problem", "task", "kind"), PICTURES)
@pytest.mark.parametrize("width", ["90mm", "180mm"])
def test_width_and_letters(problem: str, task: str, kind: str, width: str) -> None:
    figure = md.plot(md.solve(problem, task, poses=25), kind, width=width).get_figure()
    figure.canvas.draw()
    assert figure.get_size_inches()[0] * INCH == pytest.approx(float(width[:-2]), abs=1e-9)
    sizes = letters(figure)
    assert len(sizes) > 5
    assert min(sizes) >= 6.0 - 1e-9


@pytest.mark.parametrize(("problem", "task", "kind"), PICTURES[:3])
def test_a_mechanism_fills_the_width(problem: str, task: str, kind: str) -> None:
    """What the axes show is the box of the mechanism and little more."""
    axes = md.plot(md.solve(problem, task, poses=25), kind, width="90mm", title=False)
    places = np.vstack([line.get_xydata() for line in axes.lines])
    low, high = places.min(axis=0), places.max(axis=0)
    shown = np.array([axes.get_xlim(), axes.get_ylim()])
    shares = (high - low) / (shown[:, 1] - shown[:, 0])
    assert shares.max() > 0.6


@pytest.mark.parametrize("kind", ["diagram", "curves"])
def test_without_a_title(kind: str) -> None:
    result = md.solve("four-bar-crank-rocker", "turn", poses=25)
    bare, whole = (md.plot(result, kind, title=titled).get_figure() for titled in (False, True))
    heads = [
        [str(text.get_gid()) for text in one.findobj(Text) if "title" in str(text.get_gid())]
        for one in (bare, whole)
    ]
    assert heads[0] == []
    assert len(heads[1]) >= 2
    assert bare.get_size_inches()[1] < whole.get_size_inches()[1]


def test_pixels_and_units_of_widths(tmp_path) -> None:
    from PIL import Image

    result = md.solve("four-bar-crank-rocker", "turn", poses=25)
    for width, inches in (("9cm", 9 / 2.54), (90, 9 / 2.54), ("3.5in", 3.5), ("252pt", 3.5)):
        file = tmp_path / "picture.png"
        figure = md.plot(result, width=width, dpi=200).get_figure()
        figure.savefig(file)
        with Image.open(file) as picture:
            assert abs(picture.width - math.floor(200 * inches)) <= 1


@pytest.mark.parametrize("width", ["9xm", "-90mm", "1mm", "2000mm", "nan", "mm", ""])
def test_widths_that_are_none(width: str) -> None:
    result = md.solve("four-bar-crank-rocker", "turn", poses=25)
    with pytest.raises(InputError, match="a width from 40 mm to 1 m is needed"):
        md.plot(result, width=width)


@pytest.mark.parametrize("dpi", [5, 100000, 72.5, True])
def test_pixels_that_are_none(dpi) -> None:
    result = md.solve("four-bar-crank-rocker", "turn", poses=25)
    with pytest.raises(InputError, match="dpi is a whole number"):
        md.plot(result, dpi=dpi)


def test_axes_that_are_given_keep_their_size() -> None:
    result = md.solve("four-bar-crank-rocker", "turn", poses=25)
    axes = md.plot(result)
    with pytest.raises(InputError, match="figure of their own"):
        md.plot(result, "curves", axes, width="90mm")
    with pytest.raises(InputError, match="an animation has its width in pixels"):
        md.plot(result, "animation", width="90mm")


def test_a_page_of_plans_is_not_too_small() -> None:
    result = md.solve("four-bar-crank-rocker", "turn", poses=25)
    with pytest.raises(InputError, match="178 mm wide at least"):
        md.plot(result, "plans", width="90mm")


def test_the_command(tmp_path, capsys) -> None:
    file = tmp_path / "picture.svg"
    options = ["--width", "90mm", "--no-title", "--out", str(file)]
    assert main(["plot", "four-bar-crank-rocker", *options]) == 0
    text = file.read_text(encoding="utf-8")
    assert f'width="{90 / INCH * 72:.4f}'[:10] in text
    assert "pose " not in text
    assert "<title>Four-bar crank-rocker with a coupler point</title>" in text  # for screen readers
    assert main(["plot", "four-bar-crank-rocker", "--width", "1", "--out", str(file)]) == 2
    assert "such as 90mm" in capsys.readouterr().err


def test_letters_that_shrink_further_are_seen(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(style, "SMALLEST", 0.6)
    result = md.solve("four-bar-crank-rocker", "turn", poses=25)
    assert min(letters(md.plot(result, width="90mm").get_figure())) < 6.0


@pytest.mark.parametrize("problem", ["four-bar-crank-rocker", "rssr"])
def test_titles_above_the_axes_are_seen(problem: str) -> None:
    """Ink above the axes: a title that is clipped by them has its place and is not drawn."""

    def ink_above(**options: object) -> int:
        axes = md.plot(md.solve(problem), "diagram", **options)
        figure = axes.get_figure(root=True)
        figure.canvas.draw()
        pixels = np.asarray(figure.canvas.buffer_rgba())[..., :3].astype(int)
        rows = pixels.shape[0] - int(axes.bbox.y1)
        return int((pixels[: max(rows, 0)].sum(axis=2) < 500).sum())

    assert ink_above() > 300
    assert ink_above(title=False) == 0


def test_mechanisms_fill_their_pictures() -> None:
    """All of them: `tests/draw/test_fill.py`."""
    names = ("slider-crank", "four-bar-crank-rocker", "jamming-drawer", "rssr", "kite", "hexapod")
    shares = [filled(name) for name in names]
    assert np.median(shares) >= 0.65
    assert min(shares) >= 0.42


@pytest.mark.parametrize(
    ("problem", "task", "names"),
    [("friction-planetary", "turn", "rim"), ("eccentric-slider", "motion", "mass-block")],
)
def test_all_of_a_mechanism_is_in_the_picture(problem: str, task: str, names: str) -> None:
    """A ring larger than what turns in it, a centre of mass above all points."""
    axes = md.plot(md.solve(problem, task), "diagram", width="90mm")
    circles = [own for own in axes.patches if isinstance(own, Circle)]
    circles = [own for own in circles if names == "rim" or own.get_gid() == names]
    largest = max(circles, key=Circle.get_radius)
    for middle, ends in zip(largest.center, (axes.get_xlim(), axes.get_ylim()), strict=True):
        assert ends[0] < middle - largest.radius
        assert middle + largest.radius < ends[1]


def test_wide_lines_have_room() -> None:
    """The groove of a rotor's seals is drawn as one line of its width."""
    axes = md.plot(md.solve("wankel-rotor", "turn", poses=9), "diagram", width="90mm")
    groove = next(own for own in axes.lines if str(own.get_gid()).endswith("-curve"))
    units = axes.get_window_extent().width / np.ptp(axes.get_xlim()) * 72 / axes.figure.dpi
    room = np.min(groove.get_xdata()) - axes.get_xlim()[0]
    assert room * units > groove.get_linewidth() / 2


def test_letters_as_text_on_the_command_line(tmp_path: Path) -> None:
    file = tmp_path / "x.svg"
    assert main(["plot", "four-bar-crank-rocker", "--text", "--out", str(file), "--quiet"]) == 0
    assert "<text" in file.read_text(encoding="utf-8")
    for more in (["--format", "png"], ["--kind", "animation"]):
        assert main(["plot", "four-bar-crank-rocker", "--text", *more, "--out", str(tmp_path)]) == 2


@pytest.mark.parametrize("place", [None, (0, 0, 1, 1)])
@pytest.mark.parametrize("size", [(2.6, 2.0), (3.54, 2.5), (7.0, 5.0), (12.0, 8.0)])
def test_titles_are_seen_in_axes_of_others(
    size: tuple[float, float], place: tuple[float, float, float, float] | None
) -> None:
    figure = Figure(figsize=size)
    axes = figure.subplots() if place is None else figure.add_axes(place)
    md.plot(md.solve("jansen-leg", "turn", poses=25), "diagram", ax=axes)
    figure.canvas.draw()
    titles = [text for text in figure.findobj(Text) if "title" in str(text.get_gid())]
    assert len(titles) >= 2
    for text in titles:
        box = text.get_window_extent()
        assert box.y1 <= figure.bbox.height + 0.5, text.get_text()
        assert box.x1 <= figure.bbox.width + 0.5, text.get_text()


@pytest.mark.parametrize("dpi", [60, 90, 137])
def test_titles_of_graphs_are_whole_at_every_resolution(dpi: int) -> None:
    """Letters made of few pixels are wider than their outlines."""
    result = md.solve("scotch-yoke-jam", "turn", poses=25)
    figure = md.plot(result, "curves", dpi=dpi).get_figure(root=True)
    figure.canvas.draw()
    titles = [text for text in figure.findobj(Text) if str(text.get_gid()).startswith("title")]
    assert titles
    assert max(text.get_window_extent().x1 for text in titles) < figure.bbox.x1 - 0.04 * dpi
