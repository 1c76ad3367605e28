"""The kinematic diagram in motion: frames, GIF, SVG, film, and the picture in a notebook."""

from __future__ import annotations

import base64
import io
import shutil
import subprocess
import zlib
from collections.abc import Callable, Iterator, Sequence
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.colors import to_rgba_array
from matplotlib.font_manager import findfont, get_font
from matplotlib.path import Path as Outline
from matplotlib.textpath import text_to_path
from PIL import Image

from mechdae.describe.file.atomic_write import whole_file
from mechdae.draw import style
from mechdae.draw.diagram.diagram import has_paths
from mechdae.draw.diagram.loads import peak_force
from mechdae.draw.diagram.scene import longest_run
from mechdae.draw.figure import figure_of, new_axes
from mechdae.draw.fragments import steady_labels
from mechdae.draw.labels.steady import compared
from mechdae.draw.poses import Eye, seen
from mechdae.draw.primitives import Primitive, path_of
from mechdae.draw.sheet import Sheet
from mechdae.draw.swinging import shape_of, swing_text, swinging
from mechdae.draw.words import Words
from mechdae.errors import InputError, UnavailableError
from mechdae.records import dataclass
from mechdae.types import Json

if TYPE_CHECKING:
    from mechdae.results.result import Result

VIDEOS = {
    "mp4": ("-c:v", "libx264", "-pix_fmt", "yuv420p", "-movflags", "+faststart"),
    "webm": ("-c:v", "libvpx-vp9", "-b:v", "0", "-crf", "30"),
}
"""Formats of films with what ffmpeg is told for them."""
MOVING = ("gif", "svg", *VIDEOS)
"""Formats of animations; films need ffmpeg."""
FRAMES = 60
"""Most frames without a wish; a sweep of more poses is thinned evenly."""
MOST = 600
SECONDS = 4.0
"""Length of one round without a wish."""
SHADES = 6
"""Steps of each colour towards the paper, for the edges of lines."""
FASTEST = 20
"""Shortest time of a frame [ms] that viewers keep to."""
Progress = Callable[[int, int], None]


