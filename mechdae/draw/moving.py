"""Animations as one SVG without scripts, and as MP4 or WebM where ffmpeg is installed."""

from __future__ import annotations

import io
import re
import shutil
import subprocess
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any
from xml.etree import ElementTree as Tree

import matplotlib as mpl

from mechdae.draw.figure import FORMATS, SETTINGS
from mechdae.errors import UnavailableError

SVG, XLINK = "http://www.w3.org/2000/svg", "http://www.w3.org/1999/xlink"
VIDEOS = {
    "mp4": ("-c:v", "libx264", "-pix_fmt", "yuv420p", "-movflags", "+faststart"),
    "webm": ("-c:v", "libvpx-vp9", "-b:v", "0", "-crf", "30"),
}
"""Formats of films with what ffmpeg is told for them."""
CORNERS = re.compile(r' d="[^"]*"')
DIGITS = re.compile(r"-?\d+\.\d{3,}")


def moving_svg(figures: Sequence[Any], order: Sequence[int], duration: int) -> str:
    """Return figures as one SVG that shows them in turn, for ever.

    What two neighbouring frames have in common is written once: the parts of the drawing that
    stand still are in front of or behind those that move, as in the first frame.

    Parameters
    ----------
    figures
        Figures of matplotlib of one size, each frame drawn.
    order
        Which of them each frame shows.
    duration
        Time of a frame [ms].
    """
    roots = [_tree(figure) for figure in figures]
    defs: dict[str, str] = {}
    for root in roots:
        _take_defs(root, defs)
    parts = [[_text(own) for own in _parts(root)] for root in roots]
    still = set(parts[0]).intersection(*parts[1:])
    total = duration * len(order) / 1000
    lines = []
    below = [part for part in parts[0] if part in still]
    first = next((k for k, part in enumerate(parts[0]) if part not in still), len(parts[0]))
    behind = [part for part in parts[0][:first] if part in still]
    lines += behind
    for k, own in enumerate(parts):
        shown = [place for place, frame in enumerate(order) if frame == k]
        inner = "".join(part for part in own if part not in still)
        lines.append(f'<g visibility="hidden">{_times(shown, len(order), total)}{inner}</g>')
    lines += below[len(behind) :]
    head = roots[0]
    box, width, height = (head.get(name, "") for name in ("viewBox", "width", "height"))
    return (
        f'<svg xmlns="{SVG}" xmlns:xlink="{XLINK}" viewBox="{box}" width="{width}" '
        f'height="{height}"><defs>{"".join(defs.values())}</defs>\n'
        + "\n".join(lines)
        + "\n</svg>\n"
    )


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


def _tree(figure: Any) -> Tree.Element:
    file = io.BytesIO()
    with mpl.rc_context(SETTINGS):
        figure.savefig(file, format="svg", metadata=FORMATS["svg"])
    return Tree.fromstring(file.getvalue())


def _take_defs(element: Tree.Element, defs: dict[str, str]) -> None:
    """Take glyphs, clip paths and what else is defined out of a drawing, each of them once."""
    for child in list(element):
        if child.tag in (f"{{{SVG}}}defs", f"{{{SVG}}}metadata"):
            element.remove(child)
            for entry in child if child.tag.endswith("defs") else ():
                defs.setdefault(entry.get("id") or _text(entry), _text(entry))
        else:
            _take_defs(child, defs)


def _parts(element: Tree.Element) -> list[Tree.Element]:
    """Return the parts of a drawing: groups of groups are opened where they have no style."""
    found: list[Tree.Element] = []
    for child in element:
        plain = child.tag == f"{{{SVG}}}g" and not set(child.attrib) - {"id"}
        found += _parts(child) if plain else [child]
    return found


def _text(element: Tree.Element) -> str:
    """Return an element as text, the corners of its paths to a hundredth of a point."""
    Tree.register_namespace("", SVG)
    Tree.register_namespace("xlink", XLINK)
    text = Tree.tostring(element, encoding="unicode").strip()
    text = re.sub(rf' xmlns(:\w+)?="({SVG}|{XLINK})"', "", text)
    text = re.sub(r"\s*\n\s*", " ", text)
    return CORNERS.sub(lambda path: DIGITS.sub(lambda own: f"{float(own[0]):.2f}", path[0]), text)


def film(made: Callable[[], Sequence[Any]], duration: int, form: str, path: Path) -> None:
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
