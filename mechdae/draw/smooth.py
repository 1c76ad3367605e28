"""Poses so near each other that straight lines between them are the curves they lie on."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import replace
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from mechdae.draw.graphs.poles import clip_of, cuts
from mechdae.draw.graphs.series import vector_of
from mechdae.draw.labels.layout import feet
from mechdae.errors import MechdaeError

if TYPE_CHECKING:
    from mechdae.draw.diagram.placed_scene import PlacedScene
    from mechdae.results import SweepResult
    from mechdae.results.result import Result


Array = NDArray[np.float64]
PICTURE = 600.0
"""Size of what is seen [pixel]."""
PANEL = 360.0
"""Height of a graph [pixel]."""
PIXEL = 0.5
"""What a line may be off its curve [pixel]."""
KINK = 4.0
"""What is so much further off its neighbours' line than they are is a kink."""
FEWEST = 33
"""Poses that tell whether they are near enough to each other."""
MOST = 10000
TIMES = 8
"""Growth of the number of poses at once, at most."""
ROUNDS = 6


def few_named(result: Result) -> bool:
    """Return whether a task names a few poses, without saying that there is a way between them."""
    task = getattr(result, "definition", None)
    return task is not None and task.way < 2


def smooth(result: Result, seen: Callable[[Any], Iterable[Array]]) -> Result:
    """Return the same task at poses between which straight lines are drawn; itself if it may be.

    Parameters
    ----------
    result
        What was solved; what does not say its task, or names a few poses, stays as it is.
    seen
        The curves of a result as they are seen, (n, 2) or (n, 3) each [pixel].
    """
    if getattr(result, "definition", None) is None or few_named(result):
        return result
    finest, parts = result, 1
    count = len(result.status)
    for _ in range(ROUNDS):
        off = max(map(_off, seen(finest)), default=0.0)
        if count < 2 or (len(finest.status) >= FEWEST and off <= PIXEL):
            break
        more = int(np.clip(np.ceil(np.sqrt(off / PIXEL)), 2, TIMES))
        more = max(more, -(-FEWEST // len(finest.status)))
        parts = min(parts * more, MOST // count)
        if (count - 1) * parts + 1 <= len(finest.status):
            break
        try:
            finest = result.finer(parts)
        except MechdaeError:  # what the task did not ask for may not be there
            break
    return finest


def traced(scene: PlacedScene, result: Result, read: Callable[[Any], Any]) -> Any:
    """Return a scene whose paths are those of poses near each other; `read` makes scenes."""

    def seen(poses: SweepResult) -> list[Array]:
        known = scene if poses is result else read(poses)
        return in_picture(list(known.paths.values()))

    finest = smooth(result, seen)
    return scene if finest is result else replace(scene, way=read(finest))


def smooth_vectors(result: SweepResult, paths: list[str]) -> Any:
    """Return a result at poses between which the ways of vectors are drawn as straight lines."""
    return smooth(result, lambda poses: in_picture([vector_of(poses, path)[3] for path in paths]))


def in_picture(tracks: list[Array]) -> list[Array]:
    """Return curves as large as they are seen [pixel], to one scale."""
    spans = [
        np.ptp(track[np.isfinite(track).all(axis=1)], axis=0).max(initial=0.0) for track in tracks
    ]
    size = max(spans, default=0.0)
    return [track * (PICTURE / size) for track in tracks] if size > 0 else []


def in_panel(x: Array, y: Array) -> list[Array]:
    """Return a series as it is seen in a graph [pixel], without what runs through infinity."""
    clip = clip_of(x, y, cuts(y))
    if clip is not None:
        y = np.clip(y, clip.low, clip.high)
    spans = [
        float(np.ptp(values[np.isfinite(values)]) if np.isfinite(values).any() else 0.0)
        for values in (x, y)
    ]
    if not all(spans):
        return []
    return [np.stack([x * (PICTURE / spans[0]), y * (PANEL / spans[1])], axis=1)]


def thinned(x: Array, series: list[Array]) -> NDArray[np.int_]:
    """Return the rows (k,) that straight lines need, of curves over `x` (n,) as they are seen.

    Every other row is left out, and again, where lines between its neighbours pass within a tenth
    of a pixel.
    """
    rows, top = np.arange(len(x)), max((np.nanmax(np.abs(y)) for y in series), default=0.0)
    near = PIXEL / 5 * float(top) / PANEL
    while len(rows) > 2:
        before, here, after = rows[:-2:2], rows[1:-1:2], rows[2::2]
        here = here[: len(after)]
        share = (x[here] - x[before]) / np.maximum(x[after] - x[before], 1e-300)
        off = [np.abs(y[before] + share * (y[after] - y[before]) - y[here]) for y in series]
        spare = np.max(off, axis=0, initial=0.0) <= near  # what is not a number stays
        if not spare.any():
            break
        rows = np.setdiff1d(rows, here[spare], assume_unique=True)
    return rows


def _off(track: Array) -> float:
    """Return how far straight lines between places are off the curve through them, about.

    Half way between two places it is a quarter of what a place is off the line from the one before
    it to the one after it. Where it has a kink, which neighbours tell, or begins like a root at an
    end, it may be all of it.
    """
    before, here, after = track[:-2], track[1:-1], track[2:]
    off = np.linalg.norm(here - feet(here, before, after), axis=1)
    if not len(off):
        return 0.0
    beside = np.minimum(np.roll(off, 1), np.roll(off, -1))
    beside[[0, -1]] = np.nan
    even = off <= KINK * beside
    off = np.where(even, off / 4, off)[np.isfinite(off)]
    return float(off.max(initial=0.0))