@dataclass(frozen=True)
class Animation:
    """Frames of a motion, drawn one at a time when they are asked for.

    Parameters
    ----------
    result
        What `mechdae.solve` returned.
    poses
        Indices of the poses, in order.
    closed
        Whether the motion closes: the pose after the last is the first. Others run back and forth.
    duration
        Time of a frame [ms].
    dpi
        Pixels to the inch, the picture has 7 x 5 in.
    traces, labels, loads, dark, lang
        As in `mechdae.draw.diagram.diagram.draw`.
    subtitle
        In place of driver value, task and pose.
    ghosts
        Poses that are drawn faintly in all frames.
    eye
        From where a spatial mechanism is seen, one direction for all frames.
    """

    result: Any
    poses: tuple[int, ...]
    closed: bool
    duration: int
    dpi: int = style.DPI
    traces: bool = True
    labels: bool = True
    loads: bool = True
    dark: bool = False
    lang: str = "en"
    subtitle: str = ""
    ghosts: tuple[int, ...] = ()
    eye: Eye = None

    def __len__(self) -> int:
        return len(self.poses)

    def frames(self, progress: Progress | None = None) -> list[Image.Image]:
        """Return all frames as pictures with one palette.

        ``progress`` is called with the number of frames done and that of all.
        """
        palette = _palette(style.DARK if self.dark else style.LIGHT)
        ready = [
            picture_of_axes(sheet.ax, self.dpi).quantize(palette=palette, dither=Image.Dither.NONE)
            for sheet in self._each(True, progress)
        ]
        return [ready[k] for k in self._order()]

    def _order(self) -> list[int]:
        """Return which of the distinct poses each frame shows."""
        distinct = list(dict.fromkeys(self.poses))
        return [distinct.index(pose) for pose in self.poses]

    def _each(self, axes: bool, progress: Progress | None) -> Iterator[Sheet]:
        """Yield the drawing of each distinct pose, and tell how many are done."""
        distinct = list(dict.fromkeys(self.poses))
        for k, sheet in enumerate(self.drawn(distinct, axes), 1):
            yield sheet
            if progress is not None:
                progress(k, len(distinct))

    def drawn(self, poses: Sequence[int], axes: bool = False) -> Iterator[Sheet]:
        """Yield the drawing of each pose, all to one scale, on axes or as primitives alone."""
        words, theme = Words(self.lang), style.DARK if self.dark else style.LIGHT
        shown = seen(self.result, None, self.eye, poses)
        traces = self.traces and has_paths(self.result, shown.scene)
        shown = shown.with_paths() if traces else shown
        view = replace(
            shown.view, traces=traces, ghosts=self.ghosts or 0, labels=self.labels,
            loads=self.loads, bounds=shown.bounds((*poses, *self.ghosts), traces),
            peak=peak_force(shown.scene, self.result, poses) if self.loads else None, memory={},
            subtitle=self.subtitle,
        )  # fmt: skip
        if self.labels:
            labels = steady_labels(shown, compared(poses, poses[0]), view, words)[2]
            view = replace(view, steady=labels)
        for pose in poses:
            yield shown.draw(new_axes(theme) if axes else None, view, theme, words, pose)

    def gif(self, progress: Progress | None = None) -> bytes:
        """Return the animation as a GIF that repeats for ever."""
        frames = self.frames(progress)
        stream = io.BytesIO()
        frames[0].save(
            stream, format="GIF", save_all=True, append_images=frames[1:], duration=self.duration,
            loop=0, optimize=False, disposal=1,
        )  # fmt: skip
        return stream.getvalue()

    def svg(self, progress: Progress | None = None) -> str:
        """Return the animation as an SVG that moves by itself, without a script."""
        return moving_svg([*self._each(False, progress)], self._order(), self.duration)

    def save(self, path: str | Path, progress: Progress | None = None) -> Path:
        """Write a GIF, an SVG that moves, or with ffmpeg a film, by the ending of `path`.

        Nothing half-written is left behind.

        Raises
        ------
        InputError
            Another ending.
        UnavailableError
            A film without ffmpeg.
        """
        target = Path(path)
        form = target.suffix.lower().removeprefix(".")
        if form not in MOVING:
            raise InputError(
                f"animations are not written as '{target.suffix}'",
                where=str(path),
                hint=", ".join(f".{ending}" for ending in MOVING),
            )
        if form in VIDEOS:
            film(lambda: self.frames(progress), self.duration, form, target)
            return target
        made = self.gif(progress) if form == "gif" else self.svg(progress).encode()
        with whole_file(target) as file:
            file.write(made)
        return target

    def _repr_html_(self) -> str:
        """Return the picture for a notebook."""
        data = base64.b64encode(self.gif()).decode("ascii")
        return f'<img src="data:image/gif;base64,{data}" alt="{self.result.problem}">'


def picture_of_axes(axes: Axes, dpi: int) -> Image.Image:
    """Return the figure of axes as pixels."""
    figure = figure_of(axes)
    figure.set_dpi(dpi)
    canvas = FigureCanvasAgg(figure)
    canvas.draw()  # type: ignore[no-untyped-call]
    pixels = np.asarray(canvas.buffer_rgba())  # type: ignore[no-untyped-call]
    return Image.fromarray(pixels[..., :3].copy())


def _palette(theme: style.Theme) -> Image.Image:
    """Return a palette of the colours of a diagram and what lies between them and the paper."""
    colours = [theme.paint(color) for color in (style.PAPER, style.FILL, *style.DRAWN)]
    paper, fill, *full = to_rgba_array(colours)
    shades = range(1, SHADES + 1)
    rows = [paper, fill, *(paper + (color - paper) * k / SHADES for color in full for k in shades)]
    palette = Image.new("P", (1, 1))
    palette.putpalette(np.round(255 * np.array(rows)[:, :3]).astype(int).ravel().tolist())
    return palette


