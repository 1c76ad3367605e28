"""A scheme: a crank and dyads one after the other, as points that bars hold together.

Point 0 is the crank's pivot, point 1 its pin. Each further point is fixed, has its place in the
frame of two points of one link (*rigid*), or is the middle of a dyad: two bars from two points
(*dyad*, RRR); a bar from one point, to a block that slides on the straight line through the other
one, which is on its guide (*slider*, RRP); a rod that turns about one point and slides through a
block that turns about the other one (*swing*, RPR): the straight line from the middle to that
point is its slot. A place for each point in one pose is all that a scheme needs for its dimensions.
"""

from __future__ import annotations

from functools import cached_property

from mechdae.records import dataclass

FIXED, CRANK, RIGID, DYAD = "F", "C", "R", "D"
SLIDER, SWING = "S", "T"
MIDDLES = (DYAD, SLIDER, SWING)
"""Kinds of points that are the middle of a dyad: RRR, RRP, RPR."""
SLIDES = (SLIDER, SWING)
HANGING = (RIGID, *MIDDLES)
"""Kinds that hang on two others."""
Point = tuple[str, int, int]
"""Kind, and the two points that it hangs on."""


@dataclass(frozen=True)
class Scheme:
    """Points in the order in which they are placed.

    `points`: kind and two earlier points of each; those of a rigid one are on one link.
    """

    points: tuple[Point, ...]
    trace: int

    @property
    def size(self) -> int:
        """Number of points: pins, and the tracing point where it is none."""
        return len(self.points)

    @cached_property
    def links(self) -> tuple[tuple[int, ...], ...]:
        """The points of each link, the frame first, then the crank."""
        found: list[list[int]] = [[], [0, 1]]
        for k, (kind, i, j) in enumerate(self.points):
            if kind == FIXED:
                found[0].append(k)
            elif kind == RIGID:
                both = [link for link in found if i in link and j in link]
                if not both:
                    raise ValueError(f"points {i} and {j} are on no link together")
                both[0].append(k)
            elif kind == CRANK and k != 1:
                found[1].append(k)
            elif kind == DYAD:
                found += [[i, k], [j, k]]
            elif kind == SLIDER:
                found += [[i, k], [k]]  # the bar, and the block
            elif kind == SWING:
                found += [[i, k], [j]]  # the rod, and the block
        return tuple(map(tuple, found))

    @cached_property
    def slides(self) -> tuple[tuple[int, int, int], ...]:
        """Of each sliding pair: the middle of its dyad, the link with the guide, the block."""
        found, count = [], 2
        for k, (kind, _, j) in enumerate(self.points):
            if kind == SLIDER:
                found.append((k, self.links_at(j)[0], count + 1))
            elif kind == SWING:
                found.append((k, count, count + 1))
            count += 2 * (kind in MIDDLES)
        return tuple(found)

    @cached_property
    def bars(self) -> tuple[tuple[int, int], ...]:
        """Lines that the material is counted by: a link with three points is a triangle."""
        found = [(0, 1)]
        for k, (kind, i, j) in enumerate(self.points):
            if kind in (RIGID, DYAD):
                found += [(i, k), (j, k)]
            elif kind in SLIDES:
                found.append((i, k))
        return tuple(found)

    @cached_property
    def ways(self) -> tuple[tuple[int, int], ...]:
        """Lines that the material is counted by at their longest: guides of moving links."""
        found = []
        for k, (kind, i, j) in enumerate(self.points):
            if kind == SWING:
                found.append((i, j))
            elif kind == SLIDER and self.points[j][0] != FIXED:
                found.append((j, k))
        return tuple(found)

    @cached_property
    def members(self) -> tuple[tuple[int, int], ...]:
        """The crank and the bars of dyads: what may not shrink to nothing."""
        found = [(0, 1)]
        for k, (kind, i, j) in enumerate(self.points):
            if kind == DYAD:
                found += [(i, k), (j, k)]
            elif kind in SLIDES:
                found += [(i, k), (j, k)]  # the second one gives a guide its direction
        return tuple(found)

    def links_at(self, point: int) -> list[int]:
        return [k for k, link in enumerate(self.links) if point in link]

    @cached_property
    def joints(self) -> int:
        """Number of joints with two links each: three links on one pin are two."""
        pins = sum(max(len(self.links_at(k)) - 1, 0) for k in range(self.size))
        return pins + len(self.slides)

    @cached_property
    def text(self) -> str:
        """The scheme as short text, from which `read` makes it again."""
        words = [kind + (f"{i}.{j}" if kind in HANGING else "") for kind, i, j in self.points]
        return " ".join([*words, f"*{self.trace}"])

    @property
    def name(self) -> str:
        """What it is called in results."""
        return f"{len(self.links)} links, {self.joints} joints: {self.text}"

    def pruned(self) -> tuple[Scheme, list[int]]:
        """Return the scheme without points that the tracing one does not hang on; those kept."""
        needed = {0, 1, self.trace}
        for k in range(self.size - 1, -1, -1):
            kind, i, j = self.points[k]
            if k in needed and kind in HANGING:
                needed |= {i, j}
        order = sorted(needed)
        place = {old: new for new, old in enumerate(order)}
        points = tuple(
            (kind, place.get(i, 0), place.get(j, 0))
            for kind, i, j in (self.points[k] for k in order)
        )
        return Scheme(points, place[self.trace]), order


def read(text: str) -> Scheme:
    points: list[Point] = []
    *words, last = text.split()
    for word in words:
        i, j = map(int, word[1:].split(".")) if len(word) > 1 else (0, 0)
        points.append((word[0], i, j))
    return Scheme(tuple(points), int(last[1:]))


def pivot_of(scheme: Scheme) -> int:
    """Return the fixed point of the output: its pivot, or the one that its guide passes."""
    _, i, j = scheme.points[scheme.trace]
    return i if scheme.points[i][0] == FIXED else j


def output_points(scheme: Scheme) -> tuple[int, int]:
    """Return two points of the link whose angle is the output of a function."""
    kind, i, _ = scheme.points[scheme.trace]
    # a block that turns on the frame has the angle of its rod
    return (i if kind == SWING else pivot_of(scheme)), scheme.trace
