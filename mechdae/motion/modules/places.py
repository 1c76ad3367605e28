"""Where three sets add up to a given vector: four formulas on lines, circles, cones, spheres.

Each function returns the first vectors (n, k, 3) of the candidates, one list entry for each vector
of the module; `nan` where there is no real one. Candidates are polished afterwards.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any

import numpy as np

from mechdae.records import dataclass
from mechdae.types import Floats, Integers, Matrices

Y = np.array([0.0, 1.0, 0.0])


@dataclass(frozen=True)
class Vector3:
    """A vector of many data: its unknown letters, and arrays (n,) of what is known of it."""

    unknown: str
    known: Mapping[str, Floats]

    @property
    def u(self) -> Floats:
        """Direction (n, 3)."""
        e, a = self.known["elevation"], self.known["azimuth"]
        return np.stack([np.cos(e) * np.cos(a), np.sin(e), np.cos(e) * np.sin(a)], axis=-1)

    @property
    def h(self) -> Floats:
        """Normal of the vertical plane of an azimuth: direction in which it turns."""
        a = self.known["azimuth"]
        return np.stack([-np.sin(a), np.zeros_like(a), np.cos(a)], axis=-1)

    @property
    def across(self) -> Floats:
        """Direction of an azimuth in the x-z plane."""
        a = self.known["azimuth"]
        return np.stack([np.cos(a), np.zeros_like(a), np.sin(a)], axis=-1)

    def value(self, found: Mapping[str, Floats]) -> Floats:
        """Return the vector (..., 3) with its unknowns found, arrays (n, k)."""
        length, e, a = (
            found[word] if word in found else self.known[word][:, None]
            for word in ("length", "elevation", "azimuth")
        )
        level = length * np.cos(e)
        return np.stack(
            np.broadcast_arrays(level * np.cos(a), length * np.sin(e), level * np.sin(a)), axis=-1
        )

    def unknowns_of(self, w: Matrices) -> dict[str, Floats]:
        """Return the unknowns (n, k) of the vector that is w (n, k, 3)."""
        x, y, z = np.moveaxis(w, -1, 0)
        if self.unknown == "l":
            return {"length": np.einsum("nkc,nc->nk", w, self.u)}
        if self.unknown in ("a", "la"):
            along = np.einsum("nkc,nc->nk", w, self.across)
            sign = np.sign(self.known["length"])[:, None] if self.unknown == "a" else 1.0
            found = {"elevation": np.arctan2(sign * y, sign * along)}
            return found if self.unknown == "a" else {"length": np.hypot(y, along), **found}
        if self.unknown == "lab":
            level = np.hypot(x, z)
            return {
                "length": np.hypot(level, y),
                "elevation": np.arctan2(y, level),
                "azimuth": np.arctan2(z, x),
            }
        if self.unknown == "ab":
            length = self.known["length"][:, None]
            sign = np.sign(length)
            level = np.sqrt(np.maximum(length**2 - y**2, 0.0))
            return {
                "elevation": np.arctan2(sign * y, level),
                "azimuth": np.arctan2(sign * z, sign * x),
            }
        e = self.known["elevation"][:, None]
        if self.unknown == "lb":
            steep = np.abs(np.sin(e)) >= np.abs(np.cos(e))
            level = np.hypot(x, z) * np.sign(y * np.sin(e) * np.cos(e) + (y == 0))
            with np.errstate(all="ignore"):
                length = np.where(steep, y / np.sin(e), level / np.cos(e))
        else:
            length = self.known["length"][:, None]
        sign = np.sign(length * np.cos(e))
        azimuth = np.arctan2(sign * z, sign * x)
        found = {"azimuth": azimuth}
        return found if self.unknown == "b" else {"length": length, **found}

    def columns(self, found: Mapping[str, Floats]) -> list[Floats]:
        """Return the derivatives (n, k, 3) of the vector by its unknowns."""
        length, e, a = np.broadcast_arrays(
            *(
                found[word] if word in found else self.known[word][:, None]
                for word in ("length", "elevation", "azimuth")
            )
        )
        ce, se, ca, sa = np.cos(e), np.sin(e), np.cos(a), np.sin(a)
        each = {
            "l": (ce * ca, se, ce * sa),
            "a": (-length * se * ca, length * ce, -length * se * sa),
            "b": (-length * ce * sa, np.zeros_like(e), length * ce * ca),
        }
        return [np.stack(each[letter], axis=-1) for letter in self.unknown]


@dataclass(frozen=True)
class Circle:
    """Places centre + first cos t + second sin t, each (n, 3); first and second are normal."""

    centre: Floats
    first: Any
    second: Floats

    def at(self, t: Floats) -> Any:
        """Return the places (n, m, 3) at angles (n, m)."""
        return (
            self.centre[:, None, :]
            + self.first[:, None, :] * np.cos(t)[..., None]
            + self.second[:, None, :] * np.sin(t)[..., None]
        )

    @property
    def radius(self) -> Any:
        return np.sqrt((self.first**2).sum(axis=-1))

    @property
    def normal(self) -> Any:
        """Unit normal (n, 3)."""
        across = np.cross(self.first, self.second)
        with np.errstate(all="ignore"):
            return across / np.linalg.norm(across, axis=-1, keepdims=True)

    def taken(self, others: list[Circle], which: Integers) -> Circle:
        """Return for each datum this circle (0) or one of the others (1, 2, ...)."""
        every = [self, *others]
        rows = np.arange(len(which))
        return Circle(
            *(
                np.stack([getattr(circle, word) for circle in every])[which, rows]
                for word in ("centre", "first", "second")
            )
        )


def circle(vector: Vector3) -> Circle:
    """Return the circle of a vector whose elevation or azimuth is unknown."""
    length = vector.known["length"][:, None]
    if vector.unknown == "a":
        return Circle(np.zeros((len(length), 3)), length * vector.across, length * Y)
    e = vector.known["elevation"][:, None]
    level = length * np.cos(e)
    return Circle(
        length * np.sin(e) * Y, level * np.array([1.0, 0, 0]), level * np.array([0, 0, 1.0])
    )


NEAR, NEAR_QUARTIC, WIDE = 1e-4, 1e-3, 0.1
"""How far from the unit circle roots are taken for real."""


def candidates(vectors: list[Vector3], d: Floats, wide: bool = False) -> list[Matrices]:
    """Return candidates of each vector of a module whose sum is d (n, 3).

    ``wide`` takes more of them for three circles: all eliminations, all signs, roots further off.
    """
    kinds = [vector.unknown for vector in vectors]
    if kinds == ["lab"]:
        return [d[:, None, :]]
    if len(kinds) == 2:
        return _two(vectors, d)
    lines = [vector.u for vector in vectors if vector.unknown == "l"]
    circles = [circle(vector) for vector in vectors if vector.unknown != "l"]
    if len(lines) == 3:
        return _lines(lines, d)
    if len(lines) == 2:
        normal = np.cross(lines[0], lines[1])
        (single,) = circles
        t = _roots(lambda t: _dot(d[:, None, :] - single.at(t), normal[:, None, :]), d, 1)
        third = single.at(t)
        rest = d[:, None, :] - third
        return [*_split(lines, rest), third]
    if lines:
        return _line_and_circles(lines[0], circles, d)
    crossed = [
        np.linalg.norm(np.cross(circles[i - 2].normal, circles[i - 1].normal), axis=1)
        for i in range(3)
    ]
    best = np.argsort(-np.stack(crossed), axis=0)
    if not wide:
        return _circles(circles, d, best[0], False)
    parts = [_circles(circles, d, which, True) for which in best]
    return [np.concatenate(arrays, axis=1) for arrays in zip(*parts, strict=True)]


def _roots(g: Any, d: Floats, degree: int, near: float = NEAR) -> Floats:
    return angles_of_roots(g, len(d), degree, near)


def _dot(a: Floats, b: Floats) -> Any:
    return (a * b).sum(axis=-1)


def _split(lines: list[Floats], rest: Matrices) -> list[Matrices]:
    """Return the parts along two lines of what lies in their plane, (n, k, 3)."""
    one, other = (line[:, None, :] for line in lines)
    normal = np.cross(one, other)
    with np.errstate(all="ignore"):
        size = _dot(normal, normal)
        first = _dot(np.cross(rest, other), normal) / size
        second = _dot(np.cross(one, rest), normal) / size
    return [first[..., None] * one, second[..., None] * other]


def _lines(lines: list[Floats], d: Floats) -> list[Matrices]:
    first, second, third = lines
    with np.errstate(all="ignore"):
        volume = _dot(first, np.cross(second, third))
        lengths = [
            _dot(d, np.cross(second, third)) / volume,
            _dot(d, np.cross(third, first)) / volume,
            _dot(d, np.cross(first, second)) / volume,
        ]
    pairs = zip(lengths, lines, strict=True)
    return [(length[:, None] * line)[:, None, :] for length, line in pairs]


def _two(vectors: list[Vector3], d: Floats) -> list[Matrices]:
    """A plane, a cone or a sphere, and a line or a circle."""
    surface, curve = vectors
    known = surface.known
    if surface.unknown == "la":

        def level(w: Matrices) -> Any:
            return _dot(w, surface.h[:, None, :])

        degree = 1
    elif surface.unknown == "ab":

        def level(w: Matrices) -> Any:
            return _dot(w, w) - known["length"][:, None] ** 2

        degree = 2 if curve.unknown == "l" else 1
    else:
        e = known["elevation"][:, None]

        def level(w: Matrices) -> Any:
            x, y, z = np.moveaxis(w, -1, 0)
            return y**2 * np.cos(e) ** 2 - (x**2 + z**2) * np.sin(e) ** 2

        degree = 2
    if curve.unknown == "l":
        second = _on_line(level, curve.u, d, degree)
    else:
        place = circle(curve)
        second = place.at(_roots(lambda t: level(d[:, None, :] - place.at(t)), d, degree))
    return [d[:, None, :] - second, second]


def _on_line(level: Any, u: Floats, d: Floats, degree: int) -> Any:
    """Return the places t u at which a quadratic or linear function of d - t u vanishes."""
    size = np.sqrt(_dot(d, d))[:, None] + 1e-300
    t = size * np.array([[-1.0, 0.0, 1.0]])
    below, here, above = np.moveaxis(level(d[:, None, :] - t[..., None] * u[:, None, :]), 1, 0)
    slope, bend = (above - below) / 2, (above + below) / 2 - here
    with np.errstate(all="ignore"):
        if degree == 1:
            roots = (-here / slope)[:, None]
        else:
            inside = slope**2 - 4 * bend * here
            fold = 1e-12 * (slope**2 + 4 * np.abs(bend * here))
            root = np.sqrt(np.where(np.abs(inside) < fold, np.abs(inside), inside))
            q = -(slope + np.where(slope < 0, -1.0, 1.0) * root) / 2
            roots = np.stack([q / bend, here / q], axis=1)
    return (roots * size)[..., None] * u[:, None, :]


def _line_and_circles(u: Floats, circles: list[Circle], d: Floats) -> list[Matrices]:
    """Project along the line; the circle that is better conditioned there is inverted."""
    seeds = np.eye(3)[np.argmin(np.abs(u), axis=1)]
    p = np.cross(u, seeds)
    p /= np.linalg.norm(p, axis=1, keepdims=True)
    frame = np.stack([p, np.cross(u, p)], axis=1)

    def matrix(locus: Circle) -> Any:
        return np.einsum("nij,njk->nik", frame, np.stack([locus.first, locus.second], axis=2))

    areas = np.stack([np.abs(np.linalg.det(matrix(locus))) for locus in circles])
    which = np.argmax(areas, axis=0)
    inverted = circles[0].taken([circles[1]], which)
    hidden = circles[0].taken([circles[1]], 1 - which)
    a = matrix(inverted)
    with np.errstate(all="ignore"):
        inverse = (
            np.stack(
                [
                    np.stack([a[:, 1, 1], -a[:, 0, 1]], axis=1),
                    np.stack([-a[:, 1, 0], a[:, 0, 0]], axis=1),
                ],
                axis=1,
            )
            / (np.linalg.det(a)[:, None, None])
        )

    def cosines(t: Floats) -> Any:
        rest = (d - inverted.centre)[:, None, :] - hidden.at(t)
        return np.einsum("nij,njk,nmk->nmi", inverse, frame, rest)

    def g(t: Floats) -> Any:
        # g(t) by its size: the inverse may be large
        values = cosines(t)
        return (_dot(values, values) - 1) * np.linalg.det(a)[:, None] ** 2

    t = _roots(g, d, 2)
    c = cosines(t)
    place = (
        inverted.centre[:, None, :]
        + inverted.first[:, None, :] * c[..., :1]
        + inverted.second[:, None, :] * c[..., 1:]
    )
    other = hidden.at(t)
    line = _dot(d[:, None, :] - place - other, u[:, None, :])[..., None] * u[:, None, :]
    first = np.where((which == 0)[:, None, None], place, other)
    second = np.where((which == 0)[:, None, None], other, place)
    return [line, first, second]


def _circles(circles: list[Circle], d: Floats, i: Integers, wide: bool) -> list[Matrices]:
    """Hide circle i, for two others that are crossed well; the eliminant has degree four."""
    locus, one, other = (circles[0].taken(circles[1:], (i + k) % 3) for k in range(3))
    n1, n2 = one.normal, other.normal
    m = np.cross(n1, n2)
    with np.errstate(all="ignore"):
        m /= np.linalg.norm(m, axis=1, keepdims=True)
    p1, p2 = np.cross(n1, m), np.cross(n2, m)
    radius1, radius2 = one.radius[:, None] ** 2, other.radius[:, None] ** 2

    def parts(t: Floats) -> tuple[Floats, ...]:
        s = (d - one.centre - other.centre)[:, None, :] - locus.at(t)
        with np.errstate(all="ignore"):
            mu2 = _dot(s, n1[:, None, :]) / _dot(n1, p2)[:, None]
            mu1 = _dot(s, n2[:, None, :]) / _dot(n2, p1)[:, None]
        return _dot(s, m[:, None, :]), mu1, mu2, radius1 - mu1**2, radius2 - mu2**2

    def g(t: Floats) -> Floats:
        sigma, _, _, a, b = parts(t)
        return (sigma**2 + a - b) ** 2 - 4 * sigma**2 * a

    t = _roots(g, d, 4, WIDE if wide else NEAR_QUARTIC)
    if wide:
        t = np.concatenate([t, t, t], axis=1)
    sigma, mu1, mu2, a, b = parts(t)
    with np.errstate(all="ignore"):
        along = (sigma**2 + a - b) / (2 * sigma)
    if wide:
        sign = np.repeat([0.0, 1.0, -1.0], 8)
        along = np.where(sign == 0, along, sign * np.sqrt(np.maximum(a, 0)))
    first = (
        one.centre[:, None, :] + along[..., None] * m[:, None, :] + mu1[..., None] * p1[:, None, :]
    )
    second = (
        other.centre[:, None, :]
        + (sigma - along)[..., None] * m[:, None, :]
        + mu2[..., None] * p2[:, None, :]
    )
    found = np.stack([locus.at(t), first, second])
    rows = np.arange(len(d))
    return [found[(k - i) % 3, rows] for k in range(3)]


DROPPED = 1e-13
"""Leading coefficients below this share of the largest are rounding: the degree is lower."""


def angles_of_roots(g: Callable[[Any], Any], count: int, degree: int, near: float) -> Floats:
    """Return the angles t at which g vanishes, (count, 2*degree), `nan` where there are fewer.

    `g`: takes angles (count, m), returns values (count, m): polynomials in cos t, sin t. `count`,
    `degree`: how many of them there are, and the degree of each at most. `near`: roots w = exp(i t)
    of the polynomial in w are taken for real where |log |w|| < near: double ones lie off the circle
    by the root of the rounding.
    """
    samples = 4 * degree + 4
    t = 2 * np.pi * np.arange(samples) / samples
    values = np.fft.fft(g(np.broadcast_to(t, (count, samples))), axis=1) / samples
    order = np.arange(-degree, degree + 1)
    coefficients = values[:, order % samples]
    sizes = np.abs(coefficients)
    held = np.where(sizes > DROPPED * sizes.max(axis=1, keepdims=True), np.abs(order), 0)
    largest = held.max(axis=1)
    result = np.full((count, 2 * degree), np.nan)
    for d in range(1, degree + 1):
        rows = np.flatnonzero(largest == d)
        if not rows.size:
            continue
        part = coefficients[rows, degree - d : degree + d + 1]
        companion = np.zeros((rows.size, 2 * d, 2 * d), complex)
        companion[:, 1:, :-1] = np.eye(2 * d - 1)
        companion[:, :, -1] = -part[:, :-1] / part[:, -1:]
        w = np.linalg.eigvals(companion)
        # rounding may put a close pair off the circle, as w and 1/conj(w): its two sides are tried
        off = np.log(np.abs(w))
        angles = np.where(np.abs(off) < near, np.angle(w) + off, np.nan)
        result[np.ix_(rows, np.arange(2 * d))] = angles
    return result