def animate(
    result: Any,
    *,
    frames: int | None = None,
    seconds: float = SECONDS,
    dpi: int = style.DPI,
    traces: bool = True,
    labels: bool = True,
    loads: bool = True,
    dark: bool = False,
    lang: str = "en",
    shape: int | None = None,
    view: Eye = None,
) -> Animation:
    """Return the motion of a result as an animation, with the options of the catalogue.

    A closed motion is shown once around, its last pose left out because it is the first
    one; any other runs back and forth. Poses that do not assemble are left out: of several
    arcs the longest is shown.

    Raises
    ------
    InputError
        Fewer than two poses, or numbers out of range.
    """
    words, most = Words(lang), check_frames(frames, seconds, dpi)
    more: Json = {"eye": view}
    if result.mechanism.dimension == 2 and getattr(result, "kind", "") == "equilibrium":
        number, run = 1 if shape is None else shape, list(range(most))
        whole = bool(shape_of(result, number)["eigenvalue"][1])
        more = {"subtitle": swing_text(result, number, words), "ghosts": (most,)}
        result = swinging(result, number, most)  # at rest in one pose more
    elif shape is not None:
        raise InputError("shapes are those of small motions at an equilibrium", where="shape")
    else:
        scene = seen(result, 0, view).scene
        known = scene.assembled()
        if len(known) < 2:
            raise InputError("fewer than two poses assemble, there is no motion to show")
        run = longest_run(known)
        whole = scene.closes(run)
        run = run[:-1] if whole else run
    chosen = _picked(run, whole, most)
    duration = max(FASTEST, round(1000.0 * seconds / len(chosen) / 10.0) * 10)
    shown = (traces, labels, loads, dark, lang)
    return Animation(result, tuple(chosen), whole, duration, dpi, *shown, **more)


def check_frames(frames: int | None, seconds: float, dpi: int) -> int:
    """Return the most frames of one way.

    Raises
    ------
    InputError
        Numbers out of range.
    """
    most = FRAMES if frames is None else frames
    if isinstance(most, bool) or not isinstance(most, int) or not 2 <= most <= MOST:
        raise InputError(f"frames are a whole number from 2 to {MOST}", where="frames")
    if not 0.1 <= seconds <= 600.0:
        raise InputError("a round takes 0.1 to 600 seconds", where="seconds")
    if isinstance(dpi, bool) or not isinstance(dpi, int) or not 20 <= dpi <= 300:
        raise InputError("dpi is a whole number from 20 to 300", where="dpi")
    return most


def _picked(poses: Sequence[int], whole: bool, most: int) -> list[int]:
    """Return the poses that are shown: once around if the motion closes, else back and forth."""
    picks = np.arange(min(most, len(poses)))
    if len(poses) > most:
        share = len(poses) / most if whole else (len(poses) - 1) / (most - 1)
        picks = np.floor(picks * share + 0.5).astype(int)
    chosen = [poses[k] for k in picks.tolist()]
    return chosen if whole else chosen + chosen[-2:0:-1]


def draw(result: Result, ax: int | None = None, **options: Any) -> Animation:
    """Return the animation; ``ax`` is not possible, each frame has its own axes."""
    if ax is not None:
        raise InputError("an animation has a figure of its own", where="ax")
    return animate(result, **options)


SVG, XLINK = "http://www.w3.org/2000/svg", "http://www.w3.org/1999/xlink"
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
            pieces = Outline(vertices, codes).iter_segments(simplify=False)
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
    cropped = (frame.convert("RGB").crop((0, 0, width, height)) for frame in frames)
    pixels = b"".join(frame.tobytes() for frame in cropped)
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
