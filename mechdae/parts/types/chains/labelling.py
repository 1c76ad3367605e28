"""Canonical forms and automorphisms of small graphs with coloured vertices and labelled edges.

Colour refinement and individualisation, every leaf of the search visited: the graphs of polygonal
links have at most some ten vertices, where this takes less time than clever pruning would save
(McKay and Piperno, Practical graph isomorphism II, 2014, for what larger graphs need).
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence

Matrix = tuple[tuple[int, ...], ...]
"""Labels of the edges, symmetric, 0 where there is none."""
Permutation = tuple[int, ...]
"""Where each vertex goes."""


def canonical(colours: Sequence[int], matrix: Matrix) -> tuple[tuple[int, ...], list[int]]:
    """Return a form that isomorphic graphs share, and the vertices in its order.

    `colours`: a number for each vertex; only vertices of one colour can take each other's places.
    """
    best: tuple[tuple[int, ...], list[int]] | None = None
    for order in _leaves(matrix, _ranked(list(colours)), twins=True):
        form = _form(colours, matrix, order)
        if best is None or form < best[0]:
            best = form, order
    assert best is not None
    return best


def automorphisms(colours: Sequence[int], matrix: Matrix) -> list[Permutation]:
    """Return all permutations of the vertices that change neither colours nor labels."""
    first: tuple[tuple[int, ...], list[int]] | None = None
    found = []
    for order in _leaves(matrix, _ranked(list(colours)), twins=False):
        form = _form(colours, matrix, order)
        if first is None:
            first = form, order
        if form == first[0]:
            image = [0] * len(order)
            for vertex, to in zip(first[1], order, strict=True):
                image[vertex] = to
            found.append(tuple(image))
    return found


def _form(colours: Sequence[int], matrix: Matrix, order: list[int]) -> tuple[int, ...]:
    """Return the colours and the upper triangle of the matrix in this order."""
    rows = [matrix[v] for v in order]
    return (
        *(colours[v] for v in order),
        *(row[w] for k, row in enumerate(rows) for w in order[k + 1 :]),
    )


def _ranked(keys: Sequence[object]) -> list[int]:
    """Return the rank of each key among the different ones."""
    ranks = {key: k for k, key in enumerate(sorted(set(keys)))}  # type: ignore[type-var]
    return [ranks[key] for key in keys]


def _refined(matrix: Matrix, colours: list[int]) -> list[int]:
    """Return the coarsest colours in which equal vertices have equal neighbours."""
    count = len(set(colours))
    while count < len(colours):
        keys = [
            (c, tuple(sorted((label, d) for label, d in zip(row, colours, strict=True) if label)))
            for c, row in zip(colours, matrix, strict=True)
        ]
        colours = _ranked(keys)
        if count == (count := len(set(colours))):
            break
    return colours


def _leaves(matrix: Matrix, colours: list[int], twins: bool) -> Iterator[list[int]]:
    """Yield the orders of the vertices at the leaves of the search.

    With `twins`, of vertices that may be swapped without any other change only the first is tried.
    """
    colours = _refined(matrix, colours)
    cells: dict[int, list[int]] = {}
    for vertex, colour in enumerate(colours):
        cells.setdefault(colour, []).append(vertex)
    if len(cells) == len(colours):
        yield sorted(range(len(colours)), key=colours.__getitem__)
        return
    cell = min((c for c in cells.values() if len(c) > 1), key=lambda c: (len(c), colours[c[0]]))
    tried: list[int] = []
    for vertex in cell:
        if twins and any(_twins(matrix, vertex, other) for other in tried):
            continue
        tried.append(vertex)
        apart = [2 * c + 1 for c in colours]
        apart[vertex] -= 1
        yield from _leaves(matrix, _ranked(apart), twins)


def _twins(matrix: Matrix, one: int, two: int) -> bool:
    """Tell whether swapping the two vertices leaves the matrix as it is."""
    return all(
        a == b
        for k, (a, b) in enumerate(zip(matrix[one], matrix[two], strict=True))
        if k not in (one, two)
    )
