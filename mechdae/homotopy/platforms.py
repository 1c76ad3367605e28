"""All poses of a platform on six legs (Stewart and Gough), certified."""

from __future__ import annotations

import json
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np

from mechdae.errors import InputError
from mechdae.homotopy.certify import apart, certify
from mechdae.homotopy.study import MOST, along, conjugate, displacement, product, quadrics, route
from mechdae.homotopy.tracker import distinct, track
from mechdae.records import dataclass

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
    ``singular`` paths that end in others or far off; ``basis`` is "theorem" where all 40 are
    certified and different (the real ones are all there are: ``proven``), "homotopy" where fewer
    are regular.
    """

    position: Any
    quaternion: Any
    error: Any
    regular: int
    singular: int
    basis: str
    every: Any
    size: float

    @property
    def proven(self) -> bool:
        return self.basis == "theorem"

    def complex_places(self, point: Any) -> tuple[Any, Any]:
        """Return the places (m, 3) of a point (3,) of the platform, and the unit quaternions."""
        e = self.every[:, :4]
        e = e / np.sqrt((e * e).sum(axis=1))[:, None]
        turned = product(product(e, np.concatenate([[0], point])[None]), conjugate(e))[:, 1:]
        return self.size * displacement(self.every) + turned, e


@cache
def generic() -> tuple[Any, Any]:
    """Return the parameters (42,) of a generic complex platform and its 40 solutions, checked."""
    data = json.loads(STORE.read_text(encoding="utf-8"))
    p = np.array(data["parameters"]) @ [1, 1j]
    X = np.array(data["solutions"]) @ [1, 1j]
    Q = quadrics(p[:18].reshape(6, 3), p[18:36].reshape(6, 3), p[36:])
    found = certify(X, Q)
    if len(X) != MOST or not found.simple.all() or not apart(found):
        raise InputError("the stored solutions do not solve their platform", where=str(STORE))
    return p, X


def platform_poses(base: Any, platform: Any, legs: Any) -> PlatformPoses:
    """Return all poses at which six points of a platform keep their distances from a base.

    Parameters
    ----------
    base, platform
        Points (6, 3), each in its own body [m].
    legs
        Their distances (6,) [m].
    """
    a, b, lengths = (np.asarray(own, float) for own in (base, platform, legs))
    if a.shape != (6, 3) or b.shape != (6, 3) or lengths.shape != (6,):
        raise InputError("six points of three coordinates on either body and six legs are needed")
    if not (lengths > 0).all():
        raise InputError("legs have lengths above 0", where="legs")
    size = float(np.sqrt((a**2).mean() + (b**2).mean() + (lengths**2).mean()))
    target = np.concatenate([a.ravel() / size, b.ravel() / size, (lengths / size) ** 2])
    real = quadrics(a / size, b / size, target[36:])
    X = _followed(target)
    e = X[:, :4]
    square = np.abs((e * e).sum(axis=1)) / np.maximum((np.abs(e) ** 2).sum(axis=1), 1e-300)
    found = certify(X, real)
    regular = found.simple & (square > FLAT)
    every = int(regular.sum())
    whole = every == MOST and bool((found.real | found.other).all()) and apart(found)
    poses = found.x[regular & found.real].real
    order: Any = np.lexsort(np.round(displacement(poses), 9).T) if len(poses) else []
    poses = poses[order]
    e = poses[:, :4]
    norm = np.linalg.norm(e, axis=1, keepdims=True)
    top = np.take_along_axis(e, np.argmax(np.abs(e), axis=1)[:, None], axis=1)
    error = found.radius[regular & found.real][order] / np.maximum(norm[:, 0], 1e-300)
    return PlatformPoses(
        size * displacement(poses),
        e / (norm * np.sign(top)),
        error,
        every,
        MOST - every,
        "theorem" if whole else "homotopy",
        found.x[regular],
        size,
    )


def _followed(target: Any) -> Any:
    """Return the simple solutions (n, 8) that routes lead to, until one brings nothing new."""
    start, first = generic()
    rng = np.random.default_rng(20)
    best = np.zeros((0, 8), complex)
    for number in range(ROUTES):
        bend = None
        if number:
            bend = (rng.normal(size=42) + 1j * rng.normal(size=42)) * 0.5
        patch = rng.normal(size=8) + 1j * rng.normal(size=8)
        X = first / (first @ patch)[:, None]
        ends = track(along(route(start, target.astype(complex), bend), patch), X)
        good = ends.followed & (ends.step < SIMPLE * np.linalg.norm(ends.x, axis=1))
        X = ends.x[good]
        X = X / X[np.arange(len(X)), np.argmax(np.abs(X), axis=1)][:, None]
        known, every = len(best), np.concatenate([best, X])
        best = every[distinct(every, SAME)]
        if len(best) == MOST or (number and len(best) == known):
            break
    return best
