"""`arm_poses`: all joint angles of an arm at places of its hand, with statuses and proofs."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import ArrayLike

from mechdae.errors import InputError
from mechdae.numerics.arms import wrists
from mechdae.numerics.arms.certified import certified, off_target
from mechdae.numerics.arms.chain import AXES, Arm, frames, is_rotation, mirrored, mirrored_hands
from mechdae.numerics.arms.eliminant import MOST, OPEN, all_poses
from mechdae.records import dataclass
from mechdae.types import Booleans, Complexes, Floats, Integers, Matrices, Matrix, Texts

BLOCK = 256
"""Targets that closed forms take at once."""
ALIKE = 1e-6
"""Distance of exp(i theta) below which singular poses are one."""
LIMIT = 1e-9
"""Angle by which a pose may be outside of a joint's limits [rad]."""
FREE = 1e-9
"""Singular value of the joints' screws below which they depend on each other in all poses."""
WHOLE = 2 * np.pi


@dataclass(frozen=True)
class ArmPoses:
    """Real poses at one place of the hand.

    Attributes
    ----------
    angles
        (k, 6), of the joints within their limits [rad].
    status
        "ok": all poses, their number is proven. "out of reach": there is none, proven. "outside
        limits": all are outside of the joints' limits. "singular": near a singular pose, where
        poses meet or the arm moves by itself. "unproven": there may be more. "no rotation" and
        "nan": the target is no place.
    bounds
        (k,), the angles are that near to those of a pose, proven [rad]; nan without a proof.
    outside
        How many more poses are outside of the limits.
    most
        How many complex poses there can be, by a theorem.
    regular
        How many of these are certified.
    axes
        (m, 6, 3), directions of the axes in all complex poses that are certified, of general arms.
    """

    angles: Matrix
    status: str
    bounds: Floats
    outside: int
    most: int
    regular: int
    axes: Complexes | None = None

    @property
    def proven(self) -> bool:
        """Whether there are no other poses."""
        return self.status in PROVEN

    @property
    def singular(self) -> int:
        """How many complex poses are not certified."""
        return self.most - self.regular


PROVEN = ("ok", "out of reach", "outside limits")


@dataclass(frozen=True, repr=False)
class ArmPosesOfMany:
    """Real poses at n places of the hand; an index gives the `ArmPoses` of one.

    ``angles`` (n, most, 6) and ``bounds`` (n, most), nan behind the ``counts`` (n,) poses of each;
    ``status``, ``outside`` and ``regular`` (n,) are those of `ArmPoses`.
    """

    angles: Matrices
    counts: Integers
    status: Texts
    bounds: Matrix
    outside: Integers
    most: int
    regular: Integers
    axes: tuple[Complexes, ...] = ()

    @property
    def proven(self) -> Booleans:
        """Whether there are no other poses (n,)."""
        return np.isin(self.status, PROVEN)

    def __len__(self) -> int:
        return len(self.counts)

    def __iter__(self) -> Iterator[ArmPoses]:
        return (self[k] for k in range(len(self)))

    def __getitem__(self, k: int) -> ArmPoses:
        n, axes = self.counts[k], self.axes[k] if self.axes else None
        status, outside = str(self.status[k]), int(self.outside[k])
        angles, bounds = self.angles[k, :n], self.bounds[k, :n]
        return ArmPoses(angles, status, bounds, outside, self.most, int(self.regular[k]), axes)

    def __repr__(self) -> str:
        names, counts = np.unique(self.status, return_counts=True)
        said = ", ".join(f"{n} {name}" for name, n in zip(names, counts, strict=True))
        return f"<ArmPosesOfMany {len(self)} targets: {said}>"


