"""A chain with dimensions: a mechanism that stands in the pose in which it is drawn.

Distances in the plane follow those in the graph (Kamada and Kawai 1989), by classical scaling and
majorisation; a small fixed disturbance keeps lengths from being equal, where a mechanism would
have change points.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from itertools import count
from math import atan2

import numpy as np
from numpy.typing import NDArray

from mechdae.describe import GROUND, Body, Driver, Ground, Joint, Mechanism, Problem, Sweep, Table
from mechdae.describe.joints.pairs import Prismatic, Revolute
from mechdae.describe.values import Number
from mechdae.errors import InputError
from mechdae.parts.types.chains.chains import KinematicChain

SIDE = 0.1
"""Of a link between two joints, about, m."""


def letters(number: int) -> list[str]:
    """Return names of joints: A to Z, then A1, B1, ..."""
    alphabet = "ABCDEFGHJKLMNPQRSTUVWXYZ"  # I and O look like numbers
    names = (f"{letter}{turn or ''}" for turn in count() for letter in alphabet)
    return [next(names) for _ in range(number)]


def mechanism_of(
    chain: KinematicChain, places: Sequence[Sequence[float]] | None = None
) -> Mechanism:
    """Return a mechanism of this chain.

    Parameters
    ----------
    chain
        Without a `fixed` link the first one is the frame, without `pairs` all are revolute.
    places
        Of the joints, m; absent: from the graph, about 0.1 m apart on a link. A prismatic joint
        slides along the line to the middle of the other joints of its first link.

    Returns
    -------
    Mechanism
        Bodies by their numbers, sketched where it assembles.

    Raises
    ------
    InputError
        Places that are not one of each joint.

    Examples
    --------
    >>> list(md.mechanism_of(next(md.chains(6))).bodies)
    ['link1', 'link2', 'link3', 'link4', 'link5']
    """
    frame = chain.fixed or 0
    if places is None:
        places = (SIDE * joint_places(chain)).tolist()
    if len(places) != len(chain.joints):
        raise InputError(
            f"{len(chain.joints)} joints need as many places, not {len(places)}", where="places"
        )
    names = letters(len(chain.joints))
    of_link: list[list[int]] = [[] for _ in range(chain.links)]
    for k, joint in enumerate(chain.joints):
        for link in joint:
            of_link[link].append(k)
    bodies = {frame: GROUND} | {
        link: f"link{number}"
        for number, link in enumerate((k for k in range(chain.links) if k != frame), start=1)
    }
    points: dict[int, Table[tuple[Number, ...]]] = {
        link: Table(
            {
                names[k]: tuple(
                    place - start
                    for place, start in zip(
                        places[k],
                        (0.0, 0.0) if link == frame else places[in_link[0]],
                        strict=True,
                    )
                )
                for k in in_link
            }
        )
        for link, in_link in enumerate(of_link)
    }
    joints: dict[str, Joint] = {}
    for k, joint in enumerate(chain.joints):
        first, second = sorted(joint, key=lambda link: link != frame)
        ends = (f"{bodies[first]}.{names[k]}", f"{bodies[second]}.{names[k]}")
        if chain.pairs and chain.pairs[k] == "P":
            others = [places[other] for other in of_link[first] if other != k]
            x, y = (sum(p[a] for p in others) / len(others) - places[k][a] for a in (0, 1))
            joints[names[k]] = Prismatic(names[k], *ends, axis=atan2(y, x))
        else:
            joints[names[k]] = Revolute(names[k], *ends)
    moving = {bodies[link]: Body(bodies[link], points[link]) for link in bodies if link != frame}
    sketch = dict.fromkeys(moving, 0.0) | {
        f"{name}.{point[0]}.{axis}": float(value)
        for link, name in bodies.items()
        if link != frame
        for point in ((names[of_link[link][0]], *places[of_link[link][0]]),)
        for axis, value in zip("xy", point[1:], strict=True)
    }
    return Mechanism(
        ground=Ground(points[frame]),
        bodies=Table(moving),
        joints=Table(joints),
        sketch=Table(sketch),
    )


def problem_of(chain: KinematicChain, name: str = "chain") -> Problem:
    """Return a problem with this chain: a sweep of its driving joint over all it can reach.

    Parameters
    ----------
    chain
        With a `driver`; without one the first joint of the frame drives it.
    name
        Of the problem.

    Returns
    -------
    Problem
        With one task.

    Raises
    ------
    InputError
        A chain with several freedoms has no task with one driver; what is no chain.

    Examples
    --------
    >>> problem = md.problem_of(next(md.chains(6)))
    >>> list(problem.tasks)
    ['range']
    """
    if not isinstance(chain, KinematicChain):
        raise InputError(
            f"a KinematicChain is needed, not a {type(chain).__name__}",
            where="chain",
            hint="md.Problem(mechanism, tasks={...})",
        )
    if chain.freedoms != 1:
        raise InputError(f"a chain with {chain.freedoms} freedoms needs as many drivers")
    frame = chain.fixed or 0
    at_frame = [k for k, joint in enumerate(chain.joints) if frame in joint]
    driver = at_frame[0] if chain.driver is None else chain.driver
    letter = letters(len(chain.joints))[driver]
    kind = "slide" if chain.pairs and chain.pairs[driver] == "P" else "angle"
    drive = Driver(f"{letter}.{kind}", range="assembled")
    drawn = mechanism_of(chain)
    drawn = replace(drawn, sketch=Table({**drawn.sketch, letter: 0.0}))
    return Problem(drawn, Table({"range": Sweep(driver=drive)}), name=name, title=title(chain))


def title(chain: KinematicChain) -> str:
    binary = chain.degrees.count(2)
    others = sorted(degree for degree in chain.degrees if degree > 2)
    sizes = [f"{others.count(d)} of {d} joints" for d in sorted(set(others))]
    return f"{chain.links} links, {len(chain.joints)} joints: " + ", ".join(
        [f"{binary} binary", *sizes]
    )


ROUNDS = 200
SHIFT = 0.08
"""Of the disturbance, in sides of links."""


def joint_places(chain: KinematicChain) -> NDArray[np.float64]:
    """Return a place for each joint (joints, 2), joints on one link about a side 1 apart."""
    joints = [set(joint) for joint in chain.joints]
    edges = [
        (i, j)
        for i in range(len(joints))
        for j in range(i + 1, len(joints))
        if joints[i] & joints[j]
    ]
    places = _spread(len(joints), edges)
    angles = 2.4 * np.arange(len(joints))  # the golden angle: no two shifts are alike
    return places + SHIFT * np.stack([np.cos(angles), np.sin(angles)], axis=1)


def link_places(chain: KinematicChain) -> NDArray[np.float64]:
    """Return a place for each link as a vertex of the chain's graph (links, 2)."""
    return _spread(chain.links, chain.joints)


