"""The kinematic diagram in motion: frames, GIF, and the picture in a notebook."""

from __future__ import annotations

import base64
import io
from collections.abc import Callable, Iterator, Sequence
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure
from numpy.typing import NDArray
from PIL import Image

from mechdae.describe.file.atomic_write import whole_file
from mechdae.draw import style
from mechdae.draw.diagram import diagram
from mechdae.draw.diagram.loads import peak_force
from mechdae.draw.diagram.scene import DrawnScene, longest_run, read_scene
from mechdae.draw.diagram.view import View
from mechdae.draw.figure import new_axes
from mechdae.draw.fragments import steady_labels
from mechdae.draw.labels.steady import compared
from mechdae.draw.moving import VIDEOS, film, moving_svg
from mechdae.draw.sheet import Sheet
from mechdae.draw.smooth import traced
from mechdae.draw.swinging import shape_of, swing_text, swinging
from mechdae.draw.words import Words
from mechdae.errors import InputError
from mechdae.records import dataclass

if TYPE_CHECKING:
    from mechdae.results import EquilibriumResult
    from mechdae.results.result import Result


MOVING = ("gif", "svg", *VIDEOS)
"""Formats of animations; films need ffmpeg."""
FRAMES = 60
"""Most frames without a wish; a sweep of more poses is thinned evenly."""
MOST = 600
SECONDS = 4.0
"""Length of one round without a wish."""
CLOSED = 1e-9
"""First and last pose are the same if no point is farther off than this share of its path."""
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

    def __len__(self) -> int:
        return len(self.poses)

    def frames(self, progress: Progress | None = None) -> list[Image.Image]:
        """Return all frames as pictures with one palette.

        ``progress`` is called with the number of frames done and that of all.
        """
        distinct = list(dict.fromkeys(self.poses))
        drawn: dict[int, Image.Image] = {}
        for k, (pose, picture) in enumerate(zip(distinct, self.pictures(distinct), strict=True)):
            drawn[pose] = picture
            if progress is not None:
                progress(k + 1, len(distinct))
        palette = _palette(style.DARK if self.dark else style.LIGHT)
        ready = {
            pose: picture.quantize(palette=palette, dither=Image.Dither.NONE)
            for pose, picture in drawn.items()
        }
        return [ready[pose] for pose in self.poses]

    def pictures(self, poses: Sequence[int]) -> Iterator[Image.Image]:
        """Yield the picture of each pose, all to one scale."""
        for sheet in self.drawn(poses, True):
            yield picture_of_axes(sheet.ax, self.dpi)

    def drawn(self, poses: Sequence[int], axes: bool = False) -> Iterator[Sheet]:
        """Yield the drawing of each pose, all to one scale, on axes or as primitives alone."""
        scene = read_scene(self.result)
        if self.traces and diagram.has_paths(self.result, scene):
            scene = traced(scene, self.result, read_scene)
        view = self._view(scene, poses)
        theme = style.DARK if self.dark else style.LIGHT
        for pose in poses:
            paper = new_axes(theme) if axes else None
            yield diagram.draw_pose(paper, scene, self.result, pose, view, theme, Words(self.lang))

    def _view(self, scene: DrawnScene, poses: Sequence[int]) -> View:
        """Return what all frames have in common: the scale above all."""
        traces = self.traces and diagram.has_paths(self.result, scene)
        bounds = diagram.common_extent(scene, (*poses, *self.ghosts), traces)
        peak = peak_force(scene, self.result, poses) if self.loads else None
        view = View(
            traces, self.ghosts or 0, self.labels, self.loads, bounds, peak, {},
            subtitle=self.subtitle,
        )  # fmt: skip
        if not self.labels:
            return view
        some = compared(poses, poses[0])
        words = Words(self.lang)
        return replace(view, steady=steady_labels(scene, self.result, some, view, words)[2])

    def gif(self, progress: Progress | None = None) -> bytes:
        """Return the animation as a GIF that repeats for ever."""
        frames = self.frames(progress)
        stream = io.BytesIO()
        frames[0].save(
            stream,
            format="GIF",
            save_all=True,
            append_images=frames[1:],
            duration=self.duration,
            loop=0,
            optimize=False,
            disposal=1,
        )
        return stream.getvalue()

    def svg(self, progress: Progress | None = None) -> str:
        """Return the animation as an SVG that moves by itself, without a script."""
        distinct = list(dict.fromkeys(self.poses))
        sheets = []
        for k, sheet in enumerate(self.drawn(distinct)):
            sheets.append(sheet)
            if progress is not None:
                progress(k + 1, len(distinct))
        order = [distinct.index(pose) for pose in self.poses]
        return moving_svg(sheets, order, self.duration)

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
                hint=", ".join(f".{own}" for own in MOVING),
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
    figure = axes.get_figure(root=True)
    assert isinstance(figure, Figure)
    figure.set_dpi(dpi)
    canvas = FigureCanvasAgg(figure)
    canvas.draw()  # type: ignore[no-untyped-call]
    pixels = np.asarray(canvas.buffer_rgba())  # type: ignore[no-untyped-call]
    return Image.fromarray(pixels[..., :3].copy())


