"""Graphs of the links with three joints and more, joined by paths of binary links.

A chain is such a *contracted* graph with the number of binary links on each of its edges.
Contracted graphs are built by giving one vertex after the other all its edges, equal ones kept
once at every step; then binary links are laid on the edges, of equal layings the first in
lexicographic order is kept. Counting so is the way of the atlas literature (Woo 1967, Mruthyunjaya
1984, Ding and Huang 2010); the code is from the definitions.
"""

from __future__ import annotations

from collections.abc import Iterator
from itertools import combinations

from mechdae.parts.types.chains.labelling import Matrix, Permutation, automorphisms, canonical
from mechdae.records import dataclass

Laid = tuple[tuple[int, ...], ...]
"""For each pair of vertices that is joined, the numbers of binary links on its edges, ascending."""


@dataclass(frozen=True)
class Contracted:
    """A chain by its polygonal links.

    ``symmetries``: permutations of the polygonal links under which all this stays.
    """

    count: int
    pairs: tuple[tuple[int, int], ...]
    laid: Laid
    symmetries: tuple[Permutation, ...]


def contracted(links: int, freedoms: int, rigid: bool = False) -> Iterator[Contracted]:
    """Yield the biconnected chains with polygonal links, each once.

    `links`, `freedoms`: of the chain: it has (3 (links - 1) - freedoms)/2 joints. `rigid`: also
    chains in which a part of the links has no freedom left.
    """
    for degrees in _degrees(links - 3 - freedoms):
        binaries = links - len(degrees)
        if len(degrees) < 2 or binaries < 0:
            continue
        for matrix in _multigraphs(degrees, binaries, rigid):
            group = automorphisms(degrees, matrix)
            yield from _laid(matrix, binaries, freedoms, group, rigid)


def _degrees(excess: int, least: int = 1) -> Iterator[tuple[int, ...]]:
    """Yield ascending degrees of at least three with this sum of what they have above two."""
    if excess == 0:
        yield ()
    for first in range(least, excess + 1):
        for rest in _degrees(excess - first, first):
            yield (first + 2, *rest)


def _multigraphs(degrees: tuple[int, ...], binaries: int, rigid: bool) -> list[Matrix]:
    """Return the biconnected multigraphs with these degrees, each once.

    Two links with more than three parallel edges leave a rigid part unless all others carry two
    binary links. In a chain at most one edge of a pair is without binary links.
    """
    most = 1 + binaries if rigid else 3 + binaries // 2
    empty = tuple((0,) * len(degrees) for _ in degrees)
    level = {canonical(_left(degrees, empty), empty)[0]: (degrees, empty)}
    for _ in degrees:
        following = {}
        for known, matrix in level.values():
            left = _left(known, matrix)
            vertex = next((k for k, free in enumerate(left) if free), None)
            if vertex is None:
                following[canonical(known, matrix)[0]] = known, matrix
                continue
            for grown in _saturated(matrix, left, vertex, most):
                colours = [
                    d * 64 + free for d, free in zip(known, _left(known, grown), strict=True)
                ]
                form, order = canonical(colours, grown)
                if form not in following:
                    following[form] = (
                        tuple(known[v] for v in order),
                        tuple(tuple(grown[v][w] for w in order) for v in order),
                    )
        level = following
    ascending = []
    for known, matrix in level.values():
        if not any(_left(known, matrix)) and _biconnected(matrix):
            order = sorted(range(len(known)), key=known.__getitem__)
            ascending.append(tuple(tuple(matrix[v][w] for w in order) for v in order))
    return ascending


def _left(degrees: tuple[int, ...], matrix: Matrix) -> list[int]:
    """Return how many edges each vertex still lacks."""
    return [degree - sum(row) for degree, row in zip(degrees, matrix, strict=True)]


def _saturated(matrix: Matrix, left: list[int], vertex: int, most: int) -> Iterator[Matrix]:
    """Yield the graphs in which this vertex has all its edges."""
    others = [k for k, free in enumerate(left) if free and k != vertex]

    def spread(total: int, at: int) -> Iterator[tuple[int, ...]]:
        if at == len(others):
            if total == 0:
                yield ()
            return
        for here in range(min(total, left[others[at]], most) + 1):
            for rest in spread(total - here, at + 1):
                yield (here, *rest)

    for numbers in spread(left[vertex], 0):
        rows = [list(row) for row in matrix]
        for other, number in zip(others, numbers, strict=True):
            rows[vertex][other] = rows[other][vertex] = number
        yield tuple(map(tuple, rows))


