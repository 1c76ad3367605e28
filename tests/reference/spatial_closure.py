"""Poses of spatial mechanisms in many digits, from absolute places and quaternions of all bodies.

Owes nothing to the package: directions are compared as vectors, joints are closed in seven
coordinates a body, Newton's method runs on residuals in 40 digits with a Jacobian of differences.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any

import mpmath
import numpy as np

DIGITS = 40
GROUND = "ground"


@dataclass
class Pair:
    """A joint: kind letter, bodies, points, axes and normals in their bodies, length or pitch.

    ``angle`` is near that of a screw or of a wheel: whole turns count. A mesh has the numbers of
    the pairs of its members in ``meshed``: angle (or slide, of a rack) = size x angle.
    """

    kind: str
    first: str
    second: str
    s1: Any
    s2: Any
    a1: Any = None
    n1: Any = None
    a2: Any = None
    n2: Any = None
    size: float = 0.0
    angle: float = 0.0
    meshed: tuple[int, int] | None = None


@dataclass
class Closure:
    """Pairs, of which one turns or slides by the driver's value.

    ``bodies`` are in the order of the unknowns.
    """

    bodies: list[str]
    pairs: list[Pair] = field(default_factory=list)
    driven: int = 0

    def residual(self, x: list[Any], u: Any, ctx: Any) -> list[Any]:
        """Return all equations at x = (place, quaternion) of each body, in numbers of `ctx`."""
        one, zero = ctx.mpf(1), ctx.mpf(0)
        place = {GROUND: ([zero] * 3, [[one, zero, zero], [zero, one, zero], [zero, zero, one]])}
        rows = []
        for k, name in enumerate(self.bodies):
            own = x[7 * k : 7 * k + 7]
            place[name] = (own[:3], rotation(own[3:]))
            rows.append(sum(e * e for e in own[3:]) - 1)
        turns: dict[int, Any] = {}
        slides: dict[int, Any] = {}
        for k, pair in enumerate(self.pairs):
            if pair.meshed is not None:
                first, second = pair.meshed
                driven = (slides if pair.kind == "K" else turns)[first]
                rows.append(driven - ctx.mpf(pair.size) * turns[second])
                continue
            (r1, R1), (r2, R2) = place[pair.first], place[pair.second]
            P1 = [r + v for r, v in zip(r1, turned(R1, pair.s1, ctx), strict=True)]
            P2 = [r + v for r, v in zip(r2, turned(R2, pair.s2, ctx), strict=True)]
            g = [b - a for a, b in zip(P1, P2, strict=True)]
            if pair.kind == "S":
                rows += g
                continue
            if pair.kind == "D":
                rows.append(dot(g, g) - ctx.mpf(pair.size) ** 2)
                continue
            frames = []
            for R, a, n in ((R1, pair.a1, pair.n1), (R2, pair.a2, pair.n2)):
                axis = unit(turned(R, a, ctx), ctx)
                normal = turned(R, n, ctx)
                along = dot(axis, normal)
                normal = unit([v - along * w for v, w in zip(normal, axis, strict=True)], ctx)
                frames.append((axis, normal, cross(axis, normal)))
            (a1, n1, m1), (a2, n2, _) = frames
            if pair.kind == "U":  # the second axis is a pin across the first one
                rows += [*g, dot(a1, a2)]
                if k == self.driven:
                    rows.append(ctx.atan2(dot(m1, a2), dot(n1, a2)) - u)
                continue
            angle = ctx.atan2(dot(m1, n2), dot(n1, n2))
            whole = round(float(pair.angle - angle) / (2 * np.pi))
            turns[k], slides[k] = angle + 2 * ctx.pi * whole, dot(a1, g)
            rows += [b - a for a, b in zip(a1, a2, strict=True)]
            if pair.kind in "RW":
                rows += g
            elif pair.kind == "E":
                rows.append(dot(a1, g))
            else:
                rows += cross(g, a1)
            if pair.kind in "PW":
                rows += [b - a for a, b in zip(n1, n2, strict=True)]
            if pair.kind == "H":
                rows.append(dot(a1, g) - ctx.mpf(pair.size) * turns[k] / (2 * ctx.pi))
            if k == self.driven:
                rows.append((slides if pair.kind == "P" else turns)[k] - u)
        return rows

    def refined(self, x: list[float], u: float) -> tuple[list[Any], float]:
        """Return the solution near x in `DIGITS` digits, and how large its last step was."""
        slope = self._slope(np.asarray(x, float), u)
        inverse = np.linalg.pinv(slope, rcond=1e-9)
        with mpmath.workdps(DIGITS):
            here = [mpmath.mpf(float(v)) for v in x]
            exact, size = mpmath.mpf(float(u)), np.inf
            for _ in range(12):
                F = self.residual(here, exact, mpmath.mp)
                scale = max(abs(v) for v in F)
                if scale == 0:
                    return here, 0.0
                step = inverse @ np.array([float(v / scale) for v in F])
                here = [v - scale * mpmath.mpf(float(d)) for v, d in zip(here, step, strict=True)]
                size = float(scale * mpmath.mpf(float(np.abs(step).max())))
                if size < 1e-30:
                    break
            return here, size

    def _slope(self, x: Any, u: float) -> Any:
        columns = []
        for k in range(len(x)):
            h = np.zeros(len(x))
            h[k] = 1e-6
            up, down = (self.residual((x + s * h).tolist(), u, mpmath.fp) for s in (1, -1))
            columns.append((np.array(up) - np.array(down)) / 2e-6)
        return np.array(columns).T

    def condition(self, x: Any, u: float) -> float:
        """Return the ratio of the largest and the least singular value of the equations."""
        sigma = np.linalg.svd(self._slope(np.asarray(x, float), u), compute_uv=False)
        return float(sigma[0] / sigma[7 * len(self.bodies) - 1])


def rotation(e: list[Any]) -> list[list[Any]]:
    """Return the rotation matrix by rows of a quaternion, its real part first."""
    w, x, y, z = e
    return [
        [1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)],
        [2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)],
        [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)],
    ]


def turned(R: list[list[Any]], s: Any, ctx: Any) -> list[Any]:
    return [sum(row[i] * ctx.mpf(float(s[i])) for i in range(3)) for row in R]


def dot(a: list[Any], b: list[Any]) -> Any:
    return sum(v * w for v, w in zip(a, b, strict=True))


def cross(a: list[Any], b: list[Any]) -> list[Any]:
    return [a[i - 2] * b[i - 1] - a[i - 1] * b[i - 2] for i in range(3)]


def unit(a: list[Any], ctx: Any) -> list[Any]:
    size = ctx.sqrt(dot(a, a))
    return [v / size for v in a]
