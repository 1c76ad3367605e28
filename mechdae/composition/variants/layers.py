"""Layers of links along the axis: which links pass each other, and the fewest layers for them.

A link is a plate of one layer. One with a fork is two plates with the other link between them.
Links that cross in projection lie in different layers, and no link passes a pin where that
reaches from one layer to another. The frame is a plate behind all links (layer 0); a pin that it
holds on both sides has a bracket in front of its link too.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass

from mechdae.describe.mechanism import GROUND
from mechdae.errors import InputError

MOST = 9
"""Moving links that are laid in layers."""


@dataclass(frozen=True)
class Crossings:
    """Which moving links cross in projection, and which pass over pins: (link, pin)."""

    links: tuple[str, ...]
    pairs: frozenset[frozenset[str]]
    over: frozenset[tuple[str, str]]


@dataclass(frozen=True)
class Layers:
    """Lowest and highest layer of each moving link, and how far each pin reaches.

    ``count`` has the plate of the frame, and brackets in front; ``reach`` is that of overhung
    pins, in layers, 0 of those with a fork.
    """

    spans: Mapping[str, tuple[int, int]]
    reach: Mapping[str, int]
    count: int


Pins = Mapping[str, tuple[str, str]]
Forks = Mapping[str, str]
"""Pin -> the link with the fork, for those that are not overhung."""


def laid(pins: Pins, forks: Forks, crossings: Crossings) -> Layers | str:
    """Return the fewest layers, with the shortest reach of pins; or why there are none.

    Parameters
    ----------
    pins
        Name -> the two links that turn in it.
    forks
        The link that has the fork, by pin; pins that are not there are overhung.
    crossings
        Of the links in the motion.
    """
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
        if best is not None:
            return search.layers(dict(best[1]))
    return "no order of layers lets all links pass the pins that reach over them"


def _width(
    link: str,
    inside: Mapping[str, list[str]],
    crossings: Crossings,
    widths: dict[str, int],
    outer: tuple[str, ...],
) -> int:
    """Return the layers that a link takes, 0 where forks are inside each other in a circle."""
    if link in outer:
        return 0
    if link not in widths:
        others = [own for own in inside.get(link, []) if own != GROUND]
        own = [_width(other, inside, crossings, widths, (*outer, link)) for other in others]
        if 0 in own:
            return 0
        crossed = any(
            frozenset((one, two)) in crossings.pairs for one in others for two in others if one < two
        )
        gap = sum(own) if crossed else max(own, default=1)
        widths[link] = gap + 2 if link in inside else 1
    return widths[link]


@dataclass
class _Search:
    pins: Pins
    forks: Forks
    crossings: Crossings
    widths: Mapping[str, int]

    def placed(self, height: int) -> Iterator[tuple[int, tuple[tuple[str, int], ...]]]:
        """Yield (reach of all pins, lowest layers) that fit into so many layers above the frame."""
        yield from self._next({}, height)

    def _next(
        self, low: dict[str, int], height: int
    ) -> Iterator[tuple[int, tuple[tuple[str, int], ...]]]:
        links = self.crossings.links
        if len(low) == len(links):
            spans = self._spans(low)
            if self._clear(spans):
                yield sum(self._reach(spans).values()), tuple(low.items())
            return
        link = links[len(low)]
        for start in range(1, height - self.widths[link] + 2):
            tried = {**low, link: start}
            if self._fits(link, tried):
                yield from self._next(tried, height)

    def _spans(self, low: Mapping[str, int]) -> dict[str, tuple[int, int]]:
        return {link: (start, start + self.widths[link] - 1) for link, start in low.items()}

    def _fits(self, link: str, low: Mapping[str, int]) -> bool:
        """Return whether a link does not touch those that lie already."""
        spans = self._spans(low)
        own = spans[link]
        for pin, pair in self.pins.items():
            if link not in pair:
                continue
            other = pair[0] if pair[1] == link else pair[1]
            if other not in spans:
                continue
            if pin in self.forks:
                outer, inner = (own, spans[other]) if self.forks[pin] == link else (spans[other], own)
                if not (outer[0] < inner[0] and inner[1] < outer[1]):
                    return False
            elif not _apart(own, spans[other]):
                return False
        return all(
            _apart(own, spans[other])
            for other in spans
            if other != link and frozenset((link, other)) in self.crossings.pairs
        )

    def _clear(self, spans: Mapping[str, tuple[int, int]]) -> bool:
        """Return whether no link passes a pin between the layers that it joins."""
        for pin, pair in self.pins.items():
            between = self._between(pin, pair, spans)
            for link, at in self.crossings.over:
                if at == pin and link not in pair:
                    low, high = spans[link]
                    if any(low <= layer <= high for layer in between):
                        return False
        return True

    def _between(
        self, pin: str, pair: tuple[str, str], spans: Mapping[str, tuple[int, int]]
    ) -> list[int]:
        """Return the layers in which there is a pin, but neither of its links."""
        if GROUND in pair:
            low, high = spans[pair[0] if pair[1] == GROUND else pair[1]]
            front = [high + 1] if self.forks.get(pin) == GROUND else []
            return [*range(1, low), *front]
        if pin in self.forks:
            return []
        one, two = sorted((spans[pair[0]], spans[pair[1]]))
        return list(range(one[1] + 1, two[0]))

    def _reach(self, spans: Mapping[str, tuple[int, int]]) -> dict[str, int]:
        """Return how many layers overhung pins reach."""
        reach = {}
        for pin, pair in self.pins.items():
            one, two = sorted((0, 0) if own == GROUND else spans[own] for own in pair)
            reach[pin] = 0 if pin in self.forks else two[0] - one[1]
        return reach

    def layers(self, low: Mapping[str, int]) -> Layers:
        """Return what was found."""
        spans = self._spans(low)
        fronts = [
            spans[pair[0] if pair[1] == GROUND else pair[1]][1] + 1
            for pin, pair in self.pins.items()
            if GROUND in pair and self.forks.get(pin) == GROUND
        ]
        top = max([own[1] for own in spans.values()] + fronts)
        return Layers(spans, self._reach(spans), top + 1)


def _apart(one: tuple[int, int], two: tuple[int, int]) -> bool:
    return one[1] < two[0] or two[1] < one[0]
