"""A four-bar that moves a plane through poses, read from the places of its joints; its cognates.

Exact synthesis finds it: it assembles at every target, which says nothing about the way between
them. Roberts' cognates are the three four-bars that trace one coupler curve. Their fixed pivots
are the foci A0, B0 and C0 = A0 + (B0 - A0)(P - A)/(B - A) of the curve: the triangle of the fixed
pivots is similar to that of the coupler. Each of the three may be driven at either pivot.

Two dyads RR (Burmester) make one: a dyad holds the point w of the moving plane at a distance L from
the fixed point G, |p_j + R_j w - G| = L at pose j.

Starts for coupler curves come by variable projection: for fixed ratios of the links and a programme
of the crank the coupler point is linear in what is left: P_i = t + alpha exp(i theta2_i) + beta
exp(i theta3_i) with complex t, alpha, beta. Ratios (and spacings of the crank, where they are free)
are drawn evenly, the rest is a small least squares problem for all samples at once; the best and
mutually distant ones are kept.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from itertools import permutations
from typing import TYPE_CHECKING, Any

import numpy as np

from mechdae.errors import InputError
from mechdae.numerics.null_space import linear_fit
from mechdae.records import dataclass
from mechdae.types import Complexes, Floats, Integers, Matrix, Points

if TYPE_CHECKING:
    from numpy.random import Generator

RIDGE = 1e-12
"""Damping for each target, of coordinates of order one."""
DISTANT = 0.15
"""Starts differ by this much in the logarithm of a ratio."""


@dataclass(frozen=True)
class StartingFourBar:
    """A four-bar with its poses: lengths (4,), pivot, turn of the ground, coupler point (2,).

    ``turns`` (k,) are angles of the crank from the ground line, ``sense`` the sense in which it
    turns, ``branch`` the sign of sin(theta4 - theta3), ``residual`` the sum of squares.
    """

    lengths: Floats
    pivot: complex
    turn: float
    point: complex
    turns: Floats
    couplers: Floats
    rockers: Floats
    branch: int
    sense: int
    residual: float


def ratios(generator: Generator, count: int, kind: str) -> Floats:
    """Return ratios (r1, r3, r4)/r2 (count, 3) of a Grashof class whose crank turns fully."""
    found: list[Floats] = []
    total = 0
    while total < count:
        r = np.exp(generator.uniform(np.log(0.2), np.log(15.0), (4 * count, 3)))
        r1, r3, r4 = r.T
        if kind == "crank-rocker":
            good = (1 + r1 <= r3 + r4) & (1 + r3 <= r1 + r4) & (1 + r4 <= r1 + r3)
        else:
            good = (r1 + 1 <= r3 + r4) & (r1 + r3 <= 1 + r4) & (r1 + r4 <= 1 + r3)
        found.append(r[good])
        total += int(good.sum())
    return np.concatenate(found)[:count]


def spacings(generator: Generator, count: int, k: int) -> Floats:
    """Return angles (count, k) of a crank that visits k places in order within a turn."""
    gaps = generator.dirichlet(np.ones(k), count) * 2 * np.pi
    turned = np.cumsum(gaps, axis=1)
    return turned - turned[:, :1] + generator.uniform(0, 2 * np.pi, (count, 1))


def screened(
    targets: Points,
    generator: Generator,
    count: int,
    keep: int,
    kind: str,
    programme: Any,
    mode: str,
    frame: tuple[complex, float] | None = None,
    limits: Points | None = None,
) -> list[StartingFourBar]:
    """Return the best mutually distant starts.

    `targets` (k, 2). `programme` (k,): angles of the crank, or increments from a free start; None:
    free, in order. `mode`: "absolute", "steps", "free" (in order) or "any". `frame`: fixed pivot
    and ground direction, None where they are free. `limits` (4, 2): bounds of the lengths: samples
    beyond are ranked lower.
    """
    k = len(targets)
    P = targets[:, 0] + 1j * targets[:, 1]
    r = ratios(generator, count, kind)
    sense = generator.choice((-1, 1), count)
    branch = generator.choice((-1, 1), count)
    if mode == "absolute":
        theta2 = np.broadcast_to(programme, (count, k)).copy()
        sense[:] = 1 if programme[-1] >= programme[0] else -1
    elif mode == "steps":
        theta2 = sense[:, None] * programme + generator.uniform(0, 2 * np.pi, (count, 1))
    elif mode == "any":
        theta2 = generator.uniform(0, 2 * np.pi, (count, k))
    else:
        theta2 = sense[:, None] * spacings(generator, count, k)
    theta3, theta4 = closed_loop(r, theta2, branch)
    e2, e3 = np.exp(1j * theta2), np.exp(1j * theta3)
    size, turn, pivot, point, f = _placed(P, e2, e3, frame)
    lengths = np.stack([r[:, 0] * size, size, r[:, 1] * size, r[:, 2] * size], axis=1)
    rank = np.where((size > 0) & np.isfinite(f), f, np.inf)
    if limits is not None:
        low, high = limits.T
        beyond = np.maximum(lengths - high, 0) + np.maximum(low - lengths, 0)
        spread = np.sum(np.abs(P - P.mean()) ** 2)
        most = np.where(high > 0, high, high.max(initial=1e-300))
        rank = rank + spread * np.sum((beyond / most) ** 2, axis=1)
    return [
        StartingFourBar(
            lengths[n], complex(pivot[n]), float(turn[n]), complex(point[n]), theta2[n],
            theta3[n], theta4[n], int(branch[n]), int(sense[n]), float(f[n]),
        )
        for n in _distant(rank, np.log(r), branch, keep)
    ]  # fmt: skip


def _placed(
    P: Complexes, e2: Complexes, e3: Complexes, frame: tuple[complex, float] | None
) -> tuple[Floats, Floats, Complexes, Complexes, Floats]:
    """Return sizes, turns, pivots and coupler points (n,) that fit best, and sums of squares."""
    count, k = e2.shape
    if frame is None:
        A, b = np.stack([np.ones_like(e2), e2, e3], axis=2), P
        solution = linear_fit(A, b, least=RIDGE * k)
        pivot, alpha, beta = solution.T
        size, turn = np.abs(alpha), np.angle(alpha)
        point = beta * np.exp(-1j * turn)
    else:
        origin, fixed = frame
        Q = (P - origin) * np.exp(-1j * fixed)
        columns = np.stack([e2, e3, 1j * e3], axis=2)
        A = np.concatenate([columns.real, columns.imag], axis=1)
        b = np.concatenate([Q.real, Q.imag])
        solution = linear_fit(A, b, least=RIDGE * k)
        size, point = solution[:, 0], solution[:, 1] + 1j * solution[:, 2]
        pivot, turn = np.full(count, origin), np.full(count, fixed)
    left = np.einsum("nki,ni->nk", A, solution) - b
    return size, turn, pivot, point, np.sum(np.abs(left) ** 2, axis=1)


def _distant(rank: Floats, logs: Floats, branch: Integers, keep: int) -> list[int]:
    """Return the best samples that are distant from each other, `keep` at most."""
    chosen: list[int] = []
    for n in np.argsort(rank, kind="stable"):
        if not np.isfinite(rank[n]) or len(chosen) == keep:
            break
        near = [
            m for m in chosen
            if branch[m] == branch[n] and np.abs(logs[m] - logs[n]).max() < DISTANT
        ]  # fmt: skip
        if not near:
            chosen.append(int(n))
    return chosen


def closed_loop(r: Floats, theta2: Floats, branch: Integers) -> tuple[Floats, Floats]:
    """Return angles of coupler and rocker (n, k) for ratios (n, 3), unwrapped along the poses."""
    d = r[:, :1] - np.exp(1j * theta2)
    size = np.abs(d)
    cosine = (size**2 + r[:, 1:2] ** 2 - r[:, 2:] ** 2) / (2 * size * r[:, 1:2])
    opened = np.arccos(np.clip(cosine, -1.0, 1.0))
    theta3 = np.angle(d) + branch[:, None] * opened
    end = np.exp(1j * theta2) + r[:, 1:2] * np.exp(1j * theta3) - r[:, :1]
    return np.unwrap(theta3, axis=1), np.unwrap(np.angle(end), axis=1)


TURN = 2 * np.pi
SAME = 1e-7
"""Relative difference below which invariants agree."""
LEAST = 1e-6
"""Shortest link in sizes of the poses: pins that fall together are none."""


@dataclass(frozen=True)
class Linkage(StartingFourBar):
    """A start whose poses are exact.

    Beyond `StartingFourBar`: ``branches`` (k,) signs of sin(theta4 - theta3) at the poses,
    ``branch`` is their common sign or 0; ``sense`` is the sense in which the crank visits the
    poses in order, or 0 where neither does; ``frame`` the direction of the line from crank to
    rocker pin in the moving plane, where poses have one.
    """

    branches: Floats
    frame: float = 0.0

    @property
    def other_pivot(self) -> complex:
        """Fixed pivot of the rocker."""
        return complex(self.pivot + self.lengths[0] * np.exp(1j * self.turn))

    def points(self) -> Any:
        """Return the coupler point (k,) from lengths and crank angles alone."""
        crank, coupler, _ = self._links()
        return self.pivot + np.exp(1j * self.turn) * (crank + self.point * coupler)

    def _links(self) -> tuple[Complexes, Complexes, Complexes]:
        """Return crank pin, unit vectors of the coupler, rocker pin in the ground frame."""
        r1, r2, r3, r4 = self.lengths
        crank = r2 * np.exp(1j * self.turns)
        d = r1 - crank
        size = np.abs(d)
        cosine = np.clip((size**2 + r3**2 - r4**2) / (2 * size * r3), -1, 1)
        coupler = d / size * np.exp(1j * self.branches * np.arccos(cosine))
        return crank, coupler, crank + r3 * coupler


def linkage(
    pivot: complex, other: complex, A: Complexes, B: Complexes, P: Complexes, frame: float = 0.0
) -> Linkage:
    """Return the four-bar with crank pins `A` (k,), rocker pins `B` and coupler points `P`."""
    ground = other - pivot
    along = ground / abs(ground)
    crank, rocker, coupler = (A - pivot) / along, (B - other) / along, (B - A) / along
    lengths = np.array([abs(ground), *(np.abs(v).mean() for v in (crank, coupler, rocker))])
    point = complex(np.mean((P - A) / (B - A)) * lengths[2])
    branches = np.sign((rocker * coupler.conj()).imag)
    turns, sense = visited(np.angle(crank))
    made = Linkage(
        lengths, complex(pivot), float(np.angle(ground)), point, turns,
        np.unwrap(np.angle(coupler)), np.unwrap(np.angle(rocker)),
        int(branches[0]) if (branches == branches[0]).all() else 0, sense, 0.0, branches, frame,
    )  # fmt: skip
    left = made.points() - P
    object.__setattr__(made, "residual", float(np.sum(np.abs(left) ** 2)))
    for array in (made.lengths, made.turns, made.couplers, made.rockers, made.branches):
        array.flags.writeable = False
    return made


def visited(turns: Floats) -> tuple[Floats, int]:
    """Return angles unwrapped in the sense in which they follow each other within a turn.

    The second is that sense, 0 where neither is: then each angle is near the one before.
    """
    steps = np.diff(turns)
    for sense in (1, -1):
        onward = np.mod(sense * steps, TURN)
        if onward.sum() < TURN:
            return turns[0] + sense * np.concatenate([[0.0], np.cumsum(onward)]), sense
    return np.unwrap(turns), 0


def swapped(design: Linkage) -> Linkage:
    """Return the same four-bar driven at its other pivot."""
    A, B, P = joints(design)
    frame = float(np.angle(-np.exp(1j * design.frame)))
    return linkage(design.other_pivot, design.pivot, B, A, P, frame)


def joints(design: Linkage) -> tuple[Complexes, Complexes, Complexes]:
    """Return crank pins, rocker pins and coupler points (k,) from the angles of the links."""
    _, r2, _, r4 = design.lengths
    turn = np.exp(1j * design.turn)
    A = design.pivot + turn * r2 * np.exp(1j * design.turns)
    B = design.other_pivot + turn * r4 * np.exp(1j * design.rockers)
    P = A + turn * design.point * np.exp(1j * design.couplers)
    return A, B, P


def foci(design: StartingFourBar) -> Any:
    """Return the fixed pivots A0, B0, C0 (3,) of the four-bar and its cognates, complex."""
    ground = design.lengths[0] * np.exp(1j * design.turn)
    z = design.point / design.lengths[2]
    return design.pivot + np.array([0, 1, z]) * ground


def cognates(design: Linkage) -> tuple[Linkage, Linkage, Linkage]:
    """Return the four-bar and its two cognates, with the same coupler points at the poses.

    The pivots are A0 B0, A0 C0 and C0 B0, the first that of the crank. ``frame`` is kept by the
    first alone: the couplers of the others turn differently.
    """
    A, B, P = joints(design)
    a, b, c = foci(design)
    z = design.point / design.lengths[2]
    second, third = A - a, B - b  # the cranks of the given four-bar, coupler sides of the others
    A2 = a + P - A
    B3 = b + P - B
    return (
        design,
        linkage(a, c, A2, A2 + second * z, P),
        linkage(c, b, B3 + third * (1 - z), B3, P),
    )


def variants(design: Linkage) -> tuple[Linkage, ...]:
    """Return the six mechanisms with the same coupler curve: three cognates, two driven pivots."""
    return tuple(one for cognate in cognates(design) for one in (cognate, swapped(cognate)))


def invariants(
    pivot: Complexes, other: Complexes, crank: Floats, coupler: Floats, rocker: Floats,
    point: Complexes,
) -> Matrix:  # fmt: skip
    """Return numbers (n, 11) that are the same for cognates, whichever pivot is driven.

    Over the ground, the cognates exchange crank, coupler and rocker, but the one that never
    turns at a focus belongs to that focus: rocker to A0, crank to B0, coupler to C0. The numbers
    are symmetric functions of the three pairs of focus and length; they are complete.

    `pivot`, `other` (n,): fixed pivots. `crank`, `coupler`, `rocker` (n,): lengths; a coupler may
    be negative, against its point. `point` (n,): coupler point, along and across the coupler.
    """
    ground = other - pivot
    corners = np.stack([pivot, other, pivot + ground * point / coupler], axis=1)
    middle = corners.mean(axis=1)
    arms = corners - middle[:, None]
    ratios = np.abs(np.stack([rocker, crank, coupler], axis=1) / ground[:, None])
    complexes = np.stack(
        [
            middle, np.sum(arms**2, axis=1), np.prod(arms, axis=1),
            np.sum(ratios * arms, axis=1), np.sum(ratios * arms**2, axis=1),
        ],
        axis=1,
    )  # fmt: skip
    return np.concatenate([complexes.real, complexes.imag, ratios.sum(axis=1)[:, None]], axis=1)


def are_cognates(one: StartingFourBar, other: StartingFourBar, tolerance: float = SAME) -> bool:
    """Whether two four-bars trace the same coupler curve as cognates of each other."""
    return len(grouped([one, other], tolerance)) == 1


def grouped(designs: Iterable[StartingFourBar], tolerance: float = SAME) -> list[list[int]]:
    """Return the indices of designs in groups of cognates, in the order of first appearance."""
    designs = list(designs)
    if not designs:
        return []
    places = np.stack([foci(design) for design in designs])
    _, crank, coupler, rocker = np.stack([design.lengths for design in designs]).T
    point = np.array([design.point for design in designs])
    keys = invariants(places[:, 0], places[:, 1], crank, coupler, rocker, point)
    size = np.abs(places - places.mean(axis=1, keepdims=True)).max(axis=1)
    groups: list[list[int]] = []
    for i, one in enumerate(keys):
        s, m = float(size[i]), 1 + float(one[-1])
        units = np.array([s, s**2, s**3, m * s, m * s**2] * 2 + [m])
        for group in groups:
            if bool((np.abs(keys[group[0]] - one) <= tolerance * units).all()):
                group.append(i)
                break
        else:
            groups.append([i])
    return groups


@dataclass(frozen=True)
class PlanePoses:
    """Places (k,) complex of the moving plane's origin, and its turns (k,) [rad]."""

    places: Complexes
    turns: Floats

    @property
    def rotations(self) -> Any:
        """Unit complex numbers of the turns."""
        return np.exp(1j * self.turns)

    def at(self, pin: complex) -> Any:
        """Return the places (k,) of a point of the moving plane."""
        return self.places + self.rotations * pin


