"""Closures of spatial chains by dual quaternions, many sets of dimensions at once, in 80 bits.

Owes nothing to the package: a joint is a product of turns about and shifts along its axes, a body
the product of all on its way from the ground, and a loop closes where two ways lead to one place.
Newton's method corrects the joints by the screws of their freedoms. All arrays have the set first.
A dual quaternion is (..., 8): real part first, then the dual one; 1 + eps t / 2 is the shift by t.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

FREEDOMS = {
    "R": ("turn z",),
    "P": ("shift z",),
    "H": ("screw z",),
    "C": ("turn z", "shift z"),
    "U": ("turn z", "turn x"),
    "S": ("spin x", "spin y", "spin z"),
    "E": ("shift x", "shift y", "turn z"),
    "W": (),
    "F": ("shift x", "shift y", "shift z", "spin x", "spin y", "spin z"),
    "D": (),
}
"""What a joint does between its frames, in this order; spins are kept as a quaternion. F is a body
that hangs on bars alone; D a bar, an equation between two points, which never places a body."""
EXACT = np.longdouble
TURN = 8 * np.arctan(EXACT(1))


def times(p: Any, q: Any) -> Any:
    """Return the product of dual quaternions."""
    a, b, c, d = p[..., :4], p[..., 4:], q[..., :4], q[..., 4:]
    return np.concatenate([product(a, c), product(a, d) + product(b, c)], axis=-1)


def product(p: Any, q: Any) -> Any:
    """Return the product of quaternions."""
    a, b, c, d = p[..., 0], p[..., 1], p[..., 2], p[..., 3]
    e, f, g, h = q[..., 0], q[..., 1], q[..., 2], q[..., 3]
    first = a * e - b * f - c * g - d * h
    found = np.empty((*first.shape, 4), first.dtype)
    found[..., 0] = first
    found[..., 1] = a * f + b * e + c * h - d * g
    found[..., 2] = a * g - b * h + c * e + d * f
    found[..., 3] = a * h + b * g - c * f + d * e
    return found


def cross(u: Any, v: Any) -> Any:
    """Return the vector product; that of NumPy takes several times as long for few vectors."""
    a, b, c = u[..., 0], u[..., 1], u[..., 2]
    d, e, f = v[..., 0], v[..., 1], v[..., 2]
    first = b * f - c * e
    found = np.empty((*first.shape, 3), first.dtype)
    found[..., 0], found[..., 1], found[..., 2] = first, c * d - a * f, a * e - b * d
    return found


def turned_back(p: Any) -> Any:
    """Return the inverse of a dual quaternion of length 1."""
    return p * np.array([1, -1, -1, -1, 1, -1, -1, -1], p.dtype)


def moved(rotation: Any, place: Any) -> Any:
    """Return the dual quaternion of a quaternion of length 1 and the place of the origin."""
    way = np.concatenate([np.zeros_like(place[..., :1]), place], axis=-1)
    return np.concatenate([rotation, product(way, rotation) / 2], axis=-1)


def place_of(p: Any) -> Any:
    """Return where the origin is."""
    return 2 * product(p[..., 4:], p[..., :4] * np.array([1, -1, -1, -1], p.dtype))[..., 1:]


def vector_by(q: Any, v: Any) -> Any:
    """Return a vector turned by a quaternion of length 1."""
    w, u = q[..., :1], q[..., 1:]
    t = 2 * cross(u, v)
    return v + w * t + cross(u, t)


def point_of(p: Any, s: Any) -> Any:
    """Return the place of a point s of a body."""
    return vector_by(p[..., :4], s) + place_of(p)


def frame(axis: Any, zero: Any) -> Any:
    """Return the quaternion of the frame with z along `axis` and x in its plane with `zero`."""
    z = axis / length(axis)
    x = zero - z * (z * zero).sum(-1, keepdims=True)
    x = x / length(x)
    return quaternion(np.stack([x, cross(z, x), z], axis=-1))


def quaternion(R: Any) -> Any:
    """Return quaternions of rotation matrices (..., 3, 3), by the largest of four components."""
    t = np.trace(R, axis1=-2, axis2=-1)
    K = np.empty((*R.shape[:-2], 4, 4), R.dtype)  # 4 e e', by Shepperd's sums
    K[..., 0, 0] = 1 + t
    for i in range(3):
        j, k = (i + 1) % 3, (i + 2) % 3
        K[..., i + 1, i + 1] = 1 + 2 * R[..., i, i] - t
        K[..., 0, i + 1] = K[..., i + 1, 0] = R[..., k, j] - R[..., j, k]
        K[..., i + 1, j + 1] = K[..., j + 1, i + 1] = R[..., i, j] + R[..., j, i]
    best = np.diagonal(K, axis1=-2, axis2=-1).argmax(-1)
    row = np.take_along_axis(K, best[..., None, None], axis=-2)[..., 0, :]
    return row / length(row)


def length(v: Any) -> Any:
    return np.sqrt((v * v).sum(-1, keepdims=True))


@dataclass
class Pair:
    """A joint from body `first` to body `second`, with its frames there (k, 8), for k sets.

    Bodies are numbers, 0 the ground. ``number`` (k,) is the shift of a screw per radian, the length
    of a bar.
    """

    kind: str
    first: int
    second: int
    own: Any
    other: Any
    number: Any = None


@dataclass
class Mesh:
    """first = size second + phase of two freedoms, each by pair and place; numbers are (k,)."""

    first: tuple[int, int]
    second: tuple[int, int]
    size: Any
    phase: Any


class Loops:
    """Bodies placed one after the other by pairs, and pairs that close loops.

    Parameters
    ----------
    pairs
        Of all bodies.
    driven
        Number of the pair and of its freedom that is driven.
    meshes
        Wheels and racks.
    """

    def __init__(self, pairs: list[Pair], driven: tuple[int, int], meshes: list[Mesh]) -> None:
        self.pairs, self.meshes = pairs, meshes
        self.first, count = [], 0
        for pair in pairs:
            self.first.append(count)
            count += len(FREEDOMS[pair.kind])
        self.count, self.driven = count, self.column(driven)
        self.free = [k for k in range(count) if k != self.driven]
        self.sets = len(pairs[0].own)
        self.order = self._order()

    def _order(self) -> list[tuple[int, str]]:
        """Return how the pairs are used: they place a body forth or back, or close a loop."""
        known, order, left = {0}, [], list(range(len(self.pairs)))
        while left:
            for k in left:
                ends = self.pairs[k].first, self.pairs[k].second
                told = [end in known for end in ends]
                if all(told):
                    order.append((k, "close"))
                elif any(told) and self.pairs[k].kind != "D":
                    order.append((k, "forth" if told[0] else "back"))
                    known.update(ends)
                else:
                    continue
                left.remove(k)
                break
            else:
                raise ValueError("a body hangs on nothing")
        return order

    def column(self, freedom: tuple[int, int]) -> int:
        """Return the number of a freedom among all."""
        return self.first[freedom[0]] + freedom[1]

    def chosen(self, which: Any) -> Loops:
        """Return the loops of some of the sets."""
        pairs = [
            Pair(p.kind, p.first, p.second, p.own[which], p.other[which],
                 None if p.number is None else p.number[which]) for p in self.pairs
        ]  # fmt: skip
        meshes = [Mesh(m.first, m.second, m.size[which], m.phase[which]) for m in self.meshes]
        chosen = Loops(pairs, (0, 0), meshes)
        chosen.driven, chosen.free = self.driven, self.free
        return chosen

    def spun(self, number: int) -> int:
        """Return the column of the first spin of a pair that has a quaternion."""
        return self.first[number] + FREEDOMS[self.pairs[number].kind].index("spin x")

    def read(self, bodies: dict[int, Any], turns: dict[int, Any]) -> tuple[Any, dict[int, Any]]:
        """Return coordinates (k, n) and spins of joints by the places of all bodies (k, 8).

        Angles are within half a turn of 0, but those named in `turns` by their column.
        """
        c, spins = np.zeros((self.sets, self.count), EXACT), {}
        for k, pair in enumerate(self.pairs):
            here = times(bodies[pair.first], pair.own)
            way = times(turned_back(here), times(bodies[pair.second], pair.other))
            w, x, y, z = (way[..., i] for i in range(4))
            shift, at = place_of(way), self.first[k]
            turn = 2 * np.arctan2(z, w)
            turn = turn - TURN * np.round(turn / TURN)
            if pair.kind in "RCH":
                c[:, at] = turn
            if pair.kind == "P":
                c[:, at] = shift[:, 2]
            if pair.kind == "C":
                c[:, at + 1] = shift[:, 2]
            if pair.kind == "E":
                c[:, at], c[:, at + 1], c[:, at + 2] = shift[:, 0], shift[:, 1], turn
            if pair.kind == "U":  # (cos a/2 + k sin a/2)(cos b/2 + i sin b/2)
                c[:, at] = 2 * np.arctan2(z, w)
                half = c[:, at] / 2
                along = np.where(np.abs(np.cos(half)) > 0.5, x / np.cos(half), y / np.sin(half))
                across = np.where(np.abs(np.cos(half)) > 0.5, w / np.cos(half), z / np.sin(half))
                c[:, at + 1] = 2 * np.arctan2(along, across)
            if pair.kind == "F":
                c[:, at : at + 3] = shift
            if pair.kind in "SF":
                spins[k] = way[..., :4] / length(way[..., :4])
            for i, freedom in enumerate(FREEDOMS[pair.kind]):
                near = turns.get(at + i)
                if near is not None and freedom.split()[0] in ("turn", "screw"):
                    c[:, at + i] += TURN * np.round((near - c[:, at + i]) / TURN)
        return c, spins

    def placed(self, c: Any, spins: dict[int, Any]) -> tuple[Any, Any, Any]:
        """Return the bodies, the gaps (k, rows) and their slopes (k, rows, n) by the freedoms."""
        bodies, _, _, gaps, slopes = self._frames(c, spins)
        every = [bodies[i] for i in sorted(bodies)]
        return every, np.concatenate(gaps, axis=1), np.concatenate(slopes, axis=1)

    def _frames(
        self, c: Any, spins: dict[int, Any]
    ) -> tuple[dict[int, Any], dict[int, Any], Any, list[Any], list[Any]]:
        """Return bodies, of which freedoms each is moved (n,), their screws (k, 6, n), the rows."""
        kind, k = c.dtype, len(c)
        one = np.zeros((k, 8), kind)
        one[:, 0] = 1
        bodies: dict[int, Any] = {0: one}
        ways: dict[int, Any] = {0: np.zeros(self.count)}
        screws = np.zeros((k, 6, self.count), np.float64)
        gaps, slopes = [], []
        for number, use in self.order:
            pair = self.pairs[number]
            own, other = pair.own.astype(kind), pair.other.astype(kind)
            if pair.kind == "D":
                gap, slope = self._bar(pair, bodies, ways, screws)
                gaps.append(gap)
                slopes.append(slope)
                continue
            motions = self._motions(number, c, spins)
            whole = motions[-1]
            if use == "back":
                start = times(times(bodies[pair.second], other), turned_back(whole))
                bodies[pair.first] = times(start, turned_back(own))
            start = times(bodies[pair.first], own)
            self._screws(number, start, motions, screws)
            way = np.zeros(self.count)
            way[self.first[number] : self.first[number] + len(FREEDOMS[pair.kind])] = 1
            if use == "back":
                ways[pair.first] = ways[pair.second] - way
                continue
            end = times(times(start, whole), turned_back(other))
            if use == "forth":
                bodies[pair.second], ways[pair.second] = end, ways[pair.first] + way
                continue
            gap = times(end, turned_back(bodies[pair.second]))
            gap = gap * np.where(gap[:, :1] < 0, -1, 1)
            gaps += [2 * gap[:, 1:4], place_of(gap)]
            slopes.append(screws * (ways[pair.first] + way - ways[pair.second]))
        for mesh in self.meshes:
            a, b = self.column(mesh.first), self.column(mesh.second)
            gaps.append((c[:, a] - mesh.size * c[:, b] - mesh.phase)[:, None])
            row = np.zeros((k, 1, self.count))
            row[:, 0, a], row[:, 0, b] = 1, -mesh.size
            slopes.append(row)
        return bodies, ways, screws, gaps, slopes

    def _bar(self, pair: Pair, bodies: Any, ways: Any, screws: Any) -> tuple[Any, Any]:
        """Return how much too long a bar is (k, 1), and its slope (k, 1, n)."""
        kind = bodies[0].dtype
        P1 = point_of(bodies[pair.first], place_of(pair.own.astype(kind)))
        P2 = point_of(bodies[pair.second], place_of(pair.other.astype(kind)))
        gap = P2 - P1
        whole = length(gap)
        d = (gap / whole).astype(float)
        row = np.zeros((len(d), 1, self.count))
        for P, way, sense in ((P1, ways[pair.first], -1), (P2, ways[pair.second], 1)):
            turns, shifts = screws[:, :3].swapaxes(1, 2), screws[:, 3:].swapaxes(1, 2)
            speeds = shifts + cross(turns, P.astype(float)[:, None])
            row[:, 0] += sense * way * (speeds @ d[..., None])[..., 0]
        return whole - pair.number[:, None].astype(kind), row

    def _motions(self, number: int, c: Any, spins: Any) -> list[Any]:
        """Return the motion of a pair before each of its freedoms, and the whole one."""
        pair, kind, k = self.pairs[number], c.dtype, len(c)
        here = np.zeros((k, 8), kind)
        here[:, 0] = 1
        found = [here]
        for i, freedom in enumerate(FREEDOMS[pair.kind]):
            word, axis = freedom.split()
            unit = np.zeros((k, 3), kind)
            unit[:, "xyz".index(axis)] = 1
            here = times(here, self._motion(pair, word, unit, c[:, self.first[number] + i]))
            found.append(here)
        if number in spins:
            found.append(times(here, moved(spins[number].astype(kind), np.zeros((k, 3), kind))))
        return found

    def _screws(self, number: int, start: Any, motions: list[Any], screws: Any) -> None:
        """Write the screws of a pair's freedoms: turn, and speed of the point at the origin."""
        pair = self.pairs[number]
        for i, freedom in enumerate(FREEDOMS[pair.kind]):
            here, at = times(start, motions[i]), self.first[number] + i
            word, axis = freedom.split()
            unit = np.zeros((len(start), 3), start.dtype)
            unit[:, "xyz".index(axis)] = 1
            direction = vector_by(here[..., :4], unit).astype(float)
            if word == "shift":
                screws[:, 3:, at] = direction
                continue
            screws[:, :3, at] = direction
            screws[:, 3:, at] = cross(place_of(here).astype(float), direction)
            if word == "screw":
                screws[:, 3:, at] += pair.number[:, None].astype(float) * direction

    def _motion(self, pair: Pair, word: str, unit: Any, value: Any) -> Any:
        half, shift = value / 2, np.zeros_like(unit)
        rotation = np.zeros((len(value), 4), unit.dtype)
        rotation[:, 0] = 1
        if word in ("turn", "screw"):
            rotation[:, 0], rotation[:, 1:] = np.cos(half), unit * np.sin(half)[:, None]
        if word == "shift":
            shift = unit * value[:, None]
        if word == "screw":
            shift = unit * (pair.number.astype(unit.dtype) * value)[:, None]
        return moved(rotation, shift)

    def corrected(self, c: Any, spins: Any, step: Any) -> tuple[Any, Any]:
        """Return coordinates and spins after a step (k, free)."""
        c, spins = c.copy(), dict(spins)
        c[:, self.free] += step
        for k, q in spins.items():
            at = self.spun(k)
            small, c[:, at : at + 3] = c[:, at : at + 3].copy(), 0
            half = length(small) / 2
            share = np.where(half > 0, np.sin(half) / np.where(half > 0, half, 1), 1) / 2
            q = product(np.concatenate([np.cos(half), share * small], axis=-1), q)
            spins[k] = q / length(q)
        return c, spins

    def solve(self, J: Any, right: Any) -> Any:
        """Return the least x (k, n) with J x = right; free links may spin."""
        right = np.asarray(right, float)[..., None]
        if J.shape[1] == J.shape[2]:
            try:
                return np.linalg.solve(J, right)[..., 0]
            except np.linalg.LinAlgError:  # of one set, at a fold to the last bit
                pass
        lost = ~np.isfinite(J).all(axis=(1, 2))
        J = np.where(lost[:, None, None], 0.0, J)
        found = (np.linalg.pinv(J, rcond=1e-14) @ right)[..., 0]
        return np.where(lost[:, None], np.nan, found)

    def newton(self, c: Any, spins: Any, most: int = 8) -> tuple[Any, Any, Any, Any]:
        """Return coordinates, spins, and the sizes (k,) of the first and of the last step."""
        first = last = None
        for _ in range(most):
            _, gaps, slopes = self.placed(c, spins)
            step = -self.solve(slopes[..., self.free], gaps)
            c, spins = self.corrected(c, spins, step)
            last = np.abs(step).max(axis=1)
            first = last if first is None else first
            if (last < 1e-18).all():
                break
        return c, spins, first, last

    def at(self, c: Any, u: Any) -> Any:
        """Return coordinates with the driver at u (k,)."""
        c = c.copy()
        c[:, self.driven] = u
        return c