def _palette(theme: style.Theme) -> Image.Image:
    """Return a palette of the colours of a diagram and what lies between them and the paper."""
    paper = _channels(theme.paint(style.PAPER))
    rows = [paper, _channels(theme.paint(style.FILL))]
    for color in style.DRAWN:
        full = _channels(theme.paint(color))
        rows += [paper + (full - paper) * k / SHADES for k in range(1, SHADES + 1)]
    palette = Image.new("P", (1, 1))
    palette.putpalette(np.round(rows).astype(int).ravel().tolist())
    return palette


def _channels(color: str) -> NDArray[np.float64]:
    return np.array([int(color[k : k + 2], 16) for k in (1, 3, 5)], dtype=float)


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
) -> Animation:
    """Return the motion of a result as an animation.

    A closed motion is shown once around, its last pose left out because it is the first
    one; any other runs back and forth. Poses that do not assemble are left out: of several
    arcs the longest is shown.

    Parameters
    ----------
    result
        What `mechdae.solve` returned for a sweep or a task of reactions.
    frames
        Most frames of one way; without it at most 60.
    seconds
        Time of one round.
    dpi
        Pixels to the inch, 7 x 5 in.
    traces, labels, loads, dark, lang
        As in a diagram, see `mechdae.draw.diagram.diagram.draw`.
    shape
        Of an equilibrium: number of the small motion that is shown, enlarged, over one
        period; 1, the slowest, without it.

    Raises
    ------
    InputError
        Fewer than two poses, or numbers out of range.
    """
    Words(lang)
    most = check_frames(frames, seconds, dpi)
    shown = (traces, labels, loads, dark, lang)
    if getattr(result, "kind", "") == "equilibrium":
        return _shape(result, 1 if shape is None else shape, most, seconds, dpi, shown)
    if shape is not None:
        raise InputError("shapes are those of small motions at an equilibrium", where="shape")
    scene = read_scene(result)
    chosen, whole = frames_of(scene.assembled(), lambda run: closes(scene, run), most)
    duration = frame_time(seconds, len(chosen))
    return Animation(result, chosen, whole, duration, dpi, *shown)


def _shape(
    result: EquilibriumResult,
    number: int,
    frames: int,
    seconds: float,
    dpi: int,
    shown: tuple[bool, bool, bool, bool, str],
) -> Animation:
    """Return a small motion around an equilibrium as an animation, its rest drawn faintly."""
    poses = list(range(frames))
    swings = bool(shape_of(result, number)["eigenvalue"][1])
    chosen = poses if swings else poses + poses[-2:0:-1]
    return Animation(
        swinging(result, number, frames),
        tuple(chosen),
        swings,
        frame_time(seconds, len(chosen)),
        dpi,
        *shown,
        subtitle=swing_text(result, number, Words(shown[-1])),
        ghosts=(frames,),
    )


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


def frames_of(
    known: list[int], closed: Callable[[list[int]], bool], most: int
) -> tuple[tuple[int, ...], bool]:
    """Return the poses that are shown of those that assemble, and whether they are one round.

    `closed` says whether a run of poses ends where it begins.

    Raises
    ------
    InputError
        Fewer than two poses assemble.
    """
    if len(known) < 2:
        raise InputError("fewer than two poses assemble, there is no motion to show")
    run = longest_run(known)
    whole = closed(run)
    return tuple(_picked(run, whole, most)), whole


def _picked(run: Sequence[int], whole: bool, most: int) -> list[int]:
    """Return the poses of a run that are shown: once around if it closes, else back and forth."""
    poses = run[:-1] if whole else run
    picks = np.arange(min(most, len(poses)))
    if len(poses) > most:
        share = len(poses) / most if whole else (len(poses) - 1) / (most - 1)
        picks = np.floor(picks * share + 0.5).astype(int)
    chosen = [poses[k] for k in picks.tolist()]
    return chosen if whole else chosen + chosen[-2:0:-1]


def frame_time(seconds: float, count: int) -> int:
    """Return the time of a frame [ms]."""
    return max(FASTEST, round(1000.0 * seconds / count / 10.0) * 10)


def closes(scene: DrawnScene, run: Sequence[int]) -> bool:
    """Return whether a run of poses ends where it begins.

    Gears may return to another tooth: what counts is where points and directions are.
    """
    if len(run) < 3:
        return False
    for body in scene.mechanism.bodies:
        if body not in scene.origins:
            continue
        turn = float(scene.angles[body][run[-1]] - scene.angles[body][run[0]])
        if abs(np.sin(turn / 2)) > CLOSED:
            return False
        track = scene.origins[body][list(run)]
        spread = float(np.ptp(track, axis=0).max())
        size = max(spread, *(float(np.abs(scene.local(f"{body}.{point}")).max())
                             for point in scene.mechanism.body(body).points), 0.0)  # fmt: skip
        if float(np.hypot(*(track[-1] - track[0]))) > CLOSED * size:
            return False
    return True


def draw(result: Result, ax: int | None = None, **options: Any) -> Animation:
    """Return the animation; ``ax`` is not possible, each frame has its own axes."""
    if ax is not None:
        raise InputError("an animation has a figure of its own", where="ax")
    return animate(result, **options)
