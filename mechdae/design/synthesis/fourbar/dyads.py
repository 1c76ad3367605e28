"""Poses of a plane, exactly: dyads by Burmester's theory, pairs of them as four-bars.

A dyad RR holds the point w of the moving plane at a distance L from the fixed point G:
|p_j + R_j w - G| = L at pose j. Five poses leave finitely many, at most four real ones; with
5 - k of Gx, Gy, wx, wy given k poses do. Among four poses there is at most one point whose four
places are in line (a dyad PR), and one line of the plane that goes through a fixed point (RP).
More than five poses have no exact four-bar in general: least squares.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from itertools import permutations
from typing import TYPE_CHECKING, Any

import numpy as np

from mechdae.design.synthesis.fourbar.linkage import Linkage, linkage
from mechdae.errors import InputError, UnknownName
from mechdae.numerics.levenberg import Rows, solve_all
from mechdae.records import dataclass
from mechdae.types import Complexes, Floats, Unknowns

if TYPE_CHECKING:
    from numpy.random import Generator


UNKNOWNS = ("pivot_x", "pivot_y", "pin_x", "pin_y")
STARTS = 1000
SPREAD = 1.0
"""Of the logarithm of sizes of starts."""
LEAST = 1e-6
"""Shortest link in sizes of the poses: pins that fall together are none."""


@dataclass(frozen=True)
class PlanePoses:
    """Places (k,) complex of the moving plane's origin, and its turns (k,) [rad]."""

    places: Any
    turns: Any

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


@dataclass(frozen=True)
class Slide:
    """A sliding dyad: ``point`` keeps on a line.

    ``moving`` False (PR): a point of the moving plane on a fixed line with the given normal and
    distance from the origin. True (RP): a fixed point on a line of the moving plane.
    """

    point: complex
    normal: complex
    distance: float
    moving: bool


def poses_of(values: Any) -> PlanePoses:
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


def dyads(
    poses: PlanePoses,
    given: Mapping[str, float] | None = None,
    *,
    starts: int = STARTS,
    seed: int = 0,
    iterations: int = 200,
) -> tuple[GuidingLink, ...]:
    """Return all real dyads RR that the search finds, the shortest first.

    `poses`: two to five. `given`: 5 - k of ``pivot_x``, ``pivot_y`` (fixed point), ``pin_x``,
    ``pin_y`` (in the moving plane) by name.
    """
    given = dict(given or {})
    _check(poses, given)
    middle, size = scale_of(poses.places)
    rows = DyadRows(
        (poses.places - middle) / size, poses.rotations, scaled_dimensions(given, middle, size)
    )
    search = solve_all(
        rows, rows.draw, starts, usable=rows.usable, seed=seed, iterations=iterations
    )
    found = []
    for d in rows.whole(search.x):
        pivot, pin = complex(d[0], d[1]) * size + middle, complex(d[2], d[3]) * size
        found.append(GuidingLink(pivot, pin, float(np.sqrt(d[4])) * size))
    return tuple(sorted(found, key=lambda dyad: dyad.length))


class DyadRows:
    """Rows |p_j + R_j w - G|^2 - L^2 of scaled poses; unknowns Gx, Gy, wx, wy, L^2."""

    def __init__(self, places: Complexes, rotations: Complexes, given: Mapping[str, float]) -> None:
        self.places, self.rotations = places, rotations
        self.values = np.array([given.get(name, 0.0) for name in UNKNOWNS] + [0.0])
        self.free = np.array([i for i in range(5) if i == 4 or UNKNOWNS[i] not in given])

    def whole(self, x: Unknowns) -> Floats:
        """Return all five unknowns (n, 5)."""
        d = np.broadcast_to(self.values, (len(x), 5)).copy()
        d[:, self.free] = x
        return d

    def _arms(self, d: Floats) -> Complexes:
        pin = (d[:, 2] + 1j * d[:, 3])[:, None]
        return self.places + self.rotations * pin - (d[:, 0] + 1j * d[:, 1])[:, None]

    def __call__(self, x: Unknowns, t: Floats) -> Rows:
        d = self.whole(x)
        u = self._arms(d)
        F = np.abs(u) ** 2 - d[:, 4:]
        turned = 2 * u.conj() * self.rotations
        J = np.stack(
            [-2 * u.real, -2 * u.imag, turned.real, -turned.imag, -np.ones_like(F)], axis=2
        )
        return F[:, :, None], J[:, :, None, self.free], None

    def draw(self, generator: Generator, n: int) -> tuple[Floats, Floats]:
        """Return starts of all sizes."""
        d = generator.normal(size=(n, 5))
        spread = 1.5 * np.exp(SPREAD * generator.normal(size=(n, 2)))
        d[:, :4] *= spread[:, [0, 0, 1, 1]]
        d = self.whole(d[:, self.free])
        d[:, 4] = np.mean(np.abs(self._arms(d)) ** 2, axis=1)
        return d[:, self.free], np.zeros((n, 0))

    def usable(self, x: Unknowns) -> Any:
        """Return which links have a length."""
        return self.whole(x)[:, 4] > LEAST**2