def arm_poses(
    arm: Arm | Sequence[Sequence[float]] | Floats, targets: ArrayLike
) -> ArmPoses | ArmPosesOfMany:
    """Return all joint angles at which an arm's hand is at places.

    Parameters
    ----------
    arm
        An `Arm`, or rows (a [m], alpha [rad], d [m]) of Denavit and Hartenberg for six joints: the
        hand is at the product of Rz(theta) Tz(d) Tx(a) Rx(alpha).
    targets
        One place (4, 4) or (3, 4), rotation and origin [m], or many (n, 4, 4) or (n, 3, 4).

    Returns
    -------
    ArmPoses or ArmPosesOfMany
        Of one place or of many; there a target that is no place, or out of reach, has its status.

    Notes
    -----
    General arms have at most 16 poses, the eigenvalues of an eliminant: Raghavan and Roth (1993),
    Manocha and Canny (1994). Arms with parallel or meeting axes have closed forms.

    Raises
    ------
    InputError
        The numbers are no arm, the one target no place, or the arm's hand moves with five freedoms.

    Examples
    --------
    >>> half = 1.5707963267948966
    >>> rows = [(0, half, 0.16), (-0.43, 0, 0), (-0.39, 0, 0)]
    >>> arm = md.Arm([*rows, (0, half, 0.13), (0, -half, 0.1), (0, 0, 0.1)])
    >>> poses = md.arm_poses(arm, arm.forward([0.3, -1.2, 1.5, -0.4, 0.9, 0.2]))
    >>> poses.status, len(poses.angles)
    ('ok', 8)
    """
    whole = arm if isinstance(arm, Arm) else Arm(arm)  # type: ignore[arg-type]
    try:
        hands = np.array(targets, float)
    except (TypeError, ValueError):
        hands = np.zeros(0)
    if hands.ndim not in (2, 3) or hands.shape[-2:] not in ((3, 4), (4, 4)):
        raise InputError(
            f"a matrix of 3 or 4 rows of 4 is needed, or (n, 4, 4) of them, not {hands.shape}",
            where="targets",
        )
    if hands.ndim == 2:
        return arm_poses_at(whole, hands)
    _check_freedoms(whole)
    return _of_many(whole, hands[:, :3])


def arm_poses_at(arm: Arm, hand: Matrix) -> ArmPoses:
    """Return all joint angles at which the hand is at one place (3 or 4, 4); errors as there."""
    _check_freedoms(arm)
    one = _of_many(arm, hand[None, :3])[0]
    if one.status in ("nan", "no rotation"):
        raise InputError(
            "a number is not finite"
            if one.status == "nan"
            else "the first three columns of the target are no rotation",
            where="targets",
        )
    order = np.lexsort(np.round(one.angles, 9).T)
    return replace(one, angles=one.angles[order], bounds=one.bounds[order])


def _check_freedoms(arm: Arm) -> None:
    """Raise `InputError` for an arm whose hand has fewer than six freedoms in any pose."""
    axes, points = frames(arm.links, np.arange(1.0, AXES + 1)[:, None] ** 2)[4:]
    across = np.cross(axes[:, :, 0], points[:, :, 0] / -arm.size)
    values = np.linalg.svd(np.hstack([axes[:, :, 0], across]), compute_uv=False)
    if values[-1] < FREE:
        raise InputError(
            "the hand has fewer than six freedoms in all poses: axes are one, or four are parallel "
            "or meet",
            where="arm",
        )


def _of_many(arm: Arm, hands: Matrices) -> ArmPosesOfMany:
    n, links = len(hands), arm.links
    finite = np.array(np.isfinite(hands).all(axis=(1, 2)))
    hands = np.where(finite[:, None, None], hands, 0)
    good = finite & is_rotation(hands[:, :, :3])
    base, tool = np.linalg.inv(arm.base), np.linalg.inv(arm.tool)
    R, t = hands[:, :, :3], hands[:, :, 3]
    for _ in range(2):  # of matrices in a few digits the nearest rotation
        R = np.where(good[:, None, None], R @ (3 * np.eye(3) - np.swapaxes(R, 1, 2) @ R) / 2, R)
    t = t @ base[:3, :3].T + base[:3, 3] + (base[:3, :3] @ R) @ tool[:3, 3]
    R = base[:3, :3] @ R @ tool[:3, :3]
    closed, back = _closed_form(links)
    most = wrists.MOST if closed else MOST
    status = np.where(finite, "no rotation", "nan").astype("U14")
    angles, bounds = np.full((n, most, AXES), np.nan), np.full((n, most), np.nan)
    regular, axes = np.zeros(n, int), [np.zeros((0, AXES, 3), complex)] * n
    rows = np.flatnonzero(good)
    for k in range(0, len(rows), BLOCK):
        at = rows[k : k + BLOCK]
        if closed:
            found = _by_closed_form(closed, back, arm, R[at], t[at])
        else:
            found, complex_axes = all_poses(links, R[at], t[at], arm.size)
            for row, directions in zip(at, complex_axes, strict=True):
                axes[row] = directions
        angles[at], bounds[at], status[at], regular[at] = found
    angles, outside = _limited(arm, angles)
    order = np.argsort(np.isnan(angles[:, :, 0]), axis=1, kind="stable")
    angles = np.take_along_axis(angles, order[:, :, None], axis=1)
    bounds = np.take_along_axis(bounds, order, axis=1)
    counts = np.isfinite(angles[:, :, 0]).sum(axis=1)
    bounds[np.isnan(angles[:, :, 0])] = np.nan
    status[(status == "ok") & (counts == 0)] = "outside limits"
    return ArmPosesOfMany(
        angles, counts, status, bounds, outside, most, regular, () if closed else tuple(axes)
    )


