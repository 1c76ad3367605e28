"""All poses of a platform on six legs (Stewart and Gough), certified."""

from __future__ import annotations

import json
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np

from mechdae.errors import InputError
from mechdae.numerics.homotopy.certify import CertifiedSolutions, apart, certify
from mechdae.numerics.homotopy.study_chart import (
    ChartedSolutions,
    StudyChart,
    all_apart,
    from_first_leg,
    numbers_along,
    points,
    same,
    study,
)
from mechdae.numerics.homotopy.study_quadrics import (
    MOST,
    conjugate,
    displacement,
    product,
    quadrics,
)
from mechdae.numerics.homotopy.tracker import distinct, track
from mechdae.records import dataclass
from mechdae.types import Booleans, Complexes, Floats, Unknowns

STORE = Path(__file__).resolve().parent / "platform.json"
ROUTES = 4
FLAT = 1e-7
"""Size of e.e by |e|^2 below which a solution is no pose."""
SIMPLE = 1e-9
"""Last Newton step of an end point that is a simple solution, by the size 1 of (e, g)."""
SAME = 1e-6


@dataclass(frozen=True)
class PlatformPoses:
    """Real poses: ``position`` (n, 3) and ``quaternion`` (n, 4), real part first.

    The largest entry of a quaternion is positive; ``error`` (n,) bounds that of (e, g) by its size.
    ``regular`` counts the simple complex solutions ``every`` (m, 8), (e, g) in units of ``size``,
    ``far`` those at infinity, or so far out that only the chart of `study_chart` tells them,
    ``singular`` paths that end in others. ``basis`` is "theorem" where all 40 are certified and
    different (the real ones are all there are: ``proven``), "homotopy" where fewer are.
    """

    position: Floats
    quaternion: Floats
    error: Floats
    regular: int
    far: int
    singular: int
    basis: str
    every: Complexes
    size: float

    @property
    def proven(self) -> bool:
        return self.basis == "theorem"

    def complex_places(self, point: Floats) -> tuple[Complexes, Complexes]:
        """Return the places (m, 3) of a point (3,) of the platform, and the unit quaternions."""
        e = self.every[:, :4]
        e = e / np.sqrt((e * e).sum(axis=1))[:, None]
        turned = product(product(e, np.concatenate([[0], point])[None]), conjugate(e))[:, 1:]
        return self.size * displacement(self.every) + turned, e


@cache
def generic() -> tuple[Complexes, Complexes]:
    """Return the parameters (42,) of a generic complex platform and its 40 solutions, checked."""
    data = json.loads(STORE.read_text(encoding="utf-8"))
    p = np.array(data["parameters"]) @ [1, 1j]
    X = np.array(data["solutions"]) @ [1, 1j]
    Q = quadrics(p[:18].reshape(6, 3), p[18:36].reshape(6, 3), p[36:])
    found = certify(X, Q)
    if len(X) != MOST or not found.simple.all() or not apart(found):
        raise InputError("the stored solutions do not solve their platform", where=str(STORE))
    return p, X


