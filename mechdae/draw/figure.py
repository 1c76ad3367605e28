"""Figures without windows, and files that are the same byte for byte each time."""

from __future__ import annotations

import base64
import io
import math
import re
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from contextvars import ContextVar
from html import escape
from pathlib import Path
from typing import Any

import matplotlib as mpl
from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure
from matplotlib.text import Text

from mechdae.describe.file.atomic_write import whole_file
from mechdae.draw import style
from mechdae.draw.fonts import Font
from mechdae.errors import InputError
from mechdae.records import dataclass
from mechdae.types import Floats, Json

FORMATS: dict[str, dict[str, Any]] = {
    "svg": {"Date": None, "Creator": None},
    "png": {"Software": None},
    "pdf": {"CreationDate": None, "Creator": None, "Producer": None},
}
"""Formats with the metadata that would change from one run or version to the next."""
SETTINGS: Any = {"svg.hashsalt": "mechdae", "svg.fonttype": "path"}


WIDEST, NARROWEST = 1.0, 0.04
"""Bounds of the width of a picture [m]."""
FLATTEST, TALLEST = 0.2, 1.2
"""Bounds of the height of what is drawn over its width on paper of a given width."""
FINEST = 2400
"""Most pixels to the inch."""
LENGTHS = {"mm": 1e-3, "cm": 1e-2, "in": 0.0254, "pt": 0.0254 / 72}


@dataclass(frozen=True)
class PrintFormat:
    """How new figures are printed.

    ``width`` [in] is None as usual, ``dpi`` pixels to the inch, ``titled`` whether a title and a
    line below it stand above the picture.
    """

    width: float | None = None
    dpi: int = style.DPI
    titled: bool = True

    @property
    def share(self) -> float:
        """Width over the usual one."""
        return 1.0 if self.width is None else self.width / style.FIGURE[0]

    @property
    def top(self) -> float:
        """Strip above the axes [pt]: smaller pictures have smaller titles."""
        return style.TOP * min(max(self.share, style.SMALLEST), 1.0) if self.titled else style.EDGE


USUAL_FORMAT = PrintFormat()
_FORMAT: ContextVar[PrintFormat] = ContextVar("print format", default=USUAL_FORMAT)


def current_format() -> PrintFormat:
    """Return how figures are printed that are made now."""
    return _FORMAT.get()


@contextmanager
def printed(on: PrintFormat) -> Iterator[None]:
    """Make new figures in a format."""
    token = _FORMAT.set(on)
    try:
        yield
    finally:
        _FORMAT.reset(token)


def print_format(width: str | float | None, dpi: int | None, title: bool) -> PrintFormat:
    """Return the format of a width such as ``"90mm"`` (a number is in mm), pixels and a title.

    Raises
    ------
    InputError
        No width, or one out of range; pixels that are no whole number from 20 to `FINEST`.
    """
    dots = style.DPI if dpi is None else dpi
    if isinstance(dots, bool) or not isinstance(dots, int) or not 20 <= dots <= FINEST:
        raise InputError(f"dpi is a whole number from 20 to {FINEST}", where="dpi")
    if width is None:
        return PrintFormat(None, dots, title)
    found = re.fullmatch(r"\s*(\d+(?:\.\d*)?|\.\d+)\s*(mm|cm|in|pt)?\s*", str(width))
    metres = float(found[1]) * LENGTHS[found[2] or "mm"] if found else math.nan
    if not NARROWEST <= metres <= WIDEST:
        raise InputError(
            f"a width from {1e3 * NARROWEST:g} mm to {WIDEST:g} m is needed, not {width}",
            where="width", hint="such as 90mm, 9cm, 3.5in or 255pt",
        )  # fmt: skip
    return PrintFormat(metres / 0.0254, dots, title)


class ShownAxes(Axes):
    """Axes that a notebook shows, whatever back end it has chosen: those of our own figures."""

    def _repr_png_(self) -> tuple[bytes, dict[str, str]]:
        """Return the whole figure, two pixels for each of the usual ones, and what it shows."""
        figure, file = figure_of(self), io.BytesIO()
        figure.savefig(file, format="png", dpi=2 * style.DPI, metadata=FORMATS["png"])
        return file.getvalue(), {"alt": ". ".join(heads_of(figure))}


class Drawing(Figure):
    """A figure without a window; as the last line of a cell its axes show it."""

    def add_axes(self, *args: Any, **options: Any) -> Axes:
        """Return new axes, see `matplotlib.figure.Figure.add_axes`."""
        return super().add_axes(*args, **{"axes_class": ShownAxes, **options})


def svg_text(picture: Axes | Figure, text: bool = False) -> str:
    """Return a picture as the text of an SVG file, the same each time, see `save`."""
    file, figure = io.BytesIO(), figure_of(picture)
    with mpl.rc_context(SETTINGS | ({"svg.fonttype": "none"} if text else {})):
        figure.savefig(file, format="svg", metadata=FORMATS["svg"])
    return described(file.getvalue().decode("utf-8"), figure)


