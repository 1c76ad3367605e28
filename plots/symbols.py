"""Every symbol of the kinematic diagram on one page, with what it means."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import numpy as np
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure

from mechdae.draw import save, style
from mechdae.draw.diagram import symbols
from mechdae.draw.fonts import font, ink
from mechdae.draw.sheet import Sheet, arc

COLUMNS, CELL = 4, (117.0, 104.0)
X, Y = np.array([1.0, 0.0]), np.array([0.0, 1.0])
Draw = Callable[[Sheet, np.ndarray], None]


def at(place: np.ndarray, x: float, y: float) -> np.ndarray:
    """Return a place shifted by x to the right and y up."""
    shifted: np.ndarray = place + np.array([x, y])
    return shifted


def bar(sheet: Sheet, start: np.ndarray, end: np.ndarray, color: str = style.INK) -> None:
    """Draw the line of a link."""
    sheet.line([start, end], color=color, width=style.BAR, z=style.Z_BAR)


def turning(sheet: Sheet, c: np.ndarray) -> None:
    bar(sheet, c, at(c, -34, -16))
    bar(sheet, c, at(c, 36, -12))
    symbols.pin(sheet, c, "pin")


def fixed(sheet: Sheet, c: np.ndarray) -> None:
    bar(sheet, c, at(c, 34, 18))
    symbols.support(sheet, c, "support")
    symbols.pin(sheet, c, "fixed-pin")


def triple(sheet: Sheet, c: np.ndarray) -> None:
    for way in ((-32, -14), (32, -14), (4, 30)):
        bar(sheet, c, c + way)
    symbols.pin(sheet, c, "triple-pin")


def past(sheet: Sheet, c: np.ndarray) -> None:
    bar(sheet, c - 40 * X, c - 2.1 * style.PIN * X)
    bar(sheet, c + 40 * X, c + 2.1 * style.PIN * X)
    bar(sheet, c, c - 28 * Y)
    symbols.bridge(sheet, c, X, Y, "bridge", style.INK)
    symbols.pin(sheet, c, "bridged-pin")


def polygon(sheet: Sheet, c: np.ndarray) -> None:
    corners = np.array([at(c, -36, -18), at(c, 34, -20), at(c, 8, 26)])
    sheet.area(corners, fill=style.FILL, edge="none", width=0, z=style.Z_FILL)
    for k, spot in enumerate(corners):
        arms = (corners[k - 1] - spot, corners[(k + 1) % 3] - spot)
        symbols.corner(sheet, spot, arms, None)
        bar(sheet, spot, corners[(k + 1) % 3])
        symbols.pin(sheet, spot, "polygon-pin")


def weld(sheet: Sheet, c: np.ndarray) -> None:
    bar(sheet, c - 36 * X, c)
    bar(sheet, c, at(c, 20, 30))
    symbols.weld(sheet, c, (-36 * X, np.array([20.0, 30.0])), "weld")


def slider(sheet: Sheet, c: np.ndarray) -> None:
    shift = style.BLOCK[1] * Y
    symbols.hatch(sheet, c - 42 * X - shift, c + 42 * X - shift, -Y)
    symbols.block(sheet, c, X, "block")
    bar(sheet, c, at(c, -30, 30))
    symbols.pin(sheet, c, "block-pin")


def moving_guide(sheet: Sheet, c: np.ndarray) -> None:
    along = np.array([np.cos(0.4), np.sin(0.4)])
    for sign in (-1, 1):
        bar(sheet, c + sign * style.BLOCK[0] * along, c + sign * 42 * along)
    symbols.block(sheet, c, along, "moving-block")
    bar(sheet, c, at(c, 10, -30))
    symbols.pin(sheet, c, "moving-block-pin")


def slot(sheet: Sheet, c: np.ndarray) -> None:
    bar(sheet, c - 52 * X, c - (26 + style.SLOT) * X)
    symbols.slot(sheet, c - 26 * X, c + 26 * X, "slot")
    bar(sheet, c + 8 * X, at(c, 22, -30))
    symbols.pin(sheet, c + 8 * X, "slot-pin")


def distance(sheet: Sheet, c: np.ndarray) -> None:
    a, b = at(c, -36, -12), at(c, 36, 12)
    sheet.line([a, b], width=style.LINE, dash=style.DASHED, z=style.Z_BAR)
    symbols.pin(sheet, a, "distance-pin")
    symbols.pin(sheet, b, "distance-pin")


def wheel(
    sheet: Sheet, c: np.ndarray, radius: float, angle: float, color: str, teeth: bool = True
) -> None:
    """Draw a wheel with its spoke."""
    (symbols.pitch_circle if teeth else symbols.rim)(sheet, c, radius, "gear", color)
    end = c + radius * np.array([np.cos(angle), np.sin(angle)])
    sheet.line([c, end], color=color, width=style.THIN, z=style.Z_MARK)
    symbols.dot(sheet, end, "spoke", color)


def gears(sheet: Sheet, c: np.ndarray) -> None:
    for x, radius, angle in ((-20, 24, 2.2), (19, 15, 0.8)):
        wheel(sheet, c + x * X, radius, angle, style.WHEEL)
        symbols.pin(sheet, c + x * X, "gear-pin")


def ring(sheet: Sheet, c: np.ndarray) -> None:
    symbols.pitch_circle(sheet, c, 34, "ring", style.WHEEL)
    symbols.fixed_rim(sheet, c, 34, 1.0)
    wheel(sheet, c + 22 * X, 12, 2.0, style.WHEEL)
    bar(sheet, c, c + 22 * X)
    symbols.pin(sheet, c, "ring-pin")
    symbols.pin(sheet, c + 22 * X, "planet-pin")


def rack(sheet: Sheet, c: np.ndarray) -> None:
    wheel(sheet, c + 8 * Y, 20, 0.9, style.WHEEL)
    symbols.pin(sheet, c + 8 * Y, "rack-pin")
    symbols.toothed_line(sheet, at(c, -44, -12), at(c, 44, -12), -Y, "rack")


def belt(sheet: Sheet, c: np.ndarray) -> None:
    a, b, r1, r2 = c - 26 * X, c + 28 * X, 20.0, 11.0
    sine = (r1 - r2) / 54.0
    for sign in (1, -1):
        out = np.array([sine, sign * np.sqrt(1 - sine**2)])
        sheet.line([a + r1 * out, b + r2 * out])
    for middle, radius in ((a, r1), (b, r2)):
        symbols.rim(sheet, middle, radius, "pulley")
        symbols.pin(sheet, middle, "pulley-pin")


def friction_wheels(sheet: Sheet, c: np.ndarray) -> None:
    for middle, radius, angle in ((c - 15 * X, 20.0, 0.9), (c + 18 * X, 13.0, 2.4)):
        wheel(sheet, middle, radius, angle, style.WHEEL, teeth=False)
        symbols.pin(sheet, middle, "wheel-pin")


def cam(sheet: Sheet, c: np.ndarray) -> None:
    angles = np.linspace(0, 2 * np.pi, 121)
    radii = 21 + 8 * np.cos(angles - 1.2)
    rim = c - 16 * Y + radii[:, None] * np.stack([np.cos(angles), np.sin(angles)], -1)
    sheet.area(rim[:-1], fill=style.FILL, edge="none", width=0, z=style.Z_FILL)
    sheet.line(rim, width=style.BAR, z=style.Z_FILL)
    symbols.pin(sheet, c - 16 * Y, "cam-pin")
    top = np.array([c[0] + 6, rim[:, 1].max() + 7.5])
    bar(sheet, top, top + 16 * Y)
    sheet.circle(top, 7.5, fill=style.PAPER, z=style.Z_BLOCK)
    symbols.pin(sheet, top, "roller")


def groove(sheet: Sheet, c: np.ndarray) -> None:
    points = arc(c - 40 * Y, 52, 0.75, np.pi - 0.75, 40)
    symbols.groove(sheet, points, "groove")
    symbols.pin(sheet, points[26], "groove-pin")


def driver(sheet: Sheet, c: np.ndarray) -> None:
    bar(sheet, c, at(c, 38, 10), style.DRIVEN)
    symbols.support(sheet, c, "driver-support")
    symbols.pin(sheet, c, "driver-pin")
    symbols.arrow(sheet, arc(c, style.ARC, 0.6, 2.0), "driver")


def ram(sheet: Sheet, c: np.ndarray) -> None:
    slider(sheet, c)
    symbols.arrow(sheet, np.array([at(c, 4, 20), at(c, 40, 20)]), "ram")


def force(sheet: Sheet, c: np.ndarray) -> None:
    bar(sheet, at(c, -40, -14), c)
    symbols.dot(sheet, c, "force-point")
    symbols.arrow(sheet, np.array([at(c, 4, 2), at(c, 38, 19)]), "force", style.LOAD)
    write(sheet, at(c, 34, 2), "F", style.LOAD)


def torque(sheet: Sheet, c: np.ndarray) -> None:
    fixed(sheet, c)
    symbols.arrow(sheet, arc(c, 27, 2.6, 1.1), "torque", style.LOAD)
    write(sheet, at(c, -28, 22), "M", style.LOAD)


def spring(sheet: Sheet, c: np.ndarray) -> None:
    symbols.spring(sheet, c - 40 * X, c + 40 * X, "spring")
    for sign in (-1, 1):
        symbols.pin(sheet, c + sign * 40 * X, "spring-pin")


def damper(sheet: Sheet, c: np.ndarray) -> None:
    symbols.damper(sheet, c - 40 * X, c + 40 * X, "damper")
    for sign in (-1, 1):
        symbols.pin(sheet, c + sign * 40 * X, "damper-pin")


def torsion(sheet: Sheet, c: np.ndarray) -> None:
    for x in (-24, 26):
        fixed(sheet, c + x * X)
    symbols.spiral(sheet, c - 24 * X, "spiral")
    symbols.brake(sheet, c + 26 * X, np.deg2rad(135.0), "brake")


def mass(sheet: Sheet, c: np.ndarray) -> None:
    bar(sheet, at(c, -44, -8), at(c, 20, 12))
    symbols.mass_center(sheet, at(c, -12, 2), "mass")
    symbols.arrow(sheet, np.array([at(c, 40, 18), at(c, 40, -8)]), "gravity", style.FAINT)
    write(sheet, at(c, 48, 6), "g", style.FAINT)


def marks(sheet: Sheet, c: np.ndarray) -> None:
    bar(sheet, at(c, -40, -10), at(c, 36, 10))
    symbols.pin(sheet, at(c, -40, -10), "label-pin")
    symbols.dot(sheet, at(c, 36, 10), "label-dot")
    write(sheet, at(c, -40, 6), r"$\mathit{A}$", style.INK, style.LETTER)
    write(sheet, at(c, 36, 24), r"$\mathit{P}$", style.INK, style.LETTER)
    sheet.circle(at(c, 2, 14), style.DISC, fill=style.PAPER, width=style.THIN, z=style.Z_LABEL)
    write(sheet, at(c, 2, 14), "2", style.INK)


def trace(sheet: Sheet, c: np.ndarray) -> None:
    sheet.line(arc(c, 30, 0.5, 5.2), color=style.TRACE, width=style.THIN, z=style.Z_TRACE)
    for angle in (1.9, 2.6):
        end = c + 30 * np.array([np.cos(angle), np.sin(angle)])
        sheet.line([c, end], color=style.GHOST, z=style.Z_GHOST)
    bar(sheet, c, at(c, 24, 18))
    symbols.pin(sheet, c, "trace-pin")
    symbols.dot(sheet, at(c, 24, 18), "trace-dot")


def held(sheet: Sheet, c: np.ndarray) -> None:
    pivot, along = at(c, -30, -6), np.array([np.cos(0.35), np.sin(0.35)])
    bar(sheet, pivot, pivot + 66 * along)
    symbols.support(sheet, pivot, "held-support")
    symbols.pin(sheet, pivot, "held-pin")
    symbols.jaws(sheet, pivot + style.GRIP * along, along, "held")


def held_wheel(sheet: Sheet, c: np.ndarray) -> None:
    symbols.pitch_circle(sheet, c, 22.0, "held-wheel")
    symbols.support(sheet, c, "held-wheel-support")
    symbols.pin(sheet, c, "held-wheel-pin")
    symbols.shoe(sheet, c, 22.0, "shoe")


def cylinder(sheet: Sheet, c: np.ndarray) -> None:
    eye, tip = at(c, -40, -12), at(c, 40, 16)
    along = (tip - eye) / np.hypot(*(tip - eye))
    back, mouth, piston = (eye + reach * along for reach in (style.BARREL, 54.0, 36.0))
    symbols.barrel(sheet, eye, back, mouth, "cylinder")
    symbols.piston(sheet, piston, along, "cylinder", style.DRIVEN)
    bar(sheet, piston, tip, style.DRIVEN)
    symbols.support(sheet, eye, "cylinder-support")
    symbols.pin(sheet, eye, "cylinder-pin")
    symbols.pin(sheet, tip, "cylinder-tip")


CELLS: dict[str, Draw] = {
    "turning pair": turning,
    "turning pair\nin the ground": fixed,
    "three links on one pin\n(two joints)": triple,
    "link runs past the pin\nwithout a break": past,
    "rigid link\nwith three joints": polygon,
    "rigid connection (weld)": weld,
    "block with a pin\non a fixed guide": slider,
    "block on a moving guide": moving_guide,
    "pin in slot": slot,
    "distance\n(bar without mass)": distance,
    "external mesh:\ntwo pitch circles": gears,
    "carrier, planet and\na fixed ring": ring,
    "rack and pinion": rack,
    "belt on two pulleys": belt,
    "friction wheels:\ntwo rims, touching": friction_wheels,
    "cam and roller": cam,
    "pin in a curved groove": groove,
    "driver that turns": driver,
    "driver that travels": ram,
    "driver that is held": held,
    "wheel that is held": held_wheel,
    "driven cylinder": cylinder,
    "force": force,
    "torque, resistance\nto turning": torque,
    "spring": spring,
    "damper": damper,
    "torsion spring and\ndamper at a pin": torsion,
    "centre of mass; gravity": mass,
    "joint letter, link number,\npoint without a joint": marks,
    "path of a point\nand other poses": trace,
}


def write(
    sheet: Sheet, center: np.ndarray, text: str, color: str, size: float = style.NUMBER
) -> None:
    """Write with the middle at a place."""
    chosen = font(size, style.FONT if size == style.LETTER else style.NOTE_FONT)
    sheet.text(np.asarray(center, dtype=float), text, chosen, color)


def figure() -> Figure:
    """Return the figure."""
    rows = -(-len(CELLS) // COLUMNS)
    width, height = COLUMNS * CELL[0] + 20, rows * CELL[1] + 46
    drawn = Figure(figsize=(width / 72, height / 72), dpi=style.DPI, facecolor=style.PAPER)
    FigureCanvasAgg(drawn)
    axes = drawn.add_axes((0, 0, 1, 1))
    sheet = Sheet(axes, (0.0, 0.0), (1.0, 1.0))
    chosen = font(style.TITLE, style.NOTE_FONT)
    title = "Symbols of kinematic diagrams, after ISO 3952 and GOST 2.770"
    low, high = ink(title, chosen)
    middle = np.array([14.0 + float((high - low)[0]) / 2, height - 24.0])
    sheet.text(middle, title, chosen, style.INK)
    for number, (text, draw) in enumerate(CELLS.items()):
        row, column = divmod(number, COLUMNS)
        center = np.array([10 + (column + 0.5) * CELL[0], height - 46 - (row + 0.42) * CELL[1]])
        draw(sheet, center)
        for line, words in enumerate(text.split("\n")):
            write(sheet, center - (0, 45 + 11 * line), words, style.FAINT, 8.5)
    return drawn


if __name__ == "__main__":
    save(figure(), Path(__file__).with_suffix(".svg"))