def _spread(count: int, edges: Sequence[tuple[int, int]]) -> NDArray[np.float64]:
    """Return places whose distances are near those in the graph."""
    wanted = _distances(count, edges)
    centred = np.eye(count) - 1 / count
    values, vectors = np.linalg.eigh(-0.5 * centred @ wanted**2 @ centred)
    places = vectors[:, -2:] * np.sqrt(np.maximum(values[-2:], 0.0))
    signs = np.sign(places[np.argmax(np.abs(places) > 1e-9, axis=0), range(2)])
    places = places * np.where(signs == 0, 1.0, signs)
    angles = 2.4 * np.arange(count)
    places = places + 0.01 * np.stack([np.cos(angles), np.sin(angles)], axis=1)
    weights = 1 / np.maximum(wanted, 1.0) ** 2
    np.fill_diagonal(weights, 0.0)
    laplacian = np.diag(weights.sum(axis=1)) - weights
    inverse = np.linalg.pinv(laplacian)
    for _ in range(ROUNDS):  # Guttman's transform
        apart = np.linalg.norm(places[:, None] - places[None], axis=2)
        np.fill_diagonal(apart, 1.0)
        pull = -weights * wanted / np.maximum(apart, 1e-9)
        np.fill_diagonal(pull, 0.0)
        np.fill_diagonal(pull, -pull.sum(axis=1))
        places = inverse @ pull @ places
    return np.asarray(places)


def _distances(count: int, edges: Sequence[tuple[int, int]]) -> NDArray[np.float64]:
    """Return the number of edges between any two vertices (Floyd and Warshall)."""
    apart = np.full((count, count), float(count))
    np.fill_diagonal(apart, 0.0)
    for i, j in edges:
        apart[i, j] = apart[j, i] = 1.0
    for k in range(count):
        apart = np.minimum(apart, apart[:, [k]] + apart[[k]])
    return apart
