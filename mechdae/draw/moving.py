"""Animations as one SVG without scripts, and as MP4 or WebM where ffmpeg is installed."""

from __future__ import annotations

import shutil
import subprocess
import zlib
from collections.abc import Callable, Iterator, Sequence
from pathlib import Path as FilePath
from typing import Any

from matplotlib.font_manager import findfont, get_font
from matplotlib.path import Path
from matplotlib.textpath import text_to_path

from mechdae.draw import style
from mechdae.draw.primitives import Primitive, path_of
from mechdae.draw.sheet import Sheet
from mechdae.errors import UnavailableError

SVG, XLINK = "http://www.w3.org/2000/svg", "http://www.w3.org/1999/xlink"
VIDEOS = {
    "mp4": ("-c:v", "libx264", "-pix_fmt", "yuv420p", "-movflags", "+faststart"),
    "webm": ("-c:v", "libvpx-vp9", "-b:v", "0", "-crf", "30"),
}
"""Formats of films with what ffmpeg is told for them."""
LETTERS = {1: "M", 2: "L", 3: "Q", 4: "C"}
"""Codes of matplotlib's paths as those of SVG; areas are closed by themselves."""


def moving_svg(sheets: Sequence[Sheet], order: Sequence[int], duration: int) -> str:
    """Return sheets as one SVG that shows them in turn, for ever.

    What all frames have in common is written once: the parts of the drawing that stand still are
    in front of or behind those that move, as in the first frame.

    Parameters
    ----------
    sheets
        The drawing of each frame.
    order
        Which of them each frame shows.
    duration
        Time of a frame [ms].
    """
    glyphs: dict[str, str] = {}
    parts = [
        [_element(shape, sheet, glyphs) for shape in sorted(sheet.drawn, key=lambda shape: shape.z)]
        for sheet in sheets
    ]
    still = set(parts[0]).intersection(*parts[1:])
    total = duration * len(order) / 1000
    first = next((k for k, part in enumerate(parts[0]) if part not in still), len(parts[0]))
    lines = list(dict.fromkeys(parts[0][:first]))
    behind = set(lines)
    for k, frame in enumerate(parts):
        shown = [place for place, which in enumerate(order) if which == k]
        inner = "".join(part for part in frame if part not in still)
        lines.append(f'<g visibility="hidden">{_times(shown, len(order), total)}{inner}</g>')
    lines += [part for part in dict.fromkeys(parts[0][first:]) if part in still - behind]
    (width, height), theme = sheets[0].size, sheets[0].theme
    wide, high = width + 2 * style.EDGE, height + style.EDGE + style.TOP
    defs = "".join(glyphs.values())
    return (
        f'<svg xmlns="{SVG}" xmlns:xlink="{XLINK}" viewBox="0 0 {wide:g} {high:g}" '
        f'width="{wide:g}pt" height="{high:g}pt"><defs><clipPath id="box">'
        f'<rect y="{-height:g}" width="{width:g}" height="{height:g}"/></clipPath>{defs}</defs>\n'
        f'<rect width="{wide:g}" height="{high:g}" fill="{theme.paint(style.PAPER)}"/>\n'
        f'<g transform="translate({style.EDGE:g} {high - style.EDGE:g})" stroke-linejoin="round">\n'
        + "\n".join(lines)
        + "\n</g></svg>\n"
    )