@dataclass(frozen=True)
class GuidingLink:
    """A link between the fixed ``pivot`` and the ``pin`` of the moving plane, complex."""

    pivot: complex
    pin: complex
    length: float


def poses_of(values: Matrix | Sequence[Sequence[float]]) -> PlanePoses:
    """Return poses from rows x, y, turn, checked."""
    rows = np.asarray(values, float)
    if rows.ndim != 2 or rows.shape[1] != 3 or not np.isfinite(rows).all():
        raise InputError("poses are finite rows x, y, turn", where="poses")
    places = rows[:, 0] + 1j * rows[:, 1]
    size = float(np.abs(places - places.mean()).max())
    for i, j in permutations(range(len(rows)), 2):
        turned = abs(np.exp(1j * rows[i, 2]) - np.exp(1j * rows[j, 2]))
        if i < j and abs(places[i] - places[j]) <= 1e-12 * size and turned < 1e-12:
            raise InputError(f"poses {i + 1} and {j + 1} are the same", where="poses")
    return PlanePoses(places, rows[:, 2])


def paired(poses: PlanePoses, found: Sequence[GuidingLink]) -> tuple[Linkage, ...]:
    """Return the four-bars of two dyads, each driven at each of its pivots.

    The coupler point is the origin of the moving plane. Pairs that share a pivot or a pin are no
    four-bars and left out.
    """
    _, size = scale_of(poses.places)
    made = []
    for first, second in permutations(found, 2):
        line = second.pin - first.pin
        if min(abs(second.pivot - first.pivot), abs(line)) <= LEAST * size:
            continue
        A, B = poses.at(first.pin), poses.at(second.pin)
        frame = float(np.angle(line))
        made.append(linkage(first.pivot, second.pivot, A, B, poses.places, frame))
    return tuple(made)


def scale_of(places: Complexes) -> tuple[complex, float]:
    """Return the middle of places (k,) complex and their size."""
    middle = complex(places.mean())
    size = float(np.sqrt(np.mean(np.abs(places - middle) ** 2)))
    return middle, size if size > 0 else 1.0


def scaled_dimensions(given: Mapping[str, float], middle: complex, size: float) -> dict[str, float]:
    """Return given dimensions with the origin in the middle of the points, by their size."""
    shift = {"pivot_x": middle.real, "other_x": middle.real}
    shift |= {"pivot_y": middle.imag, "other_y": middle.imag}
    return {
        name: value if name == "turn" else (value - shift.get(name, 0.0)) / size
        for name, value in given.items()
    }
