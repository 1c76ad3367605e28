"""Independent cycles of a graph whose edges have names."""

from __future__ import annotations

from collections.abc import Mapping

Cycle = list[tuple[str, bool]]
"""Edges in the order in which they are passed, and whether from their first end to the second."""


def shortest_cycles(edges: Mapping[str, tuple[str, str]], start: str) -> list[Cycle]:
    """Return independent cycles, as many as there are, shortest first (Horton's set).

    Parameters
    ----------
    edges
        Name -> its two vertices; several edges may join the same two.
    start
        A cycle that passes this vertex begins there.

    Source: J. D. Horton, A polynomial-time algorithm to find the shortest cycle basis of a graph,
    SIAM J. Comput. 16 (1987) 358-366.
    """
    vertices = list(dict.fromkeys([start, *(v for pair in edges.values() for v in pair)]))
    candidates: list[Cycle] = []
    for vertex in vertices:
        paths = _paths(edges, vertex)
        for name, (one, other) in edges.items():
            if one not in paths or other not in paths:
                continue
            there, back = paths[one], paths[other]
            if {edge for edge, _ in there} & {edge for edge, _ in back} or any(
                edge == name for edge, _ in (*there, *back)
            ):
                continue
            candidates.append(
                [*there, (name, True), *((edge, not way) for edge, way in reversed(back))]
            )
    order = {name: k for k, name in enumerate(edges)}
    candidates.sort(key=lambda cycle: (len(cycle), sorted(order[name] for name, _ in cycle)))
    basis: dict[int, int] = {}
    found: list[Cycle] = []
    for cycle in candidates:
        bits = sum(1 << order[name] for name, _ in cycle)
        for top in sorted(basis, reverse=True):
            if bits >> top & 1:
                bits ^= basis[top]
        if bits:
            basis[bits.bit_length() - 1] = bits
            found.append(_from(cycle, edges, start))
    return found


def joined(cycles: list[Cycle], edges: Mapping[str, tuple[str, str]]) -> list[Cycle]:
    """Return cycles of which any two that meet in a vertex alone are also passed as one.

    A cycle that shares no edge with those before it is replaced by its sum with one that it meets.
    """
    found: list[Cycle] = []
    left = list(cycles)
    while left:
        vertices = {vertex for cycle in found for vertex in _starts(cycle, edges)}
        near = (k for k, cycle in enumerate(left) if vertices & {*_starts(cycle, edges)})
        found.append(_passed_with(found, left.pop(next(near, 0)), edges))
    return found


def _passed_with(found: list[Cycle], cycle: Cycle, edges: Mapping[str, tuple[str, str]]) -> Cycle:
    """Return a cycle, with the first that it meets where it shares no edge with any."""
    if {name for other in found for name, _ in other} & {name for name, _ in cycle}:
        return cycle
    starts = {vertex: k for k, vertex in enumerate(_starts(cycle, edges))}
    for other in found:
        for k, vertex in enumerate(_starts(other, edges)):
            if vertex in starts:
                at = starts[vertex]
                return [*other[k:], *other[:k], *cycle[at:], *cycle[:at]]
    return cycle


def _starts(cycle: Cycle, edges: Mapping[str, tuple[str, str]]) -> list[str]:
    return [edges[name][0 if way else 1] for name, way in cycle]


def _paths(edges: Mapping[str, tuple[str, str]], start: str) -> dict[str, Cycle]:
    """Return a shortest path to each vertex, by breadth."""
    paths: dict[str, Cycle] = {start: []}
    front = [start]
    for vertex in front:  # grows while it is read
        for name, (one, other) in edges.items():
            for here, there, way in ((one, other, True), (other, one, False)):
                if here == vertex and there not in paths:
                    paths[there] = [*paths[vertex], (name, way)]
                    front.append(there)
    return paths


def _from(cycle: Cycle, edges: Mapping[str, tuple[str, str]], start: str) -> Cycle:
    """Return a cycle that begins at a vertex if it passes there."""
    for k, (name, way) in enumerate(cycle):
        if edges[name][0 if way else 1] == start:
            return cycle[k:] + cycle[:k]
    return cycle
