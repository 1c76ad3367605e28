"""Colours and sizes of all pictures.

Colours are from the palette of Okabe and Ito, which colour-blind readers tell apart; no
meaning rests on colour alone. Lengths are in units of the sheet (`mechdae.draw.sheet`):
one unit is a point (1/72 in) on a picture of 7 x 5 in and grows with the picture.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import field
from types import MappingProxyType
from typing import Any, Final

from mechdae.records import dataclass

INK: Final = "#1c2733"
PAPER: Final = "#ffffff"
DRIVEN: Final = "#0072b2"
"""Link whose motion is given."""
ARROW: Final = "#d55e00"
"""Arrow of the driver."""
FILL: Final = "#e3ebf3"
"""Inside of rigid polygons."""
WHEEL: Final = "#007a5a"
TRACE: Final = "#2b93cc"
"""Paths: what is drawn has a contrast of 3 to 1 to its paper, but for ghosts."""
GHOST: Final = "#d3d7db"
GROUND: Final = "#4b5661"
LOAD: Final = "#9c3a78"
"""Arrows of forces and torques, springs and dampers."""
FAINT: Final = "#5f6b76"
"""Notes, scale bar and subtitle."""
VARIED: Final = (INK, DRIVEN, WHEEL, TRACE)
"""What has the colour of its variant where several share one picture."""
DRAWN: Final = (INK, DRIVEN, ARROW, WHEEL, TRACE, GHOST, GROUND, LOAD, FAINT)
"""What lines and letters are drawn in."""

SERIES: Final = ("#0072b2", "#d55e00", "#007a5a", "#8a4f7d", "#b07700", "#2b8cbe", "#5f6b76")
"""Curves of one panel, in this order; the dashes tell them apart without colour."""
DASHES: Final = (
    None,
    (0.0, (7.0, 2.0)),
    (0.0, (7.0, 2.0, 1.5, 2.0)),
    (0.0, (3.0, 1.5)),
    (0.0, (7.0, 2.0, 1.5, 2.0, 1.5, 2.0)),
    (0.0, (12.0, 3.0)),
    (0.0, (1.5, 1.5)),
)


def color_of(k: int) -> str:
    """Return the colour of a curve, a variant or a design by its number."""
    return SERIES[k % len(SERIES)]


def line_of(k: int) -> dict[str, Any]:
    """Return colour and dashes of a curve by its number."""
    return {"color": color_of(k), "linestyle": DASHES[k % len(DASHES)] or "-"}


DOTTED: Final = (0.0, (1.2, 1.6))
"""Curves without friction, beside the one with it."""
ARCS: Final = {
    "unassembled": ("#e4e7ea", "#a9b1b8", "////"),
    "singular": ("#dcd6e2", "#9a86ab", "xxxx"),
    "jammed": ("#f9dccb", "#e08a55", "\\\\\\\\"),
    "ambiguous": ("#fbf0c9", "#c9a534", "...."),
    "stopped": ("#ece3d8", "#b09a80", "//"),
    "self-locking": ("#d6ebf8", "#6fb2da", "----"),
    "no value": ("#f1f1f1", "#b9b9b9", "\\\\//"),
    "roller undercuts": ("#d4ebe3", "#5fae95", "||||"),
}
"""Shades of arcs: area, hatching, pattern."""
LEVELS: Final = ("#f3f7fb", "#c3dcef", "#7fb8dd", "#3a86bd", "#12537f")
"""Values of a map from low to high: darker with each step, so they read without colour."""
GRAPH: Final = 504.0
"""Width of a new graph [pt]."""
TICK: Final = 8.0
"""Size of numbers on axes and of labels of curves."""

FIGURE: Final = (7.0, 5.0)
"""Size of a new figure [in]."""
DPI: Final = 100
TOP: Final = 46.0
"""Strip above the axes that holds title and subtitle [pt]."""
EDGE: Final = 8.0
"""Free border of the figure [pt]."""
AREA: Final = (488.0, 306.0)
"""Axes of a new figure [pt]: one unit of the sheet is one point in axes of this size."""
PAGE: Final = (1.0, 1.3)
"""How much larger the diagram of a page is, on most screens."""
APART: Final = 27.0
"""Where many joints are nearer to each other than that, a new figure is larger,"""
CROWD: Final = 12
"""if there are so many,"""
LARGEST: Final = 2.0
"""up to so many times."""
USUAL: Final = (1.0, 1.0)
STRIP: Final = 22.0
"""Strip below the diagram that holds scale bar and note."""
MARGIN: Final = 34.0
"""Room around the geometry for symbols and labels."""

Margins = tuple[float, float, float, float]
MARGINS: Final[Margins] = (MARGIN, MARGIN, MARGIN, MARGIN)

BAR: Final = 2.4
"""Width of the lines of links."""
LINE: Final = 1.2
"""Width of the lines of symbols."""
THIN: Final = 0.8
DASH_DOT: Final = (0.0, (9.0, 2.5, 1.5, 2.5))
DASHED: Final = (0.0, (4.0, 2.5))

PIN: Final = 3.8
"""Radius of a pin."""
DOT: Final = 2.3
"""Radius of a point that is no joint."""
BLOCK: Final = (13.0, 7.0)
"""Half length and half height of a block."""
SLOT: Final = 6.4
"""Half width of a slot."""
SUPPORT: Final = (8.5, 13.5)
"""Half width and height of the triangle under a fixed pin."""
HATCH: Final = 5.0
"""Spacing of hatching lines."""
ARC: Final = 19.0
"""Radius of the driver's curved arrow."""
JAW: Final = 13.0
"""Length of the jaws that hold a link."""
BARREL: Final = 14.0
"""How far from its pin the barrel of a cylinder begins."""
GRIP: Final = 24.0
"""How far from its pin a link is held."""
PULL: Final = (16.0, 40.0)
"""Least and greatest length of the arrow of a force."""
COIL: Final = 5.0
"""Half width of a spring."""
POT: Final = (9.0, 4.5)
"""Half length and half width of a damper's cylinder."""
SPREAD: Final = 5.5
"""A spring and a damper in parallel are so far from the line between their points."""

