"""The writer of matplotlib: primitives as artists."""

from __future__ import annotations

from functools import lru_cache
from typing import Any, Protocol

import matplotlib as mpl
import numpy as np
from matplotlib.artist import Artist
from matplotlib.backend_bases import RendererBase
from matplotlib.colors import to_rgba
from matplotlib.font_manager import FontProperties
from matplotlib.lines import Line2D
from matplotlib.patches import Circle, PathPatch, Polygon
from matplotlib.path import Path
from matplotlib.text import Text
from matplotlib.textpath import TextPath
from matplotlib.transforms import Affine2D
from numpy.typing import ArrayLike

from mechdae.draw import style
from mechdae.draw.primitives import Array, Primitive
from mechdae.types import Json


class _Shared:
    """An artist with the clip box of its axes: to make one for each takes longer than to draw."""

    def set_clip_path(self: Any, path: Any, transform: object = None) -> None:
        """Clip by a path, or by the box of the axes if it is theirs."""
        if self.axes is not None and path is self.axes.patch:
            self.set_clip_box(self.axes.bbox)
        else:
            super().set_clip_path(path, transform)  # type: ignore[misc]


class _Line(_Shared, Line2D):
    pass


class _Area(_Shared, Polygon):
    pass


class _Circle(_Shared, Circle):
    pass


class _Strokes(_Shared, PathPatch):
    pass


class _Text(_Shared, Text):
    pass


class _Letters(_Text):
    """A short text, in SVG files the outlines its place was found with: found once, not twice."""

    def draw(self, renderer: RendererBase) -> None:
        """Draw the outlines in files that have outlines of texts anyway, else the text."""
        figure = self.get_figure(root=True)
        assert figure is not None
        outlined = figure.canvas.get_default_filetype() == "svg"
        outlined &= mpl.rcParams["svg.fonttype"] == "path" and not self.get_rotation()
        sides = self.get_horizontalalignment(), self.get_verticalalignment()
        if not outlined or sides != ("left", "baseline"):
            super().draw(renderer)
        elif self.get_visible():
            gc = renderer.new_gc()
            gc.set_linewidth(0.0)
            place = self.get_transform().transform(self.get_position())
            renderer.open_group("text", self.get_gid())
            letters = outline(self.get_text(), self.get_fontproperties())
            color = to_rgba(self.get_color(), self.get_alpha())
            renderer.draw_path(gc, letters, Affine2D().translate(*place), color)
            renderer.close_group("text")
            gc.restore()


class ScaledSheet(Protocol):
    """What is asked of a sheet: points to the unit, units to the metre, colours, places [m]."""

    k: float
    metre: float
    theme: style.Theme

    @property
    def ax(self) -> Any:
        """The axes that are drawn on."""
        ...

    def back(self, position: ArrayLike) -> Array:
        """Return positions [m] of positions on the sheet."""
        ...


def artist_of(sheet: ScaledSheet, shape: Primitive) -> Artist:
    """Return a primitive of a sheet for its axes, in metres."""
    data, color = sheet.back(shape.points), sheet.theme.paint(shape.color)
    look: Json = {"linewidth": shape.width * sheet.k}
    if shape.kind in ("line", "circle"):
        look["linestyle"] = shape.dash or "-"
    made: Artist
    if shape.kind == "line":
        made = _Line(
            data[:, 0], data[:, 1], color=color, solid_capstyle="round",
            solid_joinstyle="round", dash_capstyle="butt", **look,
        )  # fmt: skip
    elif shape.kind == "strokes":
        codes = np.tile(np.array([Path.MOVETO, Path.LINETO], dtype=Path.code_type), len(data) // 2)
        path = Path(data, codes)
        made = _Strokes(path, facecolor="none", edgecolor=color, capstyle="round", **look)
    elif shape.kind == "text":
        scaled = shape.font.scaled(sheet.k).properties
        kind = _Letters if shape.short else _Text
        x, y = data[0].tolist()
        made = kind(x, y, shape.text, fontproperties=scaled, color=color, clip_on=False)
    else:
        look |= {"facecolor": sheet.theme.paint(shape.fill), "edgecolor": color}
        if shape.kind == "area":
            made = _Area(data, closed=True, joinstyle="round", **look)
        else:
            made = _Circle(tuple(data[0]), shape.radius / sheet.metre, **look)
    made.zorder = shape.z  # without the call for changes: nobody listens yet
    made.set_gid(shape.gid)
    if shape.clip is not None:
        middle = sheet.back(shape.clip[:2])
        circle = Circle((float(middle[0]), float(middle[1])), shape.clip[2] / sheet.metre)
        circle.set_transform(sheet.ax.transData)
        made.set_clip_path(circle)
    return made


@lru_cache(maxsize=1024)
def outline(text: str, font: FontProperties) -> Path:
    """Return the outlines of a text whose line starts at the origin."""
    return TextPath((0.0, 0.0), text, prop=font)
