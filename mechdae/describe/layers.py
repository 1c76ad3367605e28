"""Layers of links along the axis: which links pass each other, and the fewest layers for them.

A link is a plate of one layer. One with a fork is two plates with the other link between them.
Links that cross in projection lie in different layers, and no link passes a pin where that
reaches from one layer to another. The frame is a plate behind all links (layer 0), and where a pin
of it cannot come from there, a plate in front of them too; a pin that it holds on both sides has a
bracket on the other side of its link.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import field
from itertools import combinations

from mechdae.describe import GROUND
from mechdae.errors import InputError
from mechdae.records import dataclass

MOST = 9
"""Moving links that are laid in layers."""
TRIED = 200_000
"""Places of links that are tried."""


@dataclass(frozen=True)
class LinksCrossing:
    """Which moving links cross in projection, and which pass over pins: (link, pin)."""

    links: tuple[str, ...]
    pairs: frozenset[frozenset[str]]
    over: frozenset[tuple[str, str]]


@dataclass(frozen=True)
class Layers:
    """Lowest and highest layer of each moving link, and how far each pin reaches.

    ``count`` has the plates of the frame, and brackets in front; ``reach`` is that of overhung
    pins, in layers, 0 of those with a fork; ``pins`` are the layers in which each begins and ends.
    """

    spans: Mapping[str, tuple[int, int]]
    reach: Mapping[str, int]
    count: int
    pins: Mapping[str, tuple[int, int]] = field(default_factory=dict)


Pins = Mapping[str, tuple[str, str]]
Placed = tuple[int, int, tuple[tuple[str, int], ...]]
BEHIND, FRONT = "behind", "front"
Forks = Mapping[str, str]
"""Pin -> the link with the fork, for those that are not overhung."""


def fewest_layers(pins: Pins, forks: Forks, crossings: LinksCrossing) -> Layers | str:
    """Return the fewest layers, with the shortest reach of pins; or why there are none."""
    if len(crossings.links) > MOST:
        raise InputError(
            f"{len(crossings.links)} moving links: layers are counted of {MOST} at most",
            where="bodies",
        )
    inside: dict[str, list[str]] = {}
    for pin, owner in forks.items():
        inside.setdefault(owner, []).append(next(x for x in pins[pin] if x != owner))
    widths: dict[str, int] = {}
    for link in crossings.links:
        if _width(link, inside, crossings, widths, ()) == 0:
            return f"forks around each other: {link}"
    search = _Search(pins, forks, crossings, widths)
    for height in range(max(widths.values()), sum(widths.values()) + 1):
        best = min(search.placed(height), default=None)
        if search.tried > TRIED:
            return f"no order of layers among the first {TRIED} that were tried"
        if best is not None:
            return search.layers(dict(best[2]))
    return "no order of layers lets all links pass the pins that reach over them"


def _width(
    link: str,
    inside: Mapping[str, list[str]],
    crossings: LinksCrossing,
    widths: dict[str, int],
    outer: tuple[str, ...],
) -> int:
    """Return the layers that a link takes, 0 where forks are inside each other in a circle."""
    if link in outer:
        return 0
    if link not in widths:
        others = [body for body in inside.get(link, []) if body != GROUND]
        path = (*outer, link)
        inner = [_width(other, inside, crossings, widths, path) for other in others]
        if 0 in inner:
            return 0
        crossed = any(frozenset(two) in crossings.pairs for two in combinations(others, 2))
        gap = sum(inner) if crossed else max(inner, default=1)
        widths[link] = gap + 2 if link in inside else 1
    return widths[link]


@dataclass
class _Search:
    pins: Pins
    forks: Forks
    crossings: LinksCrossing
    widths: Mapping[str, int]
    tried: int = 0

    def placed(self, height: int) -> Iterator[Placed]:
        """Yield (layers, reach of all pins, lowest layers) of what fits above the frame."""
        yield from self._next({}, height)

    def _next(self, low: dict[str, int], height: int) -> Iterator[Placed]:
        links = self.crossings.links
        if len(low) == len(links):
            stack = self.layers(low)
            yield stack.count, sum(stack.reach.values()), tuple(low.items())
            return
        link = links[len(low)]
        for start in range(1, height - self.widths[link] + 2):
            more = {**low, link: start}
            self.tried += 1
            if self.tried > TRIED:
                return
            # what is in the way of a pin stays there, whatever lies further on
            if self._fits(link, more) and (None not in self._sides(self._spans(more)).values()):
                yield from self._next(more, height)

    def _spans(self, low: Mapping[str, int]) -> dict[str, tuple[int, int]]:
        return {link: (start, start + self.widths[link] - 1) for link, start in low.items()}

    def _fits(self, link: str, low: Mapping[str, int]) -> bool:
        """Return whether a link does not touch those that lie already."""
        spans = self._spans(low)
        mine = spans[link]
        for pin, pair in self.pins.items():
            if link not in pair:
                continue
            other = pair[0] if pair[1] == link else pair[1]
            if other not in spans:
                continue
            if pin in self.forks:
                outer, inner = (
                    (mine, spans[other]) if self.forks[pin] == link else (spans[other], mine)
                )
                if not (outer[0] < inner[0] and inner[1] < outer[1]):
                    return False
            elif not _apart(mine, spans[other]):
                return False
        return all(
            _apart(mine, spans[other])
            for other in spans
            if other != link and frozenset((link, other)) in self.crossings.pairs
        )

    def _sides(self, spans: Mapping[str, tuple[int, int]]) -> dict[str, tuple[str, int] | None]:
        """Return for each pin the side that it comes from and how far it reaches, None: neither."""
        found: dict[str, tuple[str, int] | None] = {}
        there = {GROUND, *spans}
        pins = {pin: pair for pin, pair in self.pins.items() if there.issuperset(pair)}
        for pin, pair in pins.items():
            ways = [
                way for way in self._ways(pin, pair, spans) if self._free(pin, pair, spans, way)
            ]
            found[pin] = (ways[0][0], ways[0][1]) if ways else None
        if any(sides is not None and sides[0] == FRONT for sides in found.values()):
            for pin, pair in pins.items():
                ways = self._ways(pin, pair, spans)
                free = [way for way in ways if self._free(pin, pair, spans, way)]
                if free:
                    found[pin] = min(free, key=lambda way: way[1])[:2]
        return found

    def _free(
        self,
        pin: str,
        pair: tuple[str, str],
        spans: Mapping[str, tuple[int, int]],
        way: tuple[str, int, list[int]],
    ) -> bool:
        """Return whether no other link that passes over the pin lies where it reaches."""
        return not any(
            spans[link][0] <= layer <= spans[link][1]
            for link, at in self.crossings.over
            if at == pin and link in spans and link not in pair
            for layer in way[2]
        )

    def _ways(
        self, pin: str, pair: tuple[str, str], spans: Mapping[str, tuple[int, int]]
    ) -> list[tuple[str, int, list[int]]]:
        """Return side, reach, and the layers in which there is the pin but neither of its links."""
        forked = pin in self.forks
        if GROUND not in pair:
            one, two = sorted((spans[pair[0]], spans[pair[1]]))
            between = [] if forked else list(range(one[1] + 1, two[0]))
            return [("", 0 if forked else two[0] - one[1], between)]
        low, high = spans[pair[0] if pair[1] == GROUND else pair[1]]
        top = max(span[1] for span in spans.values())
        bracket = self.forks.get(pin) == GROUND
        behind, ahead = list(range(1, low)), list(range(high + 1, top + 1))
        return [
            (BEHIND, 0 if forked else low, [*behind, high + 1] if bracket else behind),
            (FRONT, 0 if forked else top + 1 - high, [*ahead, low - 1] if bracket else ahead),
        ]

    def layers(self, low: Mapping[str, int]) -> Layers:
        """Return what was found."""
        spans = self._spans(low)
        sides = {pin: side for pin, side in self._sides(spans).items() if side is not None}
        top = max(span[1] for span in spans.values())
        fronts = [
            spans[pair[0] if pair[1] == GROUND else pair[1]][1] + 1
            for pin, pair in self.pins.items()
            if GROUND in pair and self.forks.get(pin) == GROUND
        ]
        front = any(side == FRONT for side, _ in sides.values())
        reach = {pin: side[1] for pin, side in sides.items()}
        pins = {pin: self._ends(pin, side[0], spans, top) for pin, side in sides.items()}
        return Layers(spans, reach, max([top + front, *fronts]) + 1, pins)

    def _ends(
        self, pin: str, side: str, spans: Mapping[str, tuple[int, int]], top: int
    ) -> tuple[int, int]:
        """Return the layers in which a pin begins and ends."""
        pair = self.pins[pin]
        owner = self.forks.get(pin)
        if GROUND not in pair:
            if owner is not None:
                return spans[owner]
            one, two = sorted((spans[pair[0]], spans[pair[1]]))
            return one[1], two[0]
        low, high = spans[pair[0] if pair[1] == GROUND else pair[1]]
        if owner == GROUND:
            return (0, high + 1) if side == BEHIND else (low - 1, top + 1)
        if owner is not None:
            return low, high
        return (0, low) if side == BEHIND else (high, top + 1)


def _apart(one: tuple[int, int], two: tuple[int, int]) -> bool:
    return one[1] < two[0] or two[1] < one[0]
