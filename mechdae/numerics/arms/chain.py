"""Arms with six turning axes: numbers of Denavit and Hartenberg, forward kinematics, limits."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import field
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from mechdae.errors import InputError
from mechdae.records import dataclass
from mechdae.types import Booleans, Floats, Matrices, Matrix, Numbers

AXES = 6
PARALLEL = 1e-9
"""Sine of the twist between two axes below which they are parallel."""
MEETS = 1e-12
"""Distance of axes, in sizes of the arm, up to which they meet."""
ROTATION = 1e-6
"""Largest entry of R R^T - 1 of a rotation."""


@dataclass(frozen=True)
class Arm:
    """An arm with six turning axes.

    Parameters
    ----------
    links
        Rows (a [m], alpha [rad], d [m]) of Denavit and Hartenberg, (6, 3): a joint leads to the
        next one by Rz(theta) Tz(d) Tx(a) Rx(alpha).
    offsets
        (6,), theta where the joint's angle is 0 [rad].
    limits
        (6, 2), smallest and largest angles of the joints [rad].
    base, tool
        (4, 4): the first joint's frame in the world, the tool in the last joint's frame.
    names
        Of the joints.

    Examples
    --------
    >>> half = 1.5707963267948966
    >>> rows = [(0, half, 0.16), (-0.43, 0, 0), (-0.39, 0, 0)]
    >>> arm = md.Arm([*rows, (0, half, 0.13), (0, -half, 0.1), (0, 0, 0.1)])
    >>> arm.forward([0.3, -1.2, 1.5, -0.4, 0.9, 0.2])[:3, 3].round(3).tolist()
    [-0.532, -0.366, 0.354]
    """

    links: Matrix
    offsets: Floats = field(default_factory=lambda: np.zeros(AXES))
    limits: Matrix | None = None
    base: Matrix = field(default_factory=lambda: np.eye(4))
    tool: Matrix = field(default_factory=lambda: np.eye(4))
    names: tuple[str, ...] = ()

    def __post_init__(self) -> None:
        rows = _numbers(self.links, "links", (AXES, 3), "six rows (a, alpha, d) are needed")
        turns = _numbers(self.offsets, "offsets", (AXES,), "six angles are needed")
        object.__setattr__(self, "links", rows)
        object.__setattr__(self, "offsets", turns)
        names = self.names or tuple(f"joint {k + 1}" for k in range(AXES))
        if len(names) != AXES:
            raise InputError("six names are needed", where="names")
        object.__setattr__(self, "names", tuple(names))
        if self.limits is not None:
            message = "six rows (smallest, largest angle) are needed"
            limits = np.array(self.limits, float)
            if limits.shape != (AXES, 2) or np.isnan(limits).any():
                raise InputError(message, where="limits")
            for name, (low, high) in zip(names, limits, strict=True):
                if low > high:
                    raise InputError(
                        f"the limits of {name} are reversed: {low:g} > {high:g}", where="limits"
                    )
            object.__setattr__(self, "limits", limits)
        for key in ("base", "tool"):
            object.__setattr__(self, key, place_of(getattr(self, key), key))

    def forward(self, angles: ArrayLike) -> Matrices:
        """Return the places (..., 4, 4) of the tool at joint angles (..., 6)."""
        q = np.asarray(angles, float)
        if q.shape[-1:] != (AXES,):
            raise InputError("six angles are needed in each row", where="angles")
        theta = (q + self.offsets).reshape(-1, AXES).T
        X, Y, Z, P, _, _ = frames(self.links, theta)
        hand = np.zeros((theta.shape[1], 4, 4))
        hand[:, :3] = np.stack([X, Y, Z, P]).transpose(2, 1, 0)
        hand[:, 3, 3] = 1
        placed: Matrices = self.base @ hand @ self.tool
        return placed.reshape(*q.shape[:-1], 4, 4)

    @property
    def size(self) -> float:
        """Root of the sum of the squares of its lengths [m]."""
        return float(np.sqrt((self.links[:, [0, 2]] ** 2).sum())) or 1.0


def _numbers(values: ArrayLike, where: str, shape: tuple[int, ...], message: str) -> Floats:
    try:
        array = np.array(values, float)
    except (TypeError, ValueError):
        raise InputError(message, where=where) from None
    if array.shape != shape:
        raise InputError(message, where=where)
    if not np.isfinite(array).all():
        raise InputError("a number is not finite", where=where)
    return array


def place_of(frame: ArrayLike, where: str) -> Matrix:
    """Return a place (4, 4) of rows (3, 4) or (4, 4), after a look at its rotation."""
    matrix = np.array(frame, float)
    if matrix.shape not in ((3, 4), (4, 4)):
        raise InputError("a matrix of 3 or 4 rows of 4 is needed", where=where)
    if not np.isfinite(matrix).all() or not is_rotation(matrix[:3, :3]):
        raise InputError(f"the first three columns of the {where} are no rotation", where=where)
    whole = np.eye(4)
    whole[:3] = matrix[:3]
    return whole


def is_rotation(R: Matrices) -> Booleans:
    """Return of matrices (..., 3, 3) whether each is a rotation."""
    with np.errstate(all="ignore"):
        gap = np.abs(R @ np.swapaxes(R, -1, -2) - np.eye(3)).max(axis=(-2, -1))
        good: Booleans = (gap <= ROTATION) & (np.linalg.det(R) > 0)
    return good


def frames(links: Matrix, theta: Numbers) -> tuple[Numbers, ...]:
    """Return where the hand is, and the axes before it, real or complex.

    `theta` (6, m). Columns of the hand's matrix (3, m): X, Y, Z and its origin P; directions
    (6, 3, m) of the axes and points (6, 3, m) on them.
    """
    c, s = np.cos(theta), np.sin(theta)
    n, m = c.shape
    X, Y, Z, P = np.zeros((4, 3, m), c.dtype)
    X[0] = Y[1] = Z[2] = 1
    axes, points = np.empty((n, 3, m), c.dtype), np.empty((n, 3, m), c.dtype)
    for k, (a, alpha, d) in enumerate(links):
        axes[k], points[k] = Z, P
        ca, sa = np.cos(alpha), np.sin(alpha)
        X, turned = c[k] * X + s[k] * Y, c[k] * Y - s[k] * X
        P = P + d * Z + a * X
        Y, Z = ca * turned + sa * Z, ca * Z - sa * turned
    return X, Y, Z, P, axes, points


def mirrored(links: Matrix) -> Matrix:
    """Return the same arm from the hand to the foot; its angles are opposite, in turned order."""
    back = np.zeros((AXES, 3))
    back[:5, :2] = -links[4::-1, :2]
    back[:, 2] = -links[::-1, 2]
    return back


def mirrored_hands(links: Matrix, R: Matrices, t: Matrix) -> tuple[Matrices, Matrix]:
    """Return rotations (n, 3, 3) and origins (n, 3) of the foot, seen from the hand."""
    a, alpha = links[5, :2]
    end = turn_x(-alpha)
    foot = -np.einsum("nji,nj->ni", R, t) + [a, 0, 0]
    return np.einsum("ji,nkj->nik", end, R), foot @ end


def turn_x(angle: float) -> Matrix:
    c, s = np.cos(angle), np.sin(angle)
    return np.array([[1, 0, 0], [0, c, -s], [0, s, c]])


def arm_of_axes(
    points: ArrayLike,
    axes: ArrayLike,
    hand: ArrayLike,
    limits: Matrix | None = None,
    names: Sequence[str] = (),
) -> Arm:
    """Return the arm whose six axes go through points (6, 3) [m] in directions (6, 3).

    They and the place of the hand (4, 4) are those at joint angles of 0. Common normals lead from
    axis to axis; of parallel ones that of the foot before.
    """
    P = _numbers(points, "points", (AXES, 3), "six points are needed")
    z = _numbers(axes, "axes", (AXES, 3), "six directions are needed")
    lengths = np.linalg.norm(z, axis=1)
    if lengths.min() == 0:
        raise InputError(f"axis {int(lengths.argmin()) + 1} has no direction", where="axes")
    z = z / lengths[:, None]
    hand = place_of(hand, "hand")
    size = float(np.ptp(P, axis=0).max()) or 1.0
    links, offsets = np.zeros((AXES, 3)), np.zeros(AXES)
    base, x_before, foot = np.eye(4), np.zeros(3), P[0]
    for k in range(AXES - 1):
        x, a, alpha, along, to = normal(P[k], z[k], P[k + 1], z[k + 1], foot, size)
        if not x.any():  # the axes are one
            x = x_before if k else np.cross(z[0], np.eye(3)[np.abs(z[0]).argmin()])
            x = x / np.linalg.norm(x)
        links[k, :2] = a, alpha
        if k:
            links[k, 2] = (along - foot) @ z[k]
            offsets[k] = np.arctan2(np.cross(x_before, x) @ z[k], x_before @ x)
        else:
            base[:3] = np.column_stack([x, np.cross(z[0], x), z[0], along])
        x_before, foot = x, to
    links[np.abs(links) <= 1e-15 * np.array([size, 1, size])] = 0
    last = np.eye(4)
    last[:3] = np.column_stack([x_before, np.cross(z[5], x_before), z[5], foot])
    return Arm(links, offsets, limits, base, np.linalg.inv(last) @ hand, tuple(names))


def normal(p: Floats, z: Floats, q: Floats, w: Floats, foot: Floats, size: float) -> Any:
    """Return the common normal of two axes: direction, length, twist, where it leaves and ends.

    The direction is 0 where the axes are one; parallel ones have the normal at `foot`.
    """
    x = np.cross(z, w)
    sine, c, gap = float(np.linalg.norm(x)), float(z @ w), q - p
    if sine < PARALLEL:
        rest = gap - (gap @ z) * z
        a, alpha = float(np.linalg.norm(rest)), 0.0 if c > 0 else np.pi
        if a <= MEETS * size:
            return np.zeros(3), 0.0, alpha, foot, foot
        return rest / a, a, alpha, foot, foot + rest
    x = x / sine
    square = sine * sine
    first, second = float(gap @ z), float(gap @ w)
    along = p + (first - c * second) / square * z
    end = q + (c * first - second) / square * w
    a = float(gap @ x)
    return x, 0.0 if abs(a) <= MEETS * size else a, float(np.arctan2(sine, c)), along, end
