"""Small pictures of mechanisms, which stand still and move: their colours are those of the page."""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path as FilePath
from typing import Any

import numpy as np
from matplotlib.path import Path

import mechdae as md
from mechdae.draw import style
from mechdae.draw.animation import SVG, XLINK, Animation, moving_svg
from mechdae.draw.primitives import Primitive
from mechdae.draw.sheet import ASIDE, Sheet
from mechdae.errors import InputError

FRAMES, SECONDS, EDGE = 24, 3.0, 14.0
HEAVY = 120_000
"""Pictures of more bytes stand still."""
MANY, SEEN = 12, 0.6
"""Lines of more points lose those that are nearer to the rest of them than so many units."""
NAMES = ("INK", "PAPER", "DRIVEN", "ARROW", "FILL", "WHEEL", "TRACE", "GHOST", "GROUND", "LOAD",
         "FAINT")  # fmt: skip
COLOURS = {getattr(style, name): f"--{name.lower()}" for name in NAMES}
VARIABLES = style.Theme({colour: f"var({name})" for colour, name in COLOURS.items()})


def _values(theme: style.Theme) -> str:
    return "".join(f"{name}:{theme.paint(colour)};" for colour, name in COLOURS.items())


LOOK = (
    f"<style>:root{{{_values(style.LIGHT)}}}"
    f"@media(prefers-color-scheme:dark){{:root{{{_values(style.DARK)}}}}}</style>"
)
"""Colours by the scheme of the page that shows the picture."""


def write(result: Any, still: FilePath) -> bool:
    """Write a picture, and beside it one that moves; return whether there is one that does."""
    plain = {"labels": False, "loads": False}
    try:
        film = md.plot(result, "animation", frames=FRAMES, seconds=SECONDS, **plain)
    except InputError:  # fewer than two poses
        good = [k for k, status in enumerate(result.status) if status in ("ok", "limit")]
        film = Animation(result, tuple((good or [0])[:1]), False, 1000, **plain)
    poses = list(dict.fromkeys(film.poses))
    sheets = list(film.drawn(poses))
    for sheet in sheets:
        sheet.theme = VARIABLES
        sheet.drawn[:] = [replace(one, points=_coarse(one)) for one in sheet.drawn if _shown(one)]
    box = _box(sheets)
    still.write_text(_cropped(moving_svg(sheets[:1], [0], 1000), box), encoding="utf-8")
    if len(poses) == 1:
        return False
    text = moving_svg(sheets, [poses.index(pose) for pose in film.poses], film.duration)
    text = _cropped(text, box)
    if len(text) < HEAVY:
        still.with_name(f"{still.stem}-moves.svg").write_text(text, encoding="utf-8")
    return len(text) < HEAVY


def _shown(shape: Primitive) -> bool:
    """Return whether a shape is of the mechanism, not a text, a scale, an axis or its head."""
    aside = str(shape.gid).startswith(ASIDE) or shape.fill == style.FAINT
    return shape.kind != "text" and not aside


def _coarse(shape: Primitive) -> Any:
    """Return the points of a shape that are seen in a small picture."""
    if shape.kind not in ("line", "area") or len(shape.points) < MANY:
        return shape.points
    path = Path(shape.points)
    path.simplify_threshold = SEEN
    seen = path.cleaned(simplify=True).vertices[:-1]
    return seen if len(seen) > 1 else shape.points


def _box(sheets: Sequence[Sheet]) -> list[float]:
    """Return left, top, width and height of what is drawn, in an SVG of the sheets."""
    rows = [
        shape.points + side * shape.radius
        for sheet in sheets for shape in sheet.drawn for side in (-1, 1)
    ]  # fmt: skip
    ends = np.vstack(rows)
    low, high = np.clip([ends.min(axis=0), ends.max(axis=0)], 0, sheets[0].size)
    left, top = low[0] + style.EDGE, sheets[0].size[1] + style.TOP - high[1]
    return [left - EDGE, top - EDGE, *(high - low + 2 * EDGE)]


def _cropped(text: str, box: Sequence[float]) -> str:
    """Return a picture with nothing around the mechanism, in the colours of the page."""
    head = f'<svg xmlns="{SVG}" viewBox="{" ".join(f"{side:.0f}" for side in box)}">{LOOK}'
    text = re.sub(r"<svg[^>]*?>", lambda _: head.replace(">", f' xmlns:xlink="{XLINK}">', 1), text)
    text = re.sub(r'\n<rect width="[^"]*" height="[^"]*" fill="[^"]*"/>', "", text)
    return re.sub(r"(\.\d)\d+", r"\1", text)
