"""Dyads of three, four and five poses, with NumPy alone and by other ways than those of the page.

A pose is (x, y, angle). A dyad is a point of the body, where it is in the first pose, and a pivot.
Three poses and a pivot: seen from the body the pivot is at three places, whose circle has the point
in its middle. Four: the compatibility linkage of the dyad's vectors (Sandor & Erdman). Five: the
circle-point cubics of two sets of four poses, by their resultant; Newton's method goes on from the
real parts of all its roots.
"""

from __future__ import annotations

import numpy as np


def displacements(poses):
    """Return turns and shifts (n - 1,), complex: z of the first pose goes to a z + b."""
    poses = np.asarray(poses, float)
    place = poses[:, 0] + 1j * poses[:, 1]
    a = np.exp(1j * (poses[1:, 2] - poses[0, 2]))
    return a, place[1:] - a * place[0]


def misses(poses, point, pivot):
    """Return by how much the distance of a point from its pivot differs from the first pose's."""
    a, b = displacements(poses)
    return np.abs(a * point + b - pivot) - abs(point - pivot)


def point_of_pivot(poses, pivot):
    """Return the point of the body that keeps its distance from a pivot in three poses."""
    a, b = displacements(poses)
    seen = np.concatenate([[pivot], (pivot - b) / a])
    rows = np.stack([(seen[1:] - seen[0]).real, (seen[1:] - seen[0]).imag], axis=1)
    x, y = np.linalg.solve(rows, (np.abs(seen[1:]) ** 2 - abs(seen[0]) ** 2) / 2)
    return complex(x, y)


def dyads_of_four(poses, turn):
    """Return the dyads of four poses whose crank turns by `turn` from the first to the second."""
    a, b = displacements(poses)
    place = complex(*poses[0][:2])
    delta = a * place + b - place
    alpha = a - 1
    # W (exp(i beta) - 1) + Z alpha = delta: three equations for two unknowns
    minor = [
        delta[1] * alpha[2] - delta[2] * alpha[1],
        delta[2] * alpha[0] - delta[0] * alpha[2],
        delta[0] * alpha[1] - delta[1] * alpha[0],
    ]
    known = -sum(minor) + minor[0] * np.exp(1j * turn)
    far, second, third = abs(known), abs(minor[1]), abs(minor[2])
    cosine = (third**2 - far**2 - second**2) / (2 * far * second)
    if abs(cosine) > 1:
        return []
    found = []
    for sign in (-1, 1):
        own = known / far * np.exp(1j * sign * np.arccos(cosine))
        beta = own * second / minor[1]  # |known + minor[1] beta| = third
        matrix = np.array([[np.exp(1j * turn) - 1, alpha[0]], [beta - 1, alpha[1]]])
        w, z = np.linalg.solve(matrix, delta[:2])
        point = place - z
        found.append((point, point - w))
    return found


def _cubic(a, b, x, y):
    """Return the determinant that vanishes where a point has a pivot in four poses."""
    z, conj = x + 1j * y, x - 1j * y
    u, v = (1 - a) * z - b, (1 - a.conj()) * conj - b.conj()
    rows = np.stack([u, v, b * b.conj() + a * z * b.conj() + a.conj() * conj * b], axis=1)
    return np.linalg.det(rows) / 1j


def dyads_of_five(poses):
    """Return all real dyads of five poses."""
    poses = np.asarray(poses, float)
    size = np.abs(poses[1:, :2] - poses[0, :2]).max()
    scaled = (poses - [*poses[0, :2], 0.0]) / [size, size, 1.0]
    a, b = displacements(scaled)
    sets = [[0, 1, 2], [0, 1, 3]]
    heights = np.exp(2j * np.pi * np.arange(4) / 4)
    count = 16
    around = np.exp(2j * np.pi * (np.arange(count) + 0.3) / count)
    values = []
    for x in around:
        polys = [np.fft.fft([_cubic(a[s], b[s], x, y) for y in heights]) / 4 for s in sets]
        values.append(np.linalg.det(_sylvester(*polys)))
    coefficients = np.fft.fft(values) / count * np.exp(-2j * np.pi * 0.3 * np.arange(count) / count)
    found = []
    for x in np.roots(coefficients[:10][::-1]):
        first = np.fft.fft([_cubic(a[sets[0]], b[sets[0]], x, y) for y in heights]) / 4
        for y in np.roots(first[::-1]):
            dyad = _polished(a, b, complex(x.real, y.real))
            if dyad is None:
                continue
            point, pivot = (value * size + complex(*poses[0, :2]) for value in dyad)
            if all(abs(point - known) > 1e-6 * (abs(point) + size) for known, _ in found):
                found.append((point, pivot))
    return found


def _sylvester(p, q):
    rows = np.zeros((6, 6), complex)
    for k in range(3):
        rows[k, k : k + 4] = p[::-1]
        rows[k + 3, k : k + 4] = q[::-1]
    return rows


def _polished(a, b, z):
    """Return the dyad that Newton's method reaches from a point, or None."""
    w = (1 - a) * z - b
    rows = np.stack([w.real, w.imag], axis=1)
    constant = np.abs(b) ** 2 / 2 + (a * z * b.conj()).real
    m = complex(*np.linalg.lstsq(rows, -constant, rcond=None)[0])
    for _ in range(30):
        value = (((1 - a) * z - b) * np.conj(m)).real + np.abs(b) ** 2 / 2 + (a * z * b.conj()).real
        by_z = (1 - a) * np.conj(m) + a * b.conj()
        by_m = (1 - a) * z - b
        jacobian = np.stack([by_z.real, -by_z.imag, by_m.real, by_m.imag], axis=1)
        step = np.linalg.lstsq(jacobian, -value, rcond=None)[0]
        z, m = z + complex(*step[:2]), m + complex(*step[2:])
        if abs(step).max() < 1e-13 * (1 + abs(z) + abs(m)):
            return (z, m) if abs(z - m) < 1e6 else None
    return None


def planted(generator, count):
    """Return a four-bar (points and pivots, complex) and poses that it meets on one branch."""
    while True:
        z1, z2, m1, m2 = generator.uniform(-1, 1, (4, 2)) @ [1, 1j]
        crank, bar, rocker = abs(z1 - m1), abs(z2 - z1), abs(z2 - m2)
        side = np.sign(((z2 - z1).conjugate() * (m2 - z2)).imag)
        poses = [(0.0, 0.0, 0.0)]
        for turn in np.sort(generator.uniform(0.3, 3.0, count - 1)):
            pin = m1 + (z1 - m1) * np.exp(1j * turn)
            ground = m2 - pin
            along = (bar**2 - rocker**2 + abs(ground) ** 2) / (2 * abs(ground))
            if abs(along) >= bar:
                break
            end = pin + (along - 1j * side * np.sqrt(bar**2 - along**2)) * ground / abs(ground)
            turned = (end - pin) / (z2 - z1)
            origin = pin - turned * z1
            poses.append((origin.real, origin.imag, float(np.angle(turned))))
        long = min(crank, bar, rocker, abs(m1 - m2)) > 0.1
        if len(poses) == count and long:
            return (z1, z2), (m1, m2), poses