ClosedForm = Callable[[Matrix, Matrices, Matrix], tuple[Floats, Booleans]]


def _closed_form(links: Matrix) -> tuple[ClosedForm | None, bool]:
    """Return what solves an arm in closed form, and whether from the hand to the foot."""
    at = wrists.wrist_at(links)
    if at:
        return wrists.wrist_poses, at < 0
    at = wrists.parallel_at(links)
    return (wrists.parallel_poses if at else None), at < 0


Found = tuple[Matrices, Matrix, Texts, Integers]


def _by_closed_form(closed: ClosedForm, back: bool, arm: Arm, R: Matrices, t: Matrix) -> Found:
    """Return angles (n, 8, 6), bounds, statuses and counts of certified poses."""
    links, size, n = arm.links, arm.size, len(t)
    with np.errstate(all="ignore"):
        if back:
            theta, sure = closed(mirrored(links), *mirrored_hands(links, R, t))
            theta = -theta[::-1]
        else:
            theta, sure = closed(links, R, t)
    real = np.isfinite(theta).all(axis=0)
    branch, row = np.nonzero(real)
    held = np.moveaxis(R, 0, 2)[:, :, row], t.T[:, row]
    found = certified(links, theta[:, branch, row], *held, size, 3)
    good = np.ones((wrists.MOST, n), bool)
    good[branch, row] = found.holds
    sure = sure & good.all(axis=0)
    raw, reached = theta[:, branch, row], found.holds.copy()
    loose = np.flatnonzero(~reached)  # poses all the same where they lead to the hand
    found.theta[:, loose], found.radius[loose] = raw[:, loose], np.nan
    reached[loose] = (
        off_target(links, raw[:, loose], held[0][..., loose], held[1][:, loose], size) < OPEN
    )
    angles = np.full((n, wrists.MOST, AXES), np.nan)
    bounds = np.full((n, wrists.MOST), np.nan)
    row, branch = row[reached], branch[reached]
    angles[row, branch] = _wrapped(found.theta[:, reached]).T
    bounds[row, branch] = found.radius[reached]
    angles[~sure] = distinct_poses(angles[~sure])
    counts = np.isfinite(angles[:, :, 0]).sum(axis=1)
    status = np.where(sure, np.where(counts > 0, "ok", "out of reach"), "singular")
    return angles, bounds, status, np.where(sure, wrists.MOST, counts)


def distinct_poses(angles: Matrices) -> Matrices:
    """Return angles (n, k, 6) of singular rows, nan where they are those of a pose before."""
    between = np.abs(np.exp(1j * angles[:, :, None]) - np.exp(1j * angles[:, None])).max(axis=3)
    twice = ((between < ALIKE) & np.tri(angles.shape[1], k=-1, dtype=bool)).any(axis=2)
    return np.where(twice[:, :, None], np.nan, angles)


def _wrapped(theta: Floats) -> Floats:
    return theta - WHOLE * np.round(theta / WHOLE)


def _limited(arm: Arm, angles: Matrices) -> tuple[Matrices, Integers]:
    """Return joint angles within limits, nan where there are none, and how many poses are not.

    Whole turns are taken such that an angle is within its limits, nearest to 0 among those.
    """
    there = np.isfinite(angles[:, :, 0])
    q = _wrapped(angles - arm.offsets) if arm.offsets.any() else angles
    if arm.limits is None:
        return q, np.zeros(len(q), int)
    low, high = arm.limits.T
    with np.errstate(invalid="ignore"):
        up = np.ceil((low - LIMIT - q) / WHOLE) * WHOLE
        down = np.floor((high + LIMIT - q) / WHOLE) * WHOLE
        inside = (up <= down).all(axis=2)
        q = q + np.clip(0, up, np.maximum(up, down))
    out = there & ~inside
    return np.where(inside[:, :, None], q, np.nan), out.sum(axis=1)