def heads_of(figure: Figure) -> list[str]:
    """Return the title and the line below it of a picture, of one without them what it shows."""
    texts = [(str(artist.get_gid()), artist.get_text()) for artist in figure.findobj(Text)]
    heads = (
        " ".join(dict.fromkeys(text for gid, text in texts if gid.startswith(word)))
        for word in ("title", "subtitle")
    )
    found = [" ".join(head.split()) for head in heads if head.strip()]
    return found or [label for label in [str(figure.get_label())] if label]


def described(svg: str, figure: Figure) -> str:
    """Return an SVG with title and description for readers that do not see it."""
    words = [escape(text) for text in heads_of(figure)]
    if not words:
        return svg
    head, tail = svg.split("<defs>", 1)
    more = f"<desc>{words[1]}</desc>" if len(words) > 1 else ""
    return f"{head}<title>{words[0]}</title>{more}\n <defs>{tail}"


def data_url(picture: Axes | Figure) -> str:
    """Return a picture as an SVG that an ``<img>`` shows."""
    text = base64.b64encode(svg_text(picture).encode("utf-8")).decode("ascii")
    return f"data:image/svg+xml;base64,{text}"


def figure_of(picture: Axes | Figure) -> Figure:
    """Return the figure of axes, or itself."""
    figure = picture if isinstance(picture, Figure) else picture.get_figure(root=True)
    assert isinstance(figure, Figure)
    return figure


def new_figure(
    width: float = style.FIGURE[0], height: float = style.FIGURE[1], color: str = style.PAPER
) -> Drawing:
    """Return an empty figure of width and height [in] in the format of today."""
    figure = Drawing(figsize=(width, height), dpi=current_format().dpi, facecolor=color)
    FigureCanvasAgg(figure)
    return figure


def new_axes(
    theme: style.Theme = style.LIGHT,
    larger: tuple[float, float] = style.USUAL,
    spans: Sequence[float] | Floats = style.AREA,
    margins: style.Margins = style.MARGINS,
) -> Axes:
    """Return empty axes below the title strip of a new figure.

    ``larger`` is how much larger than usual it is in width and height. What is drawn spans
    ``spans`` in both directions: on paper of a given width the height is what that needs.
    """
    sheet = current_format()
    width, height = (share * side for share, side in zip(larger, style.FIGURE, strict=True))
    if sheet.width is not None:
        width, k = sheet.width, min(max(sheet.share, style.SMALLEST), 1.0)
        left, right, below, above = margins
        room = 72 * width - 2 * style.EDGE - k * (left + right)
        tall = room * min(max(spans[1] / spans[0], FLATTEST), TALLEST) if spans[0] > 0 else room
        height = (tall + k * (below + above + style.STRIP) + style.EDGE + sheet.top) / 72
    elif not sheet.titled:
        height += (style.EDGE - style.TOP) / 72
    figure = new_figure(width, height, color=theme.paint(style.PAPER))
    edge = (style.EDGE / 72 / width, style.EDGE / 72 / height)
    top = sheet.top / 72 / height
    return figure.add_axes((edge[0], edge[1], 1 - 2 * edge[0], 1 - edge[1] - top))


def note(
    axes: Axes, text: str, place: tuple[float, float], offset: tuple[float, float], chosen: Font,
    color: str, **more: Any,
) -> None:  # fmt: skip
    """Write a text at a place of axes, `offset` from there [pt]."""
    look: Json = {"fontproperties": chosen.properties, "color": color, "annotation_clip": False}
    axes.annotate(text, place, offset, textcoords="offset points", **look, **more)


def grid(count: int) -> tuple[Figure, list[Axes]]:
    """Return a figure with so many empty axes, two or more in a row."""
    columns = min(max(2, -(-count // 3)), count)
    rows = -(-count // columns)
    width, height = (0.6 * side for side in style.FIGURE)
    figure = new_figure(columns * width, rows * height)
    top = style.TOP / 72 / height / rows
    places = [(k % columns, rows - 1 - k // columns) for k in range(count)]
    size = (0.96 / columns, 0.96 / rows - top)
    corners = [((x + 0.02) / columns, (y + 0.02) / rows) for x, y in places]
    return figure, [figure.add_axes((*corner, *size)) for corner in corners]


def save(picture: Axes | Figure, path: str | Path, text: bool = False) -> Path:
    """Write a picture as SVG, PNG or PDF, chosen by the ending of `path`.

    The bytes depend on the picture alone: no date, no random identifiers. The file is
    written under another name first, so that nothing half-written is left behind.
    With ``text`` the letters of an SVG are text, to be searched and edited, not outlines.

    Raises
    ------
    InputError
        An ending that is no known format.
    """
    target = Path(path)
    form = target.suffix.lower().lstrip(".")
    if form not in FORMATS:
        raise InputError(
            f"pictures are not written as '{target.suffix}'",
            where=str(path),
            hint=f"one of .{' .'.join(FORMATS)}",
        )
    with whole_file(target) as file, mpl.rc_context(SETTINGS):
        if form == "svg":
            file.write(svg_text(picture, text).encode())
        else:
            figure_of(picture).savefig(file, format=form, metadata=FORMATS[form])
    return target
