"""Kinematic chains with simple joints: all of a size, and what differs in one."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import field, replace
from functools import cached_property
from itertools import combinations, pairwise, permutations, product

from mechdae.errors import InputError
from mechdae.parts.types.chains.labelling import Matrix, Permutation, automorphisms, canonical
from mechdae.records import dataclass

Laid = tuple[tuple[int, ...], ...]
"""For each pair of vertices that is joined, the numbers of binary links on its edges, ascending."""
LARGEST = 14
"""Links of the chains that are listed."""


@dataclass(frozen=True)
class Contracted:
    """A chain by its polygonal links."""

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
    for laying in _layings([matrix[u][v] for u, v in pairs], binaries, longest):
        if not rigid and _has_rigid_part(count, pairs, laying):
            continue
        same = []
        for g, image in zip(group, images, strict=True):
            moved: list[tuple[int, ...]] = [()] * len(laying)
            for k, to in enumerate(image):
                moved[to] = laying[k]
            if tuple(moved) < laying:
                break
            if tuple(moved) == laying:
                same.append(g)
        else:
            yield Contracted(count, tuple(pairs), laying, tuple(same))


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


@dataclass(frozen=True)
class KinematicChain:
    """Links and simple joints; on request a fixed link, the driving joint, kinds of pairs.

    Attributes
    ----------
    links
        How many; they are numbered from 0, links with most joints last among the polygonal ones,
        then binary links.
    joints
        The two links of each joint.
    freedoms
        3 (links - 1) - 2 joints; 0 for a truss.
    fixed
        Number of the link that is the frame.
    driver
        Index of the driving joint.
    pairs
        One letter for each joint, R or P.

    Examples
    --------
    >>> chain = next(md.chains(4))
    >>> chain.links, chain.joints, chain.freedoms
    (4, ((0, 1), (0, 3), (1, 2), (2, 3)), 1)
    """

    links: int
    joints: tuple[tuple[int, int], ...]
    freedoms: int
    fixed: int | None = None
    driver: int | None = None
    pairs: str | None = None
    _turns: tuple[tuple[int, ...], ...] = field(default=(), repr=False, compare=False)
    _swaps: tuple[tuple[tuple[int, ...], ...], ...] = field(default=(), repr=False, compare=False)

    @property
    def degrees(self) -> tuple[int, ...]:
        """Joints on each link."""
        counts = [0] * self.links
        for joint in self.joints:
            for link in joint:
                counts[link] += 1
        return tuple(counts)

    @cached_property
    def symmetries(self) -> list[tuple[tuple[int, ...], tuple[int, ...]]]:
        """Where links and joints go under each automorphism that keeps `fixed` and `driver`."""
        found = []
        for links in self._permutations():
            joints = self._moved(links)
            if (self.fixed is None or links[self.fixed] == self.fixed) and (
                self.driver is None or joints[self.driver] == self.driver
            ):
                found.append((links, joints))
        return found

    def inversions(self) -> Iterator[KinematicChain]:
        """Yield the chain with each link fixed that differs from those before."""
        for orbit in _orbits(self.links, [links for links, _ in self.symmetries]):
            yield replace(self, fixed=orbit)

    def drivers(self) -> Iterator[KinematicChain]:
        """Yield the chain with each fixed link and driving joint on it that differ."""
        for inversion in [self] if self.fixed is not None else self.inversions():
            orbits = _orbits(len(self.joints), [joints for _, joints in inversion.symmetries])
            for joint in orbits:
                if inversion.fixed in self.joints[joint]:
                    yield replace(inversion, driver=joint)

    def with_pairs(self) -> Iterator[KinematicChain]:
        """Yield the chain with revolute (R) or prismatic (P) joints wherever that differs."""
        group = [joints for _, joints in self.symmetries]
        for word in product("RP", repeat=len(self.joints)):
            if _first(word, group):
                yield replace(self, pairs="".join(word))

    def count_pairs(self) -> int:
        """Return how many there are of `with_pairs`: Burnside's lemma."""
        group = [joints for _, joints in self.symmetries]
        return sum(1 << _cycles(joints) for joints in group) // len(group)

    def _permutations(self) -> Iterator[tuple[int, ...]]:
        """Yield every automorphism as a permutation of the links."""
        for turn in self._turns:
            for choice in product(*(permutations(range(len(paths))) for paths in self._swaps)):
                links = list(turn)
                for paths, order in zip(self._swaps, choice, strict=True):
                    for path, other in zip(paths, order, strict=True):
                        for one, two in zip(path, paths[other], strict=True):
                            links[one] = turn[two]
                yield tuple(links)

    def _moved(self, links: tuple[int, ...]) -> tuple[int, ...]:
        """Return where each joint goes when the links do."""
        place = {frozenset(joint): k for k, joint in enumerate(self.joints)}
        return tuple(place[frozenset((links[u], links[v]))] for u, v in self.joints)


def chains(
    links: int,
    freedoms: int = 1,
    *,
    inversions: bool = False,
    drivers: bool = False,
    pairs: bool = False,
) -> Iterator[KinematicChain]:
    """Yield the kinematic chains with simple joints, each once, without rigid parts.

    Chains are biconnected (no link or joint cuts them in two) and no part of two links and more
    has lost its freedom. Nothing is kept: the next chain is found when it is asked for.

    Parameters
    ----------
    links
        Number of links, the frame included.
    freedoms
        Degrees of freedom; 0 gives the trusses of Baranov.
    inversions
        Each link as the frame, up to symmetry.
    drivers
        Each joint of the frame as the driver too, up to symmetry.
    pairs
        Revolute or prismatic pairs at each joint, up to symmetry; whether they move is not asked.

    Yields
    ------
    KinematicChain
        The next chain.

    Raises
    ------
    InputError
        Fewer links than a loop has, more than can be listed, a parity that fits no joints.

    Examples
    --------
    >>> sum(1 for chain in md.chains(6))
    2
    >>> next(md.chains(6)).joints
    ((0, 1), (0, 2), (0, 4), (1, 3), (1, 5), (2, 3), (4, 5))
    """
    for chain in _plain(links, freedoms):
        varied: Iterator[KinematicChain] = iter([chain])
        if inversions or drivers:
            varied = chain.inversions()
        if drivers:
            varied = (one for inversion in varied for one in inversion.drivers())
        if pairs:
            varied = (one for kind in varied for one in kind.with_pairs())
        yield from varied


