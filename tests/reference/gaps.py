"""Planar mechanisms whose joints have gaps, solved by Newton's method, and their worst offsets.

Bodies have coordinates x, y, angle; a joint is a tuple of plain numbers. Owes nothing to the
package. Offsets are chosen as an adversary would: to move an output as far as they can.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

Array = np.ndarray[Any, np.dtype[Any]]
STEPS = 6
CLOSED = 1e-12


@dataclass(frozen=True)
class Side:
    """A point of a body, the ground is body -1."""

    body: int
    x: float = 0.0
    y: float = 0.0


@dataclass(frozen=True)
class Pair:
    """A joint: "pin", "slot", "guide", "bar", "gear", "rack" or "weld".

    ``gap`` is how far it opens from the middle: of a pin its radius, of a guide the play of both
    ends of a block of a ``length``, of a gear the angle of the first wheel.
    """

    kind: str
    first: Side
    second: Side
    gap: float = 0.0
    axis: float = 0.0
    turn: float = 0.0
    length: float = 0.0
    ratio: float = 1.0
    phase: float = 0.0
    carrier: int = -1


@dataclass(frozen=True)
class Drive:
    """What is imposed: the "angle" of a body less that of another one, or a "slide"."""

    kind: str
    first: Side
    second: Side
    axis: float = 0.0


class Open:
    """A mechanism with gaps; arrays have one row for each sample."""

    def __init__(self, bodies: int, pairs: Sequence[Pair], drives: Sequence[Drive]) -> None:
        self.n, self.pairs, self.drives = 3 * bodies, list(pairs), list(drives)
        self.spans: list[tuple[Pair, list[int]]] = []
        count = 0
        for pair in self.pairs:
            rows = {"pin": 2, "guide": 2, "weld": 3}.get(pair.kind, 1)
            self.spans.append((pair, list(range(count, count + rows))))
            count += rows
        self.count = count

    # -- geometry: value and gradient by q -------------------------------------------------------

    def point(self, q: Array, side: Side) -> tuple[Array, Array]:
        """Return places (s, 2) and their derivatives (s, 2, n)."""
        slope = np.zeros((len(q), 2, self.n))
        if side.body < 0:
            return np.broadcast_to([side.x, side.y], (len(q), 2)), slope
        k = 3 * side.body
        c, s = np.cos(q[:, k + 2]), np.sin(q[:, k + 2])
        arm = np.stack([c * side.x - s * side.y, s * side.x + c * side.y], axis=1)
        slope[:, 0, k] = slope[:, 1, k + 1] = 1.0
        slope[:, 0, k + 2], slope[:, 1, k + 2] = -arm[:, 1], arm[:, 0]
        return q[:, k : k + 2] + arm, slope

    def angle(self, q: Array, body: int) -> tuple[Array, Array]:
        slope = np.zeros((len(q), self.n))
        if body < 0:
            return np.zeros(len(q)), slope
        slope[:, 3 * body + 2] = 1.0
        return q[:, 3 * body + 2], slope

    def along(
        self, q: Array, body: int, axis: float, first: Side, second: Side
    ) -> tuple[Array, Array]:
        """Return the component of the way between two points along an axis of a body."""
        (a, da), (b, db) = self.point(q, first), self.point(q, second)
        turned, dturned = self.angle(q, body)
        e = np.stack([np.cos(turned + axis), np.sin(turned + axis)], axis=1)
        normal = np.stack([-e[:, 1], e[:, 0]], axis=1)
        gap = b - a
        slope = np.einsum("si,sij->sj", e, db - da)
        slope += (normal * gap).sum(axis=1)[:, None] * dturned
        return (e * gap).sum(axis=1), slope

    def rows_of(self, q: Array, pair: Pair) -> list[tuple[Array, Array]]:
        """Return the equations of a joint with their gradients."""
        one, two = pair.first.body, pair.second.body
        if pair.kind in ("pin", "weld"):
            (a, da), (b, db) = self.point(q, pair.first), self.point(q, pair.second)
            rows = [(b[:, i] - a[:, i], db[:, i] - da[:, i]) for i in range(2)]
        elif pair.kind in ("slot", "guide"):
            rows = [self.along(q, one, pair.axis + np.pi / 2, pair.first, pair.second)]
        elif pair.kind == "bar":
            (a, da), (b, db) = self.point(q, pair.first), self.point(q, pair.second)
            far = np.linalg.norm(b - a, axis=1)
            rows = [(far - pair.length, np.einsum("si,sij->sj", (b - a) / far[:, None], db - da))]
        else:
            (t1, d1), (t2, d2) = self.angle(q, one), self.angle(q, two)
            tc, dc = self.angle(q, pair.carrier)
            if pair.kind == "gear":
                value = pair.ratio * (t2 - tc) + pair.phase - (t1 - tc)
                rows = [(value, pair.ratio * (d2 - dc) - (d1 - dc))]
            else:
                way, slope = self.along(q, two, pair.axis, pair.first, pair.second)
                value = way - pair.length * (t1 - tc) - pair.phase
                rows = [(value, slope - pair.length * (d1 - dc))]
        if pair.kind in ("guide", "weld"):
            (t1, d1), (t2, d2) = self.angle(q, one), self.angle(q, two)
            rows.append((t2 - t1 - pair.turn, d2 - d1))
        return rows

    def equations(self, q: Array, u: Array) -> tuple[Array, Array]:
        """Return equations (s, n), those of the drives last, and their Jacobian (s, n, n)."""
        rows = [row for pair in self.pairs for row in self.rows_of(q, pair)]
        for k, drive in enumerate(self.drives):
            if drive.kind == "angle":
                (t1, d1), (t2, d2) = (self.angle(q, s.body) for s in (drive.first, drive.second))
                rows.append((t2 - t1 - u[k], d2 - d1))
            else:
                way, slope = self.along(q, drive.first.body, drive.axis, drive.first, drive.second)
                rows.append((way - u[k], slope))
        return np.stack([v for v, _ in rows], axis=1), np.stack([d for _, d in rows], axis=1)

    # -- solving ---------------------------------------------------------------------------------

    def solved(self, q: Array, u: Array, w: Array, parts: int = 1) -> tuple[Array, Array]:
        """Return q (s, n) with offsets w (s, rows) of the joints, from q without, and which close.

        The offsets grow in parts, so that the assembly mode stays.
        """
        x = np.broadcast_to(q, (len(w), self.n)).copy()
        for part in range(1, parts + 1):
            for _ in range(STEPS if part == parts else 3):
                F, J = self.equations(x, u)
                F[:, : self.count] -= w * (part / parts)
                x -= np.linalg.solve(J, F[..., None])[..., 0]
        F, _ = self.equations(x, u)
        F[:, : self.count] -= w
        return x, np.abs(F).max(axis=1) < CLOSED

    def offsets(self, draws: Callable[[Pair, list[int]], Array], samples: int) -> Array:
        """Return offsets (samples, rows), those of a joint from draws (samples, 2)."""
        w = np.zeros((samples, self.count))
        for pair, rows in self.spans:
            if not pair.gap:
                continue
            d = draws(pair, rows)
            if pair.kind == "pin":
                w[:, rows] = pair.gap * d / np.maximum(np.linalg.norm(d, axis=1), 1.0)[:, None]
            elif pair.kind == "guide" and pair.length:
                ends = pair.gap * np.clip(d, -1.0, 1.0)
                w[:, rows[0]] = ends.mean(axis=1)
                w[:, rows[1]] = np.arcsin((ends[:, 1] - ends[:, 0]) / pair.length)
            else:
                w[:, rows[0]] = pair.gap * np.clip(d[:, 0], -1.0, 1.0)
        return w

    def random(self, rng: np.random.Generator, samples: int) -> Array:
        """Return random offsets, most of them at the ends of the gaps."""

        def draw(pair: Pair, rows: list[int]) -> Array:
            d = rng.normal(size=(samples, 2))
            return d * rng.choice([0.3, 1.0, 10.0], size=(samples, 1), p=[0.2, 0.2, 0.6])

        return self.offsets(draw, samples)

    def worst(
        self, q: Array, u: Array, output: Callable[[Array], tuple[Array, Array]], w: Array,
        rounds: int = 6,
    ) -> tuple[Array, Array]:  # fmt: skip
        """Return outputs (all samples of all rounds,) as they climb from offsets w (s, rows).

        At each place the offsets go to where the output's gradient there is largest. `output`
        gives values (s,) and derivatives (s, n). Also returns which of the samples close.
        """
        values, closed = [], []
        for k in range(rounds + 1):
            x, there = self.solved(q, u, w)
            value, slope = output(x)
            values.append(value)
            closed.append(there)
            if k == rounds:
                break
            _, J = self.equations(x, u)
            g = np.linalg.solve(J.transpose(0, 2, 1), slope[..., None])[..., 0]

            def uphill(pair: Pair, rows: list[int], g: Array = g) -> Array:
                if pair.kind == "guide" and pair.length:
                    tilt = g[:, rows[1]] / pair.length
                    return 1e9 * np.stack([g[:, rows[0]] / 2 - tilt, g[:, rows[0]] / 2 + tilt], 1)
                d = g[:, rows[:2]] if len(rows) > 1 else np.repeat(g[:, rows], 2, axis=1)
                size = np.linalg.norm(d, axis=1)[:, None]
                return 10.0 * d / np.where(size > 0, size, 1.0)

            w = self.offsets(uphill, len(w))
        return np.concatenate(values), np.concatenate(closed)