def platform_poses(
    base: Floats | list[Floats], platform: Floats | list[Floats], legs: Floats | list[float]
) -> PlatformPoses:
    """Return all poses at which six points of a platform keep their distances from a base.

    Parameters
    ----------
    base, platform
        Points (6, 3), each in its own body [m].
    legs
        Their distances (6,) [m].
    """
    a, b, lengths = (np.asarray(given, float) for given in (base, platform, legs))
    if a.shape != (6, 3) or b.shape != (6, 3) or lengths.shape != (6,):
        raise InputError("six points of three coordinates on either body and six legs are needed")
    if not (lengths > 0).all():
        raise InputError("legs have lengths above 0", where="legs")
    here = np.stack([a - a[0], b - b[0]])
    size = float(np.sqrt((here**2).mean(axis=(1, 2)).sum() * 3 + (lengths**2).mean()))
    p = from_first_leg(a / size, b / size, (lengths / size) ** 2)
    chart, y = _followed(p)
    X = study(chart.solutions(y))
    e = X[:, :4]
    square = np.abs((e * e).sum(axis=1)) / np.maximum((np.abs(e) ** 2).sum(axis=1), 1e-300)
    found = certify(X, quadrics(*points(p), p[30:]))
    regular = found.simple & (square > FLAT)
    every, far = int(regular.sum()), 0
    whole = every == MOST and bool((found.real | found.other).all()) and apart(found)
    if len(y) == MOST and not whole:
        charted = chart.certify(p, y)
        whole = _whole(chart, charted, found, regular)
        far = MOST - every if whole else 0
    poses = found.x[regular & found.real].real
    place = displacement(poses) + (a[0] - _turned(poses, b[0])) / size
    order: Any = np.lexsort(np.round(place, 9).T) if len(poses) else []
    e = poses[order, :4]
    norm = np.linalg.norm(e, axis=1, keepdims=True)
    top = np.take_along_axis(e, np.argmax(np.abs(e), axis=1)[:, None], axis=1)
    error = found.radius[regular & found.real][order] / np.maximum(norm[:, 0], 1e-300)
    return PlatformPoses(
        size * place[order],
        e / (norm * np.sign(top)),
        error,
        every,
        far,
        MOST - every - far,
        "theorem" if whole else "homotopy",
        _moved(found.x[regular], a[0] / size, b[0] / size),
        size,
    )


def _whole(
    chart: StudyChart, charted: ChartedSolutions, found: CertifiedSolutions, regular: Booleans
) -> bool:
    """Return whether 40 different solutions are certified, each real one of them by `found` too."""
    told = charted.other | (regular & (found.real | found.other) & same(chart, charted, found))
    return bool(charted.simple.all() and told.all() and all_apart(charted))


def _pure(v: Complexes | Floats) -> Complexes:
    return np.concatenate([[0.0], v])[None]


def _turned(X: Unknowns, v: Floats) -> Any:
    """Return a vector (3,) of the platform in poses (n, 8), as (n, 3)."""
    e = X[:, :4]
    turned = product(product(e, _pure(v)), conjugate(e))[:, 1:]
    return turned / (e * e).sum(axis=1)[:, None]


def _moved(X: Complexes, a: Complexes, b: Complexes) -> Complexes:
    """Return poses (n, 8) told from points a and b of both bodies as such from their origins."""
    e, g = X[:, :4], X[:, 4:]
    return np.concatenate([e, g + (product(_pure(a), e) - product(e, _pure(b))) / 2], axis=1)


def _followed(p: Any) -> tuple[StudyChart, Complexes]:
    """Return the simple solutions (n, 6) that routes lead to, until one brings nothing new."""
    generic_p, first = generic()
    start = from_first_leg(
        generic_p[:18].reshape(6, 3), generic_p[18:36].reshape(6, 3), generic_p[36:]
    )
    first = _moved(first, -generic_p[:3], -generic_p[18:21])
    rng = np.random.default_rng(20)
    whole: StudyChart | None = None
    best = np.zeros((0, 6), complex)
    for number in range(ROUTES):
        chart = StudyChart(rng.normal(size=4) + 1j * rng.normal(size=4))
        bend = None
        if number:
            bend = (rng.normal(size=36) + 1j * rng.normal(size=36)) * 0.5
        system = chart.system(numbers_along(start, p.astype(complex), bend))
        ends = track(system, chart.coordinates(first), relative=True, hasty=True)
        size = np.maximum(np.linalg.norm(ends.x, axis=1), 1)
        y = ends.x[ends.followed & (ends.step < SIMPLE * size)]
        if whole is None:
            whole = chart
        else:
            y = whole.coordinates(chart.solutions(y))
        known, every = len(best), np.concatenate([best, y])
        size = np.maximum(np.linalg.norm(every, axis=1), 1)[:, None]
        best = every[distinct(every / size, SAME)]
        if len(best) == MOST or (number and len(best) == known):
            break
    assert whole is not None
    return whole, best
