"""Schemes out of kinematic chains: fixed link, driver, output, pairs chosen; groups are dyads."""

from __future__ import annotations

from collections.abc import Iterator

from mechdae.errors import UnknownName
from mechdae.parts.types.chains.chains import KinematicChain, chains
from mechdae.parts.types.schemes.aims import ANGLE, CURVE, SLIDE
from mechdae.parts.types.schemes.scheme import (
    CRANK,
    DYAD,
    FIXED,
    MIDDLES,
    RIGID,
    SLIDER,
    SLIDES,
    SWING,
    Point,
    Scheme,
)
from mechdae.records import dataclass

NAMES = {"four-bar": (4, 1), "watt": (6, 1), "stephenson": (6, 2)}
"""Names of chains: links, and their place in the order of `chains`, from 1."""


def chain_names(links: int) -> list[str]:
    """Return the names of the chains with so many links: `6-1`, `6-2`, ..."""
    return [f"{links}-{k}" for k, _ in enumerate(chains(links), start=1)]


def named(name: str, most: int, where: str = "") -> tuple[int, int]:
    """Return links and place of a chain by its name."""
    if name in NAMES and NAMES[name][0] <= most:
        return NAMES[name]
    links, _, place = name.partition("-")
    whole = links.isdigit() and place.isdigit() and int(links) in range(4, most + 1, 2)
    if whole and 1 <= int(place) <= len(chain_names(int(links))):
        return int(links), int(place)
    known = [word for word, (size, _) in NAMES.items() if size <= most]
    known += [name for size in range(4, min(most, 8) + 1, 2) for name in chain_names(size)]
    raise UnknownName("chain", name, known, where=where)


def schemes_of(links: int, place: int, what: str = CURVE, slides: bool = False) -> list[Scheme]:
    """Return the schemes of one chain: each fixed link, crank and tracing link that differ.

    `what`: the aim: a point traces (`CURVE`, `PATH`), or a link or a block on the frame is the
    output (`ANGLE`, `SLIDE`). `slides`: whether one of the joints of each dyad may be a sliding
    pair; its block has no third joint.
    """
    found: dict[str, Scheme] = {}
    for number, chain in enumerate(chains(links), start=1):
        if number != place:
            continue
        for inversion in chain.inversions():
            for driven in inversion.drivers():
                for points, frames in _placed(driven, slides):
                    for scheme in _traced(points, frames, what):
                        found.setdefault(scheme.text, scheme)
    return list(found.values())


Frames = dict[int, list[int]]
"""Of each link its points."""


def _traced(points: list[Point], frames: Frames, what: str) -> Iterator[Scheme]:
    """Yield the schemes of placed points, one for each link that may trace or be the output."""
    fixed = {k for k, point in enumerate(points) if point[0] == FIXED}
    ends = _outputs(points, fixed, what) if what in (ANGLE, SLIDE) else None
    for whole in ends if ends is not None else _tracers(points, frames, fixed):
        if whole.pruned()[0].size == whole.size:
            yield whole


def _tracers(points: list[Point], frames: Frames, fixed: set[int]) -> Iterator[Scheme]:
    for frame in frames.values():
        if len(frame) < 2 or fixed & set(frame) or frame[:2] == [0, 1]:
            continue  # the frame, the crank, and links on the frame trace arcs at most
        yield Scheme((*points, (RIGID, frame[0], frame[1])), len(points))
    for k, (kind, i, j) in enumerate(points):
        on_frame = {i} & fixed if kind == SWING else {i, j} & fixed
        if kind in MIDDLES and not on_frame:
            yield Scheme(tuple(points), k)


def _outputs(points: list[Point], fixed: set[int], what: str) -> Iterator[Scheme]:
    for k, (kind, i, j) in enumerate(points):
        if what == SLIDE and kind == SLIDER and j in fixed:
            yield Scheme(tuple(points), k)
        if what == ANGLE and kind in (DYAD, SWING) and {i, j} & fixed:
            yield Scheme(tuple(points), k)


@dataclass
class _Standing:
    """Points that are placed so far."""

    points: list[Point]
    frames: Frames
    at: dict[int, int]
    blocks: set[int]

    def copy(self) -> _Standing:
        """Return another one that may change."""
        frames = {link: list(points) for link, points in self.frames.items()}
        return _Standing(list(self.points), frames, dict(self.at), set(self.blocks))

    def put(self, joint: int, link: int, frame: int) -> int:
        """Return the point of a joint on a link that is placed."""
        in_frame = self.frames[link]
        if link in self.blocks:
            raise _NoPoint
        if link == frame:
            self.points.append((FIXED, 0, 0))
        elif len(in_frame) == 1:
            self.points.append((CRANK, 0, 0))
        else:
            self.points.append((RIGID, in_frame[0], in_frame[1]))
        self.at[joint] = len(self.points) - 1
        in_frame.append(self.at[joint])
        return self.at[joint]


class _NoPoint(Exception):
    """A block has no further joint."""


def _placed(chain: KinematicChain, slides: bool) -> Iterator[tuple[list[Point], Frames]]:
    """Yield the points of a chain and those of each link, one for each choice of pairs."""
    frame, driver = chain.fixed, chain.driver
    assert frame is not None
    assert driver is not None
    one, other = chain.joints[driver]
    crank = other if one == frame else one
    begun = _Standing([(FIXED, 0, 0)], {frame: [0], crank: [0]}, {driver: 0}, set())
    for standing in _followed(chain, begun, frame, slides):
        yield _crank_first(standing)


def _followed(
    chain: KinematicChain, standing: _Standing, frame: int, slides: bool
) -> Iterator[_Standing]:
    """Yield all that the dyads of a chain can be, one after the other."""
    if len(standing.frames) == chain.links:
        yield standing
        return

    def outer(link: int) -> tuple[int, int] | None:
        """Return the one joint of a link with those that are placed, and that other link."""
        for k, joint in enumerate(chain.joints):
            if link in joint and k not in standing.at:
                far = joint[0] if joint[1] == link else joint[1]
                if far in standing.frames:
                    return k, far
        return None

    for k, (u, v) in enumerate(chain.joints):
        if u in standing.frames or v in standing.frames:
            continue
        first, second = outer(u), outer(v)
        if first is None or second is None:
            continue
        kinds = [(DYAD, False), *((kind, turn) for kind in SLIDES for turn in (False, True))]
        for kind, turn in kinds if slides else kinds[:1]:
            grown = standing.copy()
            try:
                i, j = grown.put(*first, frame), grown.put(*second, frame)
            except _NoPoint:
                return
            one, other = (v, u) if turn else (u, v)
            ends = (j, i) if turn else (i, j)
            grown.points.append((kind, *ends))
            grown.at[k] = middle = len(grown.points) - 1
            grown.frames[one] = [ends[0], middle]
            grown.frames[other] = [ends[1], middle] if kind == DYAD else []
            grown.blocks |= set() if kind == DYAD else {other}
            yield from _followed(chain, grown, frame, slides)
        return


def _crank_first(standing: _Standing) -> tuple[list[Point], Frames]:
    """Return points and frames with the crank's pin as point 1."""
    points, frames = standing.points, standing.frames
    if points[1][0] != CRANK:
        place = next(k for k, point in enumerate(points) if point[0] == CRANK)
        order = [0, place, *(k for k in range(1, len(points)) if k != place)]
        to = {old: new for new, old in enumerate(order)}
        points = [(point[0], to[point[1]], to[point[2]]) for point in (points[k] for k in order)]
        frames = {link: [to[k] for k in frame] for link, frame in frames.items()}
    return points, frames
