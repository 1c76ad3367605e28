"""How large texts are: by a table of letters, so that laying out a picture needs no matplotlib.

The table is written by ``docs/make_letters.py`` from the fonts that draw the letters; formulas
and letters that it does not have are measured by their outlines.
"""

from __future__ import annotations

import json
from collections.abc import Sequence
from dataclasses import replace
from functools import cache, lru_cache
from pathlib import Path
from typing import TYPE_CHECKING, Literal

import numpy as np

from mechdae.draw import style as styles
from mechdae.draw.primitives import Array
from mechdae.records import dataclass

if TYPE_CHECKING:
    from matplotlib.font_manager import FontProperties

INDEX = (0.7, 0.02, 0.15)
"""Size of an index, its step to the right and down, as shares of the letter's size."""
TABLE = Path(__file__).with_name("letters.json")
Slant = Literal["normal", "italic"]
Row = tuple[float, float, float, float, float]
"""Step to the next letter, and the corners of its ink, as shares of the size."""


@dataclass(frozen=True)
class Font:
    """Families of letters, the first that has one counts; ``size`` in units of the sheet."""

    size: float
    families: tuple[str, ...]
    style: Slant = "normal"

    def scaled(self, by: float) -> Font:
        """Return it in another size."""
        return replace(self, size=self.size * by)

    @property
    def properties(self) -> FontProperties:
        """What matplotlib calls it."""
        return _properties(self)


@lru_cache(maxsize=1024)
def _properties(font: Font) -> FontProperties:
    from matplotlib.font_manager import FontProperties

    families = list(font.families)
    return FontProperties(family=families, size=font.size, style=font.style, math_fontfamily="stix")


def font(size: float, families: Sequence[str] = styles.FONT, style: Slant = "normal") -> Font:
    """Return a font of that size in units."""
    return Font(size, tuple(families), style)


def plain(text: str) -> str:
    """Return words that may have dollar signs, which are no formula."""
    return text.replace("$", r"\$")


def face_of(font: Font) -> str:
    """Return what the letters of a font are called in the table."""
    return f"{font.families[0]} {font.style}"


@cache
def _faces() -> dict[str, dict[str, Row]]:
    faces: dict[str, dict[str, Row]] = json.loads(TABLE.read_text(encoding="utf-8"))
    return faces


@lru_cache(maxsize=4096)
def ink(text: str, font: Font, index: str = "") -> tuple[Array, Array]:
    """Return the corners of the ink of a text whose line starts at the origin."""
    if index:
        rows = [
            (ink(part, smaller), step) for part, smaller, step, _ in parts_of(text, font, index)
        ]
        low = np.min([box[0] + step for box, step in rows], axis=0)
        return low, np.max([box[1] + step for box, step in rows], axis=0)
    if not text.strip():
        return np.zeros(2), np.zeros(2)
    face = _faces().get(face_of(font), {})
    plain = text.replace(r"\$", "\0").replace("$", "\1").replace("\0", "$")
    if any(letter not in face for letter in plain):
        from mechdae.draw.artists import outline

        extents = outline(text, font.properties).get_extents()
        return np.array([extents.x0, extents.y0]), np.array([extents.x1, extents.y1])
    at = np.cumsum([0.0, *(face[letter][0] for letter in plain)])[:-1]
    boxes = [
        (x + face[letter][1], face[letter][2], x + face[letter][3], face[letter][4])
        for x, letter in zip(at, plain, strict=True) if letter.strip()
    ]  # fmt: skip
    corners = np.array(boxes) * font.size
    return corners[:, :2].min(axis=0), corners[:, 2:].max(axis=0)


def width_of(text: str, font: Font) -> float:
    """Return how far a text reaches to the right."""
    return max(float(ink(text, font)[1][0]), 0.0)


def parts_of(
    text: str, font: Font, index: str, gid: str | None = None
) -> list[tuple[str, Font, Array, str | None]]:
    """Return a text and its upright index: what, how, where from the start, name."""
    parts: list[tuple[str, Font, Array, str | None]] = [(text, font, np.zeros(2), gid)]
    if index:
        small = replace(font.scaled(INDEX[0]), style="normal")
        step = np.array([float(ink(text, font)[1][0]), 0.0])
        parts.append((index, small, step + np.array([INDEX[1], -INDEX[2]]) * font.size, None))
    return parts
