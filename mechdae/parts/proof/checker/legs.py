"""A body on distances from known points: boxes of its quaternion and place."""

from __future__ import annotations

from typing import Any

from flint import arb, arb_mat

from .arithmetic import ONE, ZERO, Dual, Json, need
from .boxes import MET, WIDER, Box, Boxes, length
from .space import SpatialMechanism, dot, rotation


class LegBoxes(Boxes):
    """The body by its quaternion q and the place T of its origin, by the mechanism's size.

    One entry of q is 1, the others are at most 1: a chart for each of four. With N = |q|^2 and
    R~ = N R the equations are linear in (N T.T, N, N T, R~, R~' T).
    """

    n, order, met = 6, 4, 4 * MET

    def __init__(
        self, m: SpatialMechanism, group: list[str], joints: list[Json], known: set[str], z: Any
    ) -> None:
        super().__init__(m, group, joints, known, z)
        self.weights: list[float] = [2.0] * 3 + [1.0] * 3
        frames, rows = m.placed(z), list[list[arb]]()
        self.legs: list[tuple[list[arb], list[arb], arb]] = list[tuple[list[arb], list[arb], arb]]()
        """Known point, point of the body, length."""
        for joint in joints:
            distance = joint["kind"] == "distance" and len(group) == 1
            need(distance, "groups", f"more than distances of a body in {group}")
            one, other = joint["ends"][:: 1 if joint["bodies"][1] in group else -1]
            b = [v / m.size for v in m.place(one, frames)]
            p = [v / m.size for v in m.points[other[0]][other[1]]]
            square = joint["square"] / arb(m.size) ** 2
            self.legs.append((b, p, square.sqrt()))
            linear = [ONE, dot(p, p) + dot(b, b) - square, *(v * -2 for v in b)]
            rows.append([*linear, *(v * w * -2 for v in b for w in p), *(v * 2 for v in p)])
        self.C = arb_mat(rows)

    def first(self) -> list[Box]:
        reaches = [reach + length(b) + length(p) for b, p, reach in self.legs]
        far = min(float(reach.upper()) for reach in reaches) * (1 + 1e-9)
        return [(chart, [0.0] * 6, [1.0] * 3 + [far] * 3) for chart in range(4)]

    def shrunk(self, box: Box, modes: list[list[arb]]) -> Box | None:
        """Return what is left of a box, None also where a leg is too long or short all over it."""
        chart, middle, half = box
        q, T = [*map(arb, middle[:chart]), ONE, *map(arb, middle[chart:3])], middle[3:]
        r, t, N = length(map(arb, half[:3])), length(map(arb, half[3:])), length(q)
        R = rotation(*(v / dot(q, q).sqrt() for v in q))
        turned = (r * 2 / ONE.max(N - r)).min(arb(2))
        for b, p, reach in self.legs:
            way = [v + dot(row, p) - c for v, row, c in zip(T, R, b, strict=True)]
            off = abs(dot(way, way).sqrt() - reach)
            if off > t + turned * length(p) + MET / reach:
                return None
        return super().shrunk(box, modes)

    def at(self, chart: int, middle: list[arb]) -> tuple[list[arb], list[list[arb]]]:
        x = [Dual(arb(v), {k: ONE}) for k, v in enumerate(middle)]
        q, T = [*x[:chart], ONE, *x[chart:3]], x[3:]
        N = dot(q, q)
        R = [
            [v + (N - ONE) * (i == k) for k, v in enumerate(row)]
            for i, row in enumerate(rotation(*q))
        ]
        terms = [N * dot(T, T), N, *(N * v for v in T), *(v for row in R for v in row)]
        terms += [dot(T, column) for column in zip(*R, strict=True)]
        J = self.C * arb_mat([[term.d.get(k, ZERO) for k in range(6)] for term in terms])
        F = (self.C * arb_mat(17, 1, [term.v for term in terms])).entries()
        return F, J.transpose().tolist()

    def rests(self, W: arb_mat, middle: list[float], h: list[arb]) -> list[arb]:
        T, r, t, found = middle[3:], length(h[:3]), length(h[3:]), list[arb]()
        U = length(map(arb, middle[:3]))
        Q = (U * U + 1).sqrt()
        for w in (W * self.C).tolist():
            s, b, p = abs(w[0]), w[2:5], [v / 2 for v in w[14:]]
            A = abs(w[0] * dot(T, map(arb, T)) + w[1] + dot(b, T))
            K = length(w[5 + k] + p[k % 3] * T[k // 3] * 2 for k in range(9))
            along = length(w[0] * 2 * v + c for v, c in zip(T, b, strict=True))
            more, P = along * t + s * t * t, length(p)
            rest = Q * Q * s * t * t + U * r * more * 2 + r * r * (A + more)
            found.append((rest + t * r * P * (Q * 4 + r * 2) + r * r * K * 1.75).abs_upper())
        return found

    def mode(self, z: list[arb]) -> list[arb]:
        k = self.m.at[self.group[0], "x"]
        return [*z[k + 3 : k + 7], *(v / self.m.size for v in z[k : k + 3])]

    def inside(self, mode: list[arb], box: Box) -> bool:
        chart, middle, half = box
        x = [v / mode[chart] for k, v in enumerate(mode[:4]) if k != chart] + mode[4:]
        return all(abs(v - c) < r * WIDER for v, c, r in zip(x, middle, half, strict=True))