FONT: Final = ["STIXGeneral", "DejaVu Serif"]
NOTE_FONT: Final = ["DejaVu Sans"]
LEAST: Final = 6.0
"""Size of the smallest letters on paper [pt]."""
SMALLEST: Final = 0.75
"""Least scale of symbols and letters in small pictures: notes have that size then."""
LETTER: Final = 14.0
NUMBER: Final = 9.0
LOAD_TEXT: Final = 9.0
DISC: Final = 7.2
"""Radius of the circle around a link's number."""
TITLE: Final = 12.0
SUBTITLE: Final = 9.0
NOTE: Final = 8.0

SOLID, RING, PATH, SHADE = 24.0, 12.0, 1.5, 0.5
"""How strongly labels keep off links and symbols, pitch circles, paths, and ghosts."""

Z_TRACE, Z_GHOST, Z_FILL, Z_GROUND, Z_BLOCK, Z_BAR, Z_MARK, Z_PIN, Z_LABEL = range(1, 10)
"""Order of drawing, later above earlier."""
Z_SLID: Final = Z_BLOCK - 0.5
"""Bars of links with guides and blocks: these hide them."""


@dataclass(frozen=True)
class Theme:
    """What the colours above become on a background.

    Parameters
    ----------
    colours
        Colour of this module -> colour drawn; others are drawn as they are.
    """

    colours: Mapping[str, str] = field(default_factory=lambda: MappingProxyType({}))

    def paint(self, color: str) -> str:
        """Return the colour that is drawn for one of this module."""
        return self.colours.get(color, color)


LIGHT: Final = Theme()
DARK: Final = Theme(
    MappingProxyType(
        {
            INK: "#e8edf2",
            PAPER: "#12181e",
            DRIVEN: "#56b4e9",
            ARROW: "#ff9a4d",
            FILL: "#26323d",
            WHEEL: "#2fd0a0",
            TRACE: "#3b8fc4",
            GHOST: "#3a444e",
            GROUND: "#aab4be",
            LOAD: "#e79bcb",
            FAINT: "#98a4b0",
        }
    )
)
"""Bright colours of the same hues on dark paper, lighter than it by much the same contrast."""