def slides(poses: PlanePoses) -> tuple[Slide, ...]:
    """Return the sliding dyads PR and RP of four poses."""
    if len(poses.turns) != 4:
        raise InputError(
            f"sliding dyads of {len(poses.turns)} poses: four determine them", where="poses"
        )
    found = [Slide(w, n, float((n.conjugate() * poses.at(w)[0]).real), False)
             for w, n in _in_line(poses)]  # fmt: skip
    for w, n in _in_line(inverse(poses)):
        distance = float((n.conjugate() * inverse(poses).at(w)[0]).real)
        found.append(Slide(w, n, distance, True))
    return tuple(found)


def inverse(poses: PlanePoses) -> PlanePoses:
    """Return the poses of the fixed plane as seen from the moving one."""
    return PlanePoses(-poses.places / poses.rotations, -poses.turns)


def _in_line(poses: PlanePoses) -> list[tuple[complex, complex]]:
    """Return points whose four places are in line, with the normals of the lines.

    n . (p_j - p_1 + (R_j - R_1) w) = 0 for j = 2, 3, 4 is linear in w; that its three rows fit is
    a cubic equation in the direction of n.
    """
    p, r = poses.places[1:] - poses.places[0], poses.rotations[1:] - poses.rotations[0]
    size = float(np.abs(p).max())
    if not size:
        return []

    def matrix(n: complex) -> Any:
        a = np.conj(n) * r
        return np.stack([(np.conj(n) * p).real / size, a.real, -a.imag], axis=1)

    # det(cos, sin) of degree three, from four directions
    at = np.pi * np.arange(4) / 4
    basis = np.stack([np.cos(at) ** (3 - i) * np.sin(at) ** i for i in range(4)], axis=1)
    cubic = np.linalg.solve(basis, [np.linalg.det(matrix(np.exp(1j * a))) for a in at])
    found = []
    for angle in _directions(cubic):
        n = complex(np.exp(1j * angle))
        M = matrix(n)
        values = np.linalg.svd(M, compute_uv=False)
        w, _, rank, _ = np.linalg.lstsq(M[:, 1:], -M[:, 0] * size, rcond=1e-9)
        if rank == 2 and values[2] <= 1e-9 * values[0]:
            found.append((complex(*w), n))
    return found


def _directions(cubic: Any) -> list[float]:
    """Return the angles in [0, pi) at which a homogeneous cubic of cos and sin vanishes."""
    a = cubic / np.abs(cubic).max() if np.abs(cubic).max() else cubic
    if abs(a[0]) >= abs(a[3]):
        roots = np.roots(a)  # of cos/sin
        real = roots[np.abs(roots.imag) <= 1e-8 * (1 + np.abs(roots))].real
        angles = np.arctan2(1.0, real)
    else:
        roots = np.roots(a[::-1])
        real = roots[np.abs(roots.imag) <= 1e-8 * (1 + np.abs(roots))].real
        angles = np.arctan2(real, 1.0)
    return sorted(float(angle % np.pi) for angle in angles)


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


def scale_of(places: Any) -> tuple[complex, float]:
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


def _check(poses: PlanePoses, given: Mapping[str, float]) -> None:
    k = len(poses.turns)
    for name, value in given.items():
        if name not in UNKNOWNS:
            raise UnknownName("dimension", name, UNKNOWNS, where="given")
        if not np.isfinite(value):
            raise InputError(f"{name} = {value}", where="given")
    if not 2 <= k <= 5:
        hint = "the best least squares four-bar for more"
        raise InputError(f"{k} poses: dyads reach two to five exactly", where="poses", hint=hint)
    if len(given) != 5 - k:
        raise InputError(
            f"{k} poses and {len(given)} given coordinates make "
            f"{k} equations for {5 - len(given)} unknowns",
            where="given", hint=f"give {5 - k} of {', '.join(UNKNOWNS)}, or seek the best of many",
        )  # fmt: skip