def _element(shape: Primitive, sheet: Sheet, glyphs: dict[str, str]) -> str:
    """Return a primitive as an element; outlines of letters are defined once, in `glyphs`."""
    color, fill = sheet.theme.paint(shape.color), sheet.theme.paint(shape.fill)
    x, y = shape.points[0] * (1, -1)
    if shape.kind == "text":
        letters = "".join(
            f'<use xlink:href="#{name}" transform="translate({dx:.2f} {-dy:.2f}) scale({size:g})"/>'
            for name, dx, dy, size in _letters(shape, glyphs)
        )
        return f'<g transform="translate({x:.2f} {y:.2f})" fill="{color}">{letters}</g>'
    look = f'fill="{fill}" stroke="{color}" stroke-width="{shape.width:g}"'
    if shape.dash is not None:
        look += f' stroke-dasharray="{" ".join(f"{part:g}" for part in shape.dash[1])}"'
    elif shape.kind in ("line", "strokes"):
        look += ' stroke-linecap="round"'
    if (shape.points < 0).any() or (shape.points > sheet.size).any():
        look += ' clip-path="url(#box)"'
    if shape.kind == "circle":
        return f'<circle cx="{x:.2f}" cy="{y:.2f}" r="{shape.radius:.2f}" {look}/>'
    return f'<path d="{path_of(shape.kind, shape.points)}" {look}/>'


def _letters(shape: Primitive, glyphs: dict[str, str]) -> Iterator[tuple[str, float, float, float]]:
    """Yield name, place and scale of the letters of a text; outlines are put into `glyphs`."""
    face = get_font(findfont(shape.font.properties))
    face.set_size(text_to_path.FONT_SCALE, text_to_path.DPI)
    share = shape.font.size / text_to_path.FONT_SCALE
    places, outlines, _ = text_to_path.get_glyphs_with_font(face, shape.text.replace(r"\$", "$"))
    for (vertices, codes), (key, x, y, size) in ((outlines[place[0]], place) for place in places):
        name = f"g{zlib.crc32(key.encode()):x}"
        if name not in glyphs:
            pieces = Path(vertices, codes).iter_segments(simplify=False)
            d = "".join(
                LETTERS[int(code)] + " ".join(f"{u:.1f} {-v:.1f}" for u, v in ends.reshape(-1, 2))
                for ends, code in pieces
                if int(code) in LETTERS
            )
            glyphs[name] = f'<path id="{name}" d="{d}"/>'
        yield name, float(x) * share, float(y) * share, float(size) * share


def _times(shown: Sequence[int], count: int, total: float) -> str:
    """Return when a frame is seen, as an animation of its visibility."""
    values, times = ["visible" if 0 in shown else "hidden"], [0.0]
    for place in range(1, count):
        word = "visible" if place in shown else "hidden"
        if word != values[-1]:
            values.append(word)
            times.append(place / count)
    at = ";".join(f"{time:.6g}" for time in times)
    return (
        f'<animate attributeName="visibility" values="{";".join(values)}" keyTimes="{at}" '
        f'dur="{total:g}s" calcMode="discrete" repeatCount="indefinite"/>'
    )


def film(made: Callable[[], Sequence[Any]], duration: int, form: str, path: FilePath) -> None:
    """Write pictures of one size as a film with ffmpeg, whole or not at all.

    They are `made` when it is known that there is a program to write them.

    Raises
    ------
    UnavailableError
        ffmpeg is not installed, or cannot write this format.
    """
    program = shutil.which("ffmpeg")
    if program is None:
        raise UnavailableError(
            f"an animation as .{form} needs ffmpeg, which is not installed",
            where=str(path),
            hint="install ffmpeg, or write .svg or .gif, which need nothing",
        )
    frames = made()
    width, height = (side - side % 2 for side in frames[0].size)
    partial = path.with_name(f".{path.name}.part.{form}")
    words = [program, "-y", "-loglevel", "error", "-f", "rawvideo", "-pix_fmt", "rgb24"]
    words += ["-s", f"{width}x{height}", "-r", f"{1000 / duration:g}", "-i", "-"]
    pixels = b"".join(
        frame.convert("RGB").crop((0, 0, width, height)).tobytes() for frame in frames
    )
    try:
        done = subprocess.run(
            [*words, *VIDEOS[form], str(partial)], input=pixels, capture_output=True, check=False
        )
        if done.returncode:
            said = done.stderr.decode(errors="replace").strip().splitlines() or ["no reason given"]
            raise UnavailableError(f"ffmpeg wrote no .{form}: {said[-1]}", where=str(path))
        partial.replace(path)
    finally:
        partial.unlink(missing_ok=True)
