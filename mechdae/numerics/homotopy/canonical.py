"""One numbering for all linkages that differ in the order of parts, pins and slides only."""

from __future__ import annotations

from collections.abc import Sequence
from functools import lru_cache

from mechdae.numerics.homotopy.linkage import PinLinkage
from mechdae.records import dataclass

Code = tuple[tuple[int, ...], ...]


@dataclass(frozen=True)
class Canonical:
    """A linkage in its canonical numbering: part k is ``parts[k]`` of the given one, and so on."""

    linkage: PinLinkage
    parts: tuple[int, ...]
    pins: tuple[int, ...]
    turns: tuple[int, ...]
    slides: tuple[int, ...]

    @property
    def name(self) -> str:
        """Return the structure as text."""
        linkage = self.linkage
        parts = ".".join("-".join(map(str, pins)) for pins in linkage.parts)
        slides = ".".join(f"{part}-{pin}" for part, pin in linkage.slides)
        return f"{parts}|{'-'.join(map(str, linkage.turns))}|{slides}"


@lru_cache(256)
def canonical(linkage: PinLinkage) -> Canonical:
    """Return a linkage in its canonical numbering; which part is fixed makes no difference."""
    turns = sorted(set(linkage.turns))
    pins = sorted({p for part in linkage.parts for p in part} | {p for _, p in linkage.slides})
    parts = range(len(linkage.parts))
    nodes: list[tuple[str, int]] = [
        *(("turn", k) for k in turns),
        *(("part", k) for k in parts),
        *(("pin", k) for k in pins),
        *(("slide", k) for k in range(len(linkage.slides))),
    ]
    place = {node: k for k, node in enumerate(nodes)}
    edges = [(place["turn", turn], place["part", k]) for k, turn in enumerate(linkage.turns)]
    edges += [(place["part", k], place["pin", p]) for k in parts for p in linkage.parts[k]]
    for k, (part, pin) in enumerate(linkage.slides):
        edges += [(place["slide", k], place["part", part]), (place["slide", k], place["pin", pin])]
    kinds = ("turn", "part", "pin", "slide")
    order = canonical_order([kinds.index(kind) for kind, _ in nodes], edges)
    ranked = [nodes[k] for k in order]
    number = {
        node: sum(other[0] == node[0] for other in ranked[:k]) for k, node in enumerate(ranked)
    }
    new_turns, new_parts, new_pins, new_slides = (
        tuple(k for kind, k in ranked if kind == colour) for colour in kinds
    )
    return Canonical(
        PinLinkage(
            tuple(tuple(sorted(number["pin", p] for p in linkage.parts[k])) for k in new_parts),
            tuple(number["turn", linkage.turns[k]] for k in new_parts),
            tuple(
                (number["part", part], number["pin", pin])
                for part, pin in (linkage.slides[k] for k in new_slides)
            ),
        ),
        new_parts,
        new_pins,
        new_turns,
        new_slides,
    )


def canonical_order(colours: Sequence[int], edges: Sequence[tuple[int, int]]) -> list[int]:
    """Return the nodes of a coloured graph in an order that its numbering does not change.

    Colours are refined by those of the neighbours; where that leaves nodes alike, each of them
    comes first in turn and the least picture of the graph counts.
    """
    beside: list[list[int]] = [[] for _ in colours]
    for u, v in edges:
        beside[u].append(v)
        beside[v].append(u)

    def refined(colours: list[int]) -> list[int]:
        while True:
            seen = [
                (c, tuple(sorted(colours[v] for v in beside[u]))) for u, c in enumerate(colours)
            ]
            names = {key: k for k, key in enumerate(sorted(set(seen)))}
            ahead = [names[key] for key in seen]
            if len(names) == len(set(colours)):
                return ahead
            colours = ahead

    def least(colours: list[int]) -> tuple[Code, list[int]]:
        colours = refined(colours)
        cells: dict[int, list[int]] = {}
        for u, c in enumerate(colours):
            cells.setdefault(c, []).append(u)
        alike = [cell for _, cell in sorted(cells.items()) if len(cell) > 1]
        if not alike:
            code = [tuple(sorted(colours[v] for v in beside[u])) for u in range(len(colours))]
            order = sorted(range(len(colours)), key=colours.__getitem__)
            return tuple(code[u] for u in order), order
        cell = min(alike, key=len)
        if _twins(cell, beside):
            cell = cell[:1]
        return min(least([2 * c - (u == first) for u, c in enumerate(colours)]) for first in cell)

    return least(list(colours))[1]


def _twins(cell: list[int], beside: list[list[int]]) -> bool:
    """Return whether nodes have the same neighbours: then each may come first."""
    return len({tuple(sorted(beside[u])) for u in cell}) == 1
