"""From rotation matrices with their rates to quaternions, angular velocities and accelerations."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from mechdae.types import Floats, Matrices


def turning(values: Sequence[Floats], names: Sequence[str]) -> dict[str, Floats]:
    """Return the series of a body by their names.

    Parameters
    ----------
    values
        The matrix, column by column, and its rates: (n, 9) each.
    names
        Of the unit quaternion (n, 4), real part first, continuous from row to row, and of the
        angular velocity, acceleration and jerk (n, 3) in the fixed frame.
    """
    R, *rates = (y.reshape(-1, 3, 3).transpose(0, 2, 1) for y in values)
    result = {names[0]: quaternions(R)}
    matrices = [R, *rates]

    def product(i: int, j: int) -> Any:
        return np.einsum("nab,ncb->nac", matrices[i], matrices[j])

    sums = ([(1, 0, 1)], [(2, 0, 1), (1, 1, 1)], [(3, 0, 1), (2, 1, 2), (1, 2, 1)])
    for name, terms in zip(names[1:], sums[: len(rates)], strict=False):
        W = sum(times * product(i, j) for i, j, times in terms)
        result[name] = (
            np.stack(
                [W[:, 2, 1] - W[:, 1, 2], W[:, 0, 2] - W[:, 2, 0], W[:, 1, 0] - W[:, 0, 1]], axis=1
            )
            / 2
        )
    return result


def quaternions(R: Matrices) -> Floats:
    """Return unit quaternions (n, 4) of rotation matrices (n, 3, 3), real part first.

    The largest component is found first, so that no digits are lost. The first row has a real
    part that is not negative; each other one is the nearer of both to the last known one.
    """
    diagonal = np.einsum("nii->ni", R)
    trace = diagonal.sum(axis=1)
    squares = np.concatenate([1 + trace[:, None], 1 + 2 * diagonal - trace[:, None]], axis=1)
    known = np.isfinite(squares).all(axis=1)
    result = np.full((len(R), 4), np.nan)
    first = np.argmax(np.where(known[:, None], squares, 0.0), axis=1)
    products = np.empty((len(R), 4, 4))
    products[:, range(4), range(4)] = squares
    for i, (a, b) in enumerate(((2, 1), (0, 2), (1, 0)), start=1):
        products[:, 0, i] = products[:, i, 0] = R[:, a, b] - R[:, b, a]
    for a, b in ((0, 1), (0, 2), (1, 2)):
        products[:, a + 1, b + 1] = products[:, b + 1, a + 1] = R[:, a, b] + R[:, b, a]
    rows = products[np.arange(len(R)), first]
    result[known] = rows[known] / np.linalg.norm(rows[known], axis=1, keepdims=True)
    last = np.array([1.0, 0.0, 0.0, 0.0])
    for k in np.flatnonzero(known):
        if result[k] @ last < 0:
            result[k] = -result[k]
        last = result[k]
    return result
