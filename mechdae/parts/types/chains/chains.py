"""Kinematic chains with simple joints: all of a size, and what differs in one."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import field, replace
from functools import cached_property
from itertools import pairwise, permutations, product

from mechdae.errors import InputError
from mechdae.parts.types.chains.polygons import Contracted, contracted
from mechdae.records import dataclass

LARGEST = 14
"""Links of the chains that are listed."""


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

    Raises
    ------
    InputError
        Fewer links than a loop has, more than can be listed, a parity that fits no joints.
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
    """Return how many `chains` there are; kinds of pairs are counted without listing them."""
    found = chains(links, freedoms, inversions=inversions, drivers=drivers)
    return sum(chain.count_pairs() if pairs else 1 for chain in found)


def assur_groups(links: int) -> Iterator[KinematicChain]:
    """Yield the Assur groups with simple joints: trusses of one more link, one link of each taken.

    Parameters
    ----------
    links
        Of the group, an even number. The link that stands for all that the group hangs on is
        `fixed`; joints on it are the group's outer joints.
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
    """Return the chain that is one closed loop."""
    around = range(links)
    turns = [tuple((s + d * k) % links for k in around) for s in around for d in (1, -1)]
    joints = tuple(sorted(tuple(sorted((k, (k + 1) % links))) for k in around))
    return KinematicChain(links, joints, freedoms, _turns=tuple(turns))  # type: ignore[arg-type]


def _expanded(graph: Contracted, links: int, freedoms: int) -> KinematicChain:
    """Return the chain with its binary links as links."""
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
