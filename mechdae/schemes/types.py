"""Schemes out of kinematic chains: fixed link, driver and tracing link chosen, all groups dyads."""

from __future__ import annotations

from collections.abc import Iterator

from mechdae.composition.chains import KinematicChain, chains
from mechdae.errors import UnknownName
from mechdae.schemes.scheme import CRANK, DYAD, FIXED, RIGID, Point, Scheme

NAMES = {"four-bar": (4, 1), "watt": (6, 1), "stephenson": (6, 2)}
"""Names of chains: links, and their place in the order of `chains`, from 1."""


def chain_names(links: int) -> list[str]:
    """Return the names of the chains with so many links: `6-1`, `6-2`, ..."""
    return [f"{links}-{k}" for k, _ in enumerate(chains(links), start=1)]


def named(name: str, most: int, where: str = "") -> tuple[int, int]:
    """Return links and place of a chain by its name.

    Raises
    ------
    UnknownName
        There is no such chain up to `most` links.
    """
    if name in NAMES and NAMES[name][0] <= most:
        return NAMES[name]
    links, _, place = name.partition("-")
    whole = links.isdigit() and place.isdigit() and int(links) in range(4, most + 1, 2)
    if whole and 1 <= int(place) <= len(chain_names(int(links))):
        return int(links), int(place)
    known = [word for word, (size, _) in NAMES.items() if size <= most]
    known += [own for size in range(4, min(most, 8) + 1, 2) for own in chain_names(size)]
    raise UnknownName("chain", name, known, where=where)


def schemes_of(links: int, place: int) -> list[Scheme]:
    """Return the schemes of one chain: each fixed link, crank and tracing link that differ."""
    found: dict[str, Scheme] = {}
    for number, chain in enumerate(chains(links), start=1):
        if number != place:
            continue
        for inversion in chain.inversions():
            for driven in inversion.drivers():
                for scheme in _traced(driven):
                    found.setdefault(scheme.text, scheme)
    return list(found.values())


def _traced(chain: KinematicChain) -> Iterator[Scheme]:
    """Yield the schemes of a chain with frame and driver, one for each link that may trace."""
    points, frames = _placed(chain)
    if points is None:
        return
    fixed = {k for k, own in enumerate(points) if own[0] == FIXED}
    for own in frames.values():
        if fixed & set(own) or own[:2] == [0, 1]:
            continue  # the frame, the crank, and links on the frame trace arcs at most
        whole = Scheme((*points, (RIGID, own[0], own[1])), len(points))
        if whole.pruned()[0].size == whole.size:
            yield whole
    for k, (kind, i, j) in enumerate(points):
        if kind == DYAD and not {i, j} & fixed:
            whole = Scheme(tuple(points), k)
            if whole.pruned()[0].size == whole.size:
                yield whole


def _placed(chain: KinematicChain) -> tuple[list[Point] | None, dict[int, list[int]]]:
    """Return the points of a chain, and those of each link; None where a group is no dyad."""
    frame, driver = chain.fixed, chain.driver
    assert frame is not None
    assert driver is not None
    one, other = chain.joints[driver]
    crank = other if one == frame else one
    points: list[Point] = [(FIXED, 0, 0)]
    frames: dict[int, list[int]] = {frame: [0], crank: [0]}
    at = {driver: 0}

    def put(joint: int, link: int) -> int:
        """Return the point of a joint on a link that is placed."""
        own = frames[link]
        if link == frame:
            points.append((FIXED, 0, 0))
        elif len(own) == 1:
            points.append((CRANK, 0, 0))
        else:
            points.append((RIGID, own[0], own[1]))
        at[joint] = len(points) - 1
        own.append(at[joint])
        return at[joint]

    def outer(link: int) -> tuple[int, int] | None:
        """Return the one joint of a link with those that are placed, and that other link."""
        for k, joint in enumerate(chain.joints):
            if link in joint and k not in at:
                far = joint[0] if joint[1] == link else joint[1]
                if far in frames:
                    return k, far
        return None

    while len(frames) < chain.links:
        for k, (u, v) in enumerate(chain.joints):
            if u in frames or v in frames:
                continue
            first, second = outer(u), outer(v)
            if first is None or second is None:
                continue
            i, j = put(*first), put(*second)
            points.append((DYAD, i, j))
            at[k] = len(points) - 1
            frames[u], frames[v] = [i, at[k]], [j, at[k]]
            break
        else:
            return None, frames
    if points[1][0] != CRANK:  # the crank's pin is point 1
        place = next(k for k, own in enumerate(points) if own[0] == CRANK)
        order = [0, place, *(k for k in range(1, len(points)) if k != place)]
        to = {old: new for new, old in enumerate(order)}
        points = [(own[0], to[own[1]], to[own[2]]) for own in (points[k] for k in order)]
        frames = {link: [to[k] for k in own] for link, own in frames.items()}
    return points, frames