def count_chains(
    links: int,
    freedoms: int = 1,
    *,
    inversions: bool = False,
    drivers: bool = False,
    pairs: bool = False,
) -> int:
    """Return how many `chains` there are; kinds of pairs are counted without listing them.

    Parameters
    ----------
    links, freedoms, inversions, drivers, pairs
        As of `chains`.

    Returns
    -------
    int
        2, 16, 230 of 6, 8, 10 links.

    Examples
    --------
    >>> md.count_chains(6), md.count_chains(8)
    (2, 16)
    """
    found = chains(links, freedoms, inversions=inversions, drivers=drivers)
    return sum(chain.count_pairs() if pairs else 1 for chain in found)


def assur_groups(links: int) -> Iterator[KinematicChain]:
    """Yield the Assur groups with simple joints: trusses of one more link, one link of each taken.

    Parameters
    ----------
    links
        Of the group, an even number. The link that stands for all that the group hangs on is
        `fixed`; joints on it are the group's outer joints.

    Yields
    ------
    KinematicChain
        A truss with a `fixed` link.

    Raises
    ------
    InputError
        An odd number of links, more than can be listed.

    Examples
    --------
    >>> [sum(1 for group in md.assur_groups(links)) for links in (2, 4)]
    [1, 2]
    """
    if links < 2 or links % 2:
        raise InputError(f"an Assur group has 2, 4, 6, ... links, not {links}", where="links")
    yield from chains(links + 1, 0, inversions=True)


def _plain(links: int, freedoms: int) -> Iterator[KinematicChain]:
    least = freedoms + 3
    if freedoms < 0 or freedoms > 3:
        raise InputError(f"0 to 3 freedoms are listed, not {freedoms}", where="freedoms")
    if links < least:
        raise InputError(
            f"a closed chain with {freedoms} freedoms has {least} links or more, not {links}",
            where="links",
        )
    if (links - least) % 2:
        raise InputError(
            f"no chain of {links} links with simple joints has F = {freedoms}",
            where="links",
            hint=f"F = 3 (links - 1) - 2 joints: {links - 1} or {links + 1} links have it",
        )
    if links > LARGEST:
        raise InputError(
            f"{links} links are more than are listed",
            where="links",
            hint=f"up to {LARGEST}; with one freedom 12 links have 6856 chains "
            "(some seconds), 14 have 318 162 (minutes)",
        )
    if links == least:
        yield _loop(links, freedoms)
        return
    for graph in contracted(links, freedoms):
        yield _expanded(graph, links, freedoms)


def _loop(links: int, freedoms: int) -> KinematicChain:
    around = range(links)
    turns = [tuple((s + d * k) % links for k in around) for s in around for d in (1, -1)]
    joints = tuple(sorted(tuple(sorted((k, (k + 1) % links))) for k in around))
    return KinematicChain(links, joints, freedoms, _turns=tuple(turns))  # type: ignore[arg-type]


def _expanded(graph: Contracted, links: int, freedoms: int) -> KinematicChain:
    number = graph.count
    joints: list[tuple[int, int]] = []
    paths: dict[tuple[int, int], list[tuple[int, ...]]] = {}
    for (u, v), labels in zip(graph.pairs, graph.laid, strict=True):
        for b in labels:
            path = tuple(range(number, number + b))
            number += b
            whole = (u, *path, v)
            joints += pairwise(whole)
            paths.setdefault((u, v), []).append(path)
    turns = []
    for symmetry in graph.symmetries:
        to = [*symmetry, *[0] * (links - graph.count)]
        for (u, v), own_paths in paths.items():
            one, two = symmetry[u], symmetry[v]
            others = paths[min(one, two), max(one, two)]
            for path, other in zip(own_paths, others, strict=True):
                for link, image in zip(path, other if one < two else other[::-1], strict=True):
                    to[link] = image
        turns.append(tuple(to))
    swaps = []
    for own_paths in paths.values():
        for length in {len(path) for path in own_paths} - {0}:
            alike = tuple(path for path in own_paths if len(path) == length)
            if len(alike) > 1:
                swaps.append(alike)
    ordered = tuple(sorted(tuple(sorted(joint)) for joint in joints))
    return KinematicChain(links, ordered, freedoms, _turns=tuple(turns), _swaps=tuple(swaps))  # type: ignore[arg-type]


def _orbits(count: int, group: list[tuple[int, ...]]) -> list[int]:
    """Return the first of each set of things that the group moves into each other."""
    return [k for k in range(count) if all(image[k] >= k for image in group)]


def _first(word: tuple[str, ...], group: list[tuple[int, ...]]) -> bool:
    """Tell whether no permutation makes a word that comes later in the alphabet."""
    return all(tuple(word[k] for k in joints) <= word for joints in group)


def _cycles(permutation: tuple[int, ...]) -> int:
    seen: set[int] = set()
    count = 0
    for start in range(len(permutation)):
        if start not in seen:
            count += 1
            while start not in seen:
                seen.add(start)
                start = permutation[start]
    return count