def _biconnected(matrix: Matrix) -> bool:
    """Tell whether the graph stays connected without any one vertex."""
    everything = range(len(matrix))
    if not _connected(matrix, set(everything)):
        return False
    return len(matrix) == 2 or all(_connected(matrix, set(everything) - {k}) for k in everything)


def _connected(matrix: Matrix, vertices: set[int]) -> bool:
    reached, front = set(), [min(vertices)]
    while front:
        vertex = front.pop()
        if vertex not in reached:
            reached.add(vertex)
            front += [w for w in vertices - reached if matrix[vertex][w]]
    return reached == vertices


def _laid(
    matrix: Matrix, binaries: int, freedoms: int, group: list[Permutation], rigid: bool
) -> Iterator[Contracted]:
    """Yield all ways to lay binary links on the edges that the group does not make equal."""
    count = len(matrix)
    pairs = [(u, v) for u, v in combinations(range(count), 2) if matrix[u][v]]
    place = {pair: k for k, pair in enumerate(pairs)}
    images = [tuple(place[tuple(sorted((g[u], g[v])))] for u, v in pairs) for g in group]  # type: ignore[index]
    longest = binaries if rigid else freedoms + 1
    for laid in _layings([matrix[u][v] for u, v in pairs], binaries, longest):
        if not rigid and _has_rigid_part(count, pairs, laid):
            continue
        same = []
        for g, image in zip(group, images, strict=True):
            moved: list[tuple[int, ...]] = [()] * len(laid)
            for k, to in enumerate(image):
                moved[to] = laid[k]
            if tuple(moved) < laid:
                break
            if tuple(moved) == laid:
                same.append(g)
        else:
            yield Contracted(count, tuple(pairs), laid, tuple(same))


def _layings(edges: list[int], binaries: int, longest: int) -> Iterator[Laid]:
    """Yield binary links spread over the edges of each pair, one direct joint in a pair at most."""
    capacity = sum(edges) * longest
    least = sum(number - 1 for number in edges)

    def spread(at: int, left: int, room: int, need: int) -> Iterator[Laid]:
        if left > room or left < need:
            return
        if at == len(edges):
            yield ()
            return
        number = edges[at]
        for parts in _ascending(number, min(left, number * longest), longest):
            after = left - sum(parts), room - number * longest, need - number + 1
            for rest in spread(at + 1, *after):
                yield (parts, *rest)

    yield from spread(0, binaries, capacity, least)


def _ascending(count: int, most: int, longest: int, least: int = 0) -> Iterator[tuple[int, ...]]:
    """Yield ascending numbers up to `longest` with a sum up to `most`; one of them may be 0."""
    if count == 0:
        yield ()
        return
    for first in range(least, min(most // count, longest) + 1):
        for rest in _ascending(count - 1, most - first, longest, max(first, 1)):
            yield (first, *rest)


def _has_rigid_part(count: int, pairs: list[tuple[int, int]], laid: Laid) -> bool:
    """Tell whether a proper part of the links has no freedom.

    The part of some polygonal links that moves least has all paths between them with fewer than
    two binary links: each takes 2 - b freedoms away.
    """
    takes = [sum(2 - b for b in polygon if b < 2) for polygon in laid]
    within = [0] * (1 << count)
    for (u, v), take in zip(pairs, takes, strict=True):
        if take:
            within[1 << u | 1 << v] = take
    for k in range(count):  # sums over subsets
        bit = 1 << k
        for mask in range(1 << count):
            if mask & bit:
                within[mask] += within[mask ^ bit]
    whole = (1 << count) - 1
    complete = all(b < 2 for polygon in laid for b in polygon)
    return any(
        3 * (mask.bit_count() - 1) - within[mask] < 1
        for mask in range(1, whole + 1)
        if mask & (mask - 1) and not (mask == whole and complete)
    )
