"""Larger and smaller schemes out of one: steps that change no motion at first, and points left out.

- *split*: the end of a bar leaves the pin that it shares and gets one of its own in the same
  place on a link that is there. One point more, the same motion.
- *dyad*: a new dyad on the pin of a bar and on another point makes a link that turns about that
  pin; the bar's end is put on this link, at the pin, where it does not move. Two points more, the
  same motion.
- *rod*: the same with a rod that slides through a block on the other point, where sliding pairs are
  allowed.
- *arm*: a tracing pin of two bars becomes a point of its own on one of them.
- *merge*: a point of a link falls onto the one it is counted from. One point less, another motion.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from itertools import product
from typing import TYPE_CHECKING, Any

import numpy as np

from mechdae.parts.types.schemes.closure import turned
from mechdae.parts.types.schemes.scheme import (
    DYAD,
    FIXED,
    HANGING,
    MIDDLES,
    RIGID,
    SLIDER,
    SWING,
    Point,
    Scheme,
)
from mechdae.parts.types.schemes.screening import middle, reaching
from mechdae.records import dataclass
from mechdae.types import Complexes

if TYPE_CHECKING:
    from numpy.random import Generator


ANGLES = 64
TURN = 2 * np.pi


@dataclass(frozen=True)
class Change:
    """A scheme and the places of its points from those of another one.

    `origin`: for each point the one of the other scheme whose place it has, or -1: it is drawn.
    """

    scheme: Scheme
    origin: tuple[int, ...]

    def places(
        self, parent: Scheme, places: Complexes, count: int, generator: Generator,
        span: tuple[float, float] | None = None,
    ) -> Complexes:  # fmt: skip
        """Return so many sets (count, n) from one of the parent (n,)."""
        found = np.repeat(np.asarray(places, complex)[None], count, axis=0)
        found = np.stack(
            [found[:, k] if k >= 0 else np.zeros(count, complex) for k in self.origin], axis=1
        )
        if -1 in self.origin:
            self._draw(parent, places, found, generator, span)
        return found

    def _draw(
        self, parent: Scheme, places: Complexes, found: Complexes, generator: Generator, span: Any
    ) -> None:
        new = self.origin.index(-1)
        _, i, j = self.scheme.points[new]
        angles = TURN * np.arange(ANGLES) / ANGLES
        if span is not None:
            angles = np.append(0.0, np.linspace(span[0], span[1], ANGLES))
        x = turned(parent, np.asarray(places)[None], angles).x
        one, other = x[self.origin[i]], x[self.origin[j]]
        count = len(found)
        if self.scheme.points[new][0] == SWING:
            both = np.repeat(np.stack([one, other]), count, axis=1)
            pair = Scheme(((FIXED, 0, 0), (FIXED, 0, 0), (SWING, 0, 1)), 2)
            found[:, new] = middle(pair, both, 2, generator)
            return
        first, second, side = reaching(
            np.repeat(one, count, axis=0), np.repeat(other, count, axis=0), generator
        )
        gap = (other - one)[:, :1]
        far = np.abs(gap) ** 2
        # points that meet give no set
        with np.errstate(invalid="ignore", divide="ignore"):
            along = (first**2 - second**2 + far) / (2 * far)
            across = np.sqrt(np.maximum(first**2 / far - along**2, 0.0))
        found[:, new] = (one[:, :1] + gap * (along + 1j * side * across))[:, 0]


def grown(scheme: Scheme, slides: bool = False, function: bool = False) -> Iterator[Change]:
    """Yield the schemes with a point or a dyad more that move as this one does at first."""
    seen = set()
    kinds = (DYAD, SWING) if slides else (DYAD,)
    arms = () if function else _arms(scheme)
    for change in (*_splits(scheme, function), *arms, *_dyads(scheme, kinds, function)):
        whole = change.scheme.pruned()[0].size == change.scheme.size
        if whole and change.scheme.text not in seen:
            seen.add(change.scheme.text)
            yield change


def merged(scheme: Scheme, function: bool = False) -> Iterator[Change]:
    """Yield the schemes in which a point of a link is the one it is counted from."""
    seen = {scheme.text}
    for k, (kind, i, j) in enumerate(scheme.points):
        if kind != RIGID:
            continue
        for other in (i, j):
            onto = {k: other}
            points = [(kind, onto.get(p, p), onto.get(q, q)) for kind, p, q in scheme.points]
            if any(kind in HANGING and p == q for kind, p, q in points):
                continue
            if any(kind == SLIDER and q == k for kind, _, q in scheme.points):
                continue  # the point of a guide would be on several links
            trace = onto.get(scheme.trace, scheme.trace)
            if not function and _traces_arc(Scheme(tuple(points), trace), trace):
                continue
            try:
                found, order = Scheme(tuple(points), trace).pruned()
                found.links  # noqa: B018  (raises for rigid points that have lost their link)
            except ValueError:
                continue
            loops = any(kind in MIDDLES for kind, _, _ in found.points)
            if loops and found.text not in seen and _is_whole(found):
                seen.add(found.text)
                yield Change(found, tuple(order))


def _is_whole(scheme: Scheme) -> bool:
    """Return whether no dyad hangs on two points of one link: it would be rigid with it."""
    for k, (kind, i, j) in enumerate(scheme.points):
        if kind in MIDDLES:
            before = Scheme(scheme.points[:k], 0)
            if any(i in link and j in link for link in before.links):
                return False
    return True


def _traces_arc(scheme: Scheme, trace: int) -> bool:
    """Return whether a point is fixed, on the crank, or at the end of a bar on the frame."""
    kind, i, j = scheme.points[trace]
    if kind == FIXED or trace < 2:
        return True
    if kind == SWING:
        return scheme.points[i][0] == FIXED
    if kind in MIDDLES:
        return scheme.points[i][0] == FIXED or scheme.points[j][0] == FIXED
    try:
        links = scheme.links
    except ValueError:
        return True
    fixed = {k for k, point in enumerate(scheme.points) if point[0] == FIXED}
    return any(trace in link and fixed & set(link) for link in links)


def _inserted(
    scheme: Scheme, at: int, new: list[Point], origin: list[int]
) -> tuple[list[tuple[str, int, int]], list[int], Callable[..., Any]]:
    """Return points with new ones before `at`, the origin of each, and how numbers move."""

    def moved(k: int) -> int:
        return k + len(new) if k >= at else k

    points = [
        *scheme.points[:at], *new,
        *((kind, moved(i), moved(j)) for kind, i, j in scheme.points[at:]),
    ]  # fmt: skip
    return points, [*range(at), *origin, *range(at, scheme.size)], moved


def _with_end(
    scheme: Scheme, k: int, old: int, new: int, points: list[Point], moved: Any
) -> list[tuple[str, int, int]]:
    """Return points whose bar from `old` to `k`, with all that is on its link, ends at `new`."""
    carrier = next(link for link in scheme.links if old in link and k in link)
    at = {moved(k), *(moved(p) for p in carrier if p > k and scheme.points[p][0] == RIGID)}
    return [
        (kind, new if p in at and i == moved(old) else i, new if p in at and j == moved(old) else j)
        for p, (kind, i, j) in enumerate(points)
    ]


def _splits(scheme: Scheme, function: bool) -> Iterator[Change]:
    for k, (kind, *ends) in enumerate(scheme.points):
        if kind != DYAD:
            continue
        for end in ends:
            if function and k == scheme.trace and scheme.points[end][0] == FIXED:
                continue
            for number in scheme.links_at(end):
                link = [p for p in scheme.links[number] if p < k and p != end]
                if k in scheme.links[number]:
                    continue
                known, i, j = scheme.points[end]
                if number == 0:
                    new: Point = (FIXED, 0, 0)
                elif known == RIGID and {i, j} <= set(scheme.links[number]):
                    new = (RIGID, i, j)
                elif link:
                    new = (RIGID, end, link[0])
                else:
                    continue
                points, origin, moved = _inserted(scheme, k, [new], [end])
                points = _with_end(scheme, k, end, k, points, moved)
                yield Change(Scheme(tuple(points), moved(scheme.trace)), tuple(origin))


def _arms(scheme: Scheme) -> Iterator[Change]:
    trace = scheme.trace
    kind, *ends = scheme.points[trace]
    if kind == DYAD:
        for end in ends:
            points = (*scheme.points, (RIGID, trace, end))
            yield Change(Scheme(points, scheme.size), (*range(scheme.size), trace))


def _dyads(scheme: Scheme, kinds: tuple[str, ...], function: bool) -> Iterator[Change]:
    places = [
        (k, end, other)
        for k, (kind, *ends) in enumerate(scheme.points)
        if kind == DYAD
        for end in ends
        # the output of a function stays on its pivot
        if not (function and k == scheme.trace and scheme.points[end][0] == FIXED)
        for other in range(1, k)
    ]
    for kind, (k, end, other) in product(kinds, places):
        together = any(end in link and other in link for link in scheme.links)
        if other == end or together:
            continue
        new: list[Point] = [(kind, end, other), (RIGID, end, k)]
        points, origin, moved = _inserted(scheme, k, new, [-1, end])
        points = _with_end(scheme, k, end, k + 1, points, moved)
        yield Change(Scheme(tuple(points), moved(scheme.trace)), tuple(origin))
