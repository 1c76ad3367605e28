"""Planar mechanisms closed in absolute coordinates: three for each body, rows for each joint.

Owes nothing to the package and nothing to closed forms: residuals in 80-bit floats, their Jacobian
written out, Newton's method on all bodies at once, and a follower that goes from pose to pose in
ever smaller steps. Rows of q are poses: x, y and angle of the bodies, one after the other.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

LD = np.longdouble
ROUNDS = 12
"""Steps of Newton's method from a pose that is claimed to be solved."""
SMALL = 1e-15
"""Share of the mechanism that the last of them changes at most."""
PIECES = (4, 32, 256)
"""Steps from pose to pose, smaller ones towards both; ever more where they do not arrive."""
SHRINKS = 0.1
"""Share of the first change by Newton's method that the second may have in such a step."""


@dataclass
class Closure:
    """Equations of a mechanism.

    ``joints`` are (kind, name, first place, second place, keys), places "body.point"; ``driver`` is
    "body.angle", "joint.angle", "joint.slide", or "body.point.x"; ``numbers`` the dimensions.
    """

    bodies: list[str]
    joints: list
    driver: str
    numbers: dict[str, float]
    wide: bool = True  # in 80 bits, else in 64

    def __post_init__(self):
        self.column = {body: 3 * k for k, body in enumerate(self.bodies)}
        points = [v for name, v in self.numbers.items() if name.count(".") == 2]
        self.scale = max((abs(v) for v in points), default=1.0) or 1.0

    # -- rows --------------------------------------------------------------------------------

    def number(self, name):
        return LD(self.numbers[name]) if self.wide else float(self.numbers[name])

    def _frame(self, q, body):
        if body == "ground":
            zero = np.zeros(len(q), q.dtype)
            return zero, zero, zero
        k = self.column[body]
        return q[:, k], q[:, k + 1], q[:, k + 2]

    def _place(self, q, place):
        """Return a point's coordinates and their derivatives by q."""
        body, point = place.split(".")
        x, y, turn = self._frame(q, body)
        a, b = (self.number(f"{body}.{point}.{axis}") for axis in "xy")
        c, s = np.cos(turn), np.sin(turn)
        dx, dy = c * a - s * b, s * a + c * b
        slopes = np.zeros((2, *q.shape), q.dtype)
        if body != "ground":
            k = self.column[body]
            slopes[0, :, k], slopes[1, :, k + 1] = 1, 1
            slopes[0, :, k + 2], slopes[1, :, k + 2] = -dy, dx
        return np.array([x + dx, y + dy]), slopes

    def _angle(self, q, body):
        slope = np.zeros(q.shape, q.dtype)
        if body != "ground":
            slope[:, self.column[body] + 2] = 1
        return self._frame(q, body)[2], slope

    def _along(self, q, body, angle, gap, across=False):
        """Return the part of a gap along a direction of a body, or across it, with derivatives."""
        (x, y), (sx, sy) = gap
        turn, slope = self._angle(q, body)
        c, s = np.cos(turn + angle), np.sin(turn + angle)
        if across:
            c, s = -s, c
        part = (c * y - s * x)[:, None] * slope
        return c * x + s * y, c[:, None] * sx + s[:, None] * sy + part

    def _rows(self, q, kind, name, one, two, keys):
        """Return the rows of a joint, each a value and its derivatives."""
        (p1, s1), (p2, s2) = self._place(q, one), self._place(q, two)
        gap = (p2 - p1, s2 - s1)
        first, second = one.split(".")[0], two.split(".")[0]
        (a1, t1), (a2, t2), (ac, tc) = (
            self._angle(q, body) for body in (first, second, keys.get("carrier", "ground"))
        )
        number = lambda entry: self.number(f"{name}.{entry}")  # noqa: E731
        rows = []
        if kind in ("revolute", "weld"):
            rows += [(gap[0][i], gap[1][i]) for i in range(2)]
        if kind in ("prismatic", "slot"):
            rows.append(self._along(q, first, number("axis"), gap, across=True))
        if kind in ("prismatic", "weld"):
            rows.append((a2 - a1 - number("turn"), t2 - t1))
        if kind == "distance":
            (x, y), (sx, sy) = gap
            length = number("length")
            value = (x * x + y * y - length * length) / (2 * length)
            rows.append((value, (x[:, None] * sx + y[:, None] * sy) / length))
        if kind in ("gear", "belt"):
            ratio = number("ratio") * (-1 if keys.get("crossed") else 1)
            rows.append(
                (ratio * (a2 - ac) + number("phase") - a1 + ac, ratio * (t2 - tc) - t1 + tc)
            )
        if kind == "friction-wheel":
            sense = 1 if keys["contact"] == "internal" else -1
            r1, r2 = number("radius"), sense * number("second_radius")
            value = r2 * (a2 - ac) - r1 * (a1 - ac - number("phase"))
            rows.append((value, r2 * (t2 - tc) - r1 * (t1 - tc)))
        if kind == "rack":
            value, slope = self._along(q, second, number("axis"), gap)
            rows.append(
                (
                    value - number("radius") * (a1 - ac) - number("phase"),
                    slope - number("radius") * (t1 - tc),
                )
            )
        assert rows, kind
        return rows

    def _driven(self, q):
        *part, coordinate = self.driver.split(".")
        if len(part) > 1:
            value, slope = self._place(q, ".".join(part))
            return value["xy".index(coordinate)], slope["xy".index(coordinate)]
        (part,) = part
        if part in self.column:
            return self._angle(q, part)
        _, name, one, two, _ = next(joint for joint in self.joints if joint[1] == part)
        if coordinate == "angle":
            (a1, t1), (a2, t2) = (self._angle(q, place.split(".")[0]) for place in (one, two))
            return a2 - a1, t2 - t1
        (p1, s1), (p2, s2) = self._place(q, one), self._place(q, two)
        axis = self.number(f"{name}.axis")
        return self._along(q, one.split(".")[0], axis, (p2 - p1, s2 - s1))

    def rows(self, q, u):
        """Return residuals (n, r), derivatives (n, r, columns), and the joint of each row."""
        real = LD if self.wide else float
        q, u = np.asarray(q, real), np.asarray(u, real)
        value, slope = self._driven(q)
        found, owners = [(value - u, slope)], [None]
        for joint in self.joints:
            own = self._rows(q, *joint)
            found += own
            owners += [joint] * len(own)
        return (
            np.stack([row[0] for row in found], 1),
            np.stack([row[1] for row in found], 1),
            owners,
        )

    # -- poses -------------------------------------------------------------------------------

    def step(self, q, u):
        """Return what Newton's method adds to poses, NaN where there is nothing to solve."""
        residual, slopes, _ = self.rows(q, u)
        slopes = slopes.astype(float)
        change = np.full(q.shape, np.nan)
        good = np.isfinite(slopes).all((1, 2)) & np.isfinite(residual.astype(float)).all(1)
        if good.any():
            right = residual[good].astype(float)[:, :, None]
            try:
                change[good] = -np.linalg.solve(slopes[good], right)[:, :, 0]
            except np.linalg.LinAlgError:
                for k in np.flatnonzero(good):
                    change[k] = -np.linalg.lstsq(slopes[k], residual[k].astype(float))[0]
        return change

    def gap(self, q, u):
        """Return how far a pose is from closing, each row as a share of its largest slope."""
        widths = np.tile([self.scale, self.scale, 1.0], len(self.bodies))
        residual, slopes, _ = (part[0] for part in self.rows(q[None], [u]))
        return float((np.abs(residual) / np.abs(slopes * widths).max(1)).max())

    def reach(self, q):
        """Return how far poses go, as multiples of the mechanism: more than 1 next to poles."""
        return np.fmax(np.abs(q.astype(float)).max(1) / self.scale, 1.0)

    def size(self, change):
        """Return the largest change of each pose: radians, and lengths by the mechanism's."""
        return np.abs(change / np.tile([self.scale, self.scale, 1.0], len(self.bodies))).max(1)

    def solved(self, q, u, rounds=ROUNDS):
        """Return the poses that Newton's method ends at, NaN where it does not end."""
        q = np.array(q, LD if self.wide else float)
        for _ in range(rounds):
            change = self.step(q, u)
            q = q + change
            size = self.size(change) / self.reach(q)
            if not (size > 10 * SMALL * (1 + np.abs(u).astype(float))).any():
                break
        q[~(size <= 1e-11)] = np.nan
        return q

    def rates(self, q, u):
        """Return the first two derivatives of poses by the driver, to 80 bits and 1e-15.

        Slopes along the motion are differences of fourth order.
        """
        _, slopes, _ = self.rows(q, u)
        right = np.zeros((*q.shape, 1), LD)
        right[:, 0] = 1
        first = _refined(slopes, right)
        h = LD(1e-4)
        one, two = (
            self.rows(q + k * h * first[:, :, 0], u)[1]
            - self.rows(q - k * h * first[:, :, 0], u)[1]
            for k in (1, 2)
        )
        along = (8 * one - two) / (12 * h)
        return first[:, :, 0], _refined(slopes, -(along @ first))[:, :, 0]

    def turned(self, q, u):
        """Return the sign of the determinant of all rows, which no motion changes."""
        _, slopes, _ = self.rows(q, u)
        return np.linalg.slogdet(slopes.astype(float))[0]

    def followed(self, q, u, v, pieces=PIECES):
        """Return the poses at v that are reached from those at u, NaN where none is.

        More steps are made where Newton's method is slow or jumps over a singular pose.
        """
        q, u, v = (np.asarray(own, LD if self.wide else float) for own in (q, u, v))
        found = np.full(q.shape, np.nan)
        left, sign = np.arange(len(q)), self.turned(q, u)
        for count in pieces:
            at, sure = q[left], np.ones(len(left), bool)
            for k in range(1, count + 1):
                share = (1 - np.cos(np.pi * k / count)) / 2 if k < count else 1.0
                to = u[left] + share * (v[left] - u[left])
                first = self.step(at, to)
                at = at + first
                second = self.step(at, to)
                at = at + second
                sure &= self.size(second) <= SHRINKS * self.size(first) + SMALL
            at = self.solved(at, v[left])
            sure &= np.isfinite(at.astype(float)).all(1)
            sure[sure] &= self.turned(at[sure], v[left][sure]) == sign[left][sure]
            found[left[sure]] = at[sure]
            left = left[~sure]
            if not left.size:
                break
        return found

    def signs(self, q, u, groups):
        """Return the signs (n, groups) of the determinants of groups of bodies, 0 where not square.

        ``groups`` are sets of bodies in the order in which they close; a row belongs to the last
        group that it names a body of.
        """
        _, slopes, owners = self.rows(q, u)
        slopes = slopes.astype(float)
        of_body = {body: k for k, group in enumerate(groups) for body in group}
        owner = []
        for joint in owners:
            named = [] if joint is None else [joint[2], joint[3], joint[4].get("carrier", "ground")]
            bodies = [place.split(".")[0] for place in named]
            owner.append(max((of_body.get(body, 0) for body in bodies), default=0))
        found = np.zeros((len(q), len(groups)))
        for k, group in enumerate(groups):
            rows = [i for i, own in enumerate(owner) if own == k]
            columns = [self.column[body] + i for body in sorted(group) for i in range(3)]
            if len(rows) == len(columns):
                found[:, k] = np.linalg.slogdet(slopes[:, rows][:, :, columns])[0]
        return found

    def fold(self, q, u):
        """Return the driver's value at the limit position next to a pose, NaN where there is none.

        Newton's method on {rows = 0, slopes v = 0, v.v = 1}, the slopes' change by differences.
        """
        m = q.size
        widths = np.tile([self.scale, self.scale, 1.0], len(self.bodies))
        q, u = np.array(q, LD), LD(u)
        first = (self.rows(q[None], [u])[1][0] * widths).astype(float)
        rows = 1 / np.abs(first).max(1)  # lengths and angles alike
        v = np.linalg.svd(first * rows[:, None])[2][-1]
        for _ in range(20):
            residual, slopes, _ = (part[0] for part in self.rows(q[None], [u]))
            residual, slopes = residual * rows, slopes.astype(float) * rows[:, None]
            ahead, behind = (
                self.rows((q + sign * 1e-6 * widths * v)[None], [u])[1][0] for sign in (1, -1)
            )
            # second derivatives are symmetric
            bent = ((ahead - behind) / 2e-6 * widths).astype(float) * rows[:, None]
            system = np.zeros((2 * m + 1, 2 * m + 1))
            system[:m, :m], system[0, m] = slopes * widths, -rows[0]
            system[m : 2 * m, :m], system[m : 2 * m, m + 1 :] = bent, slopes * widths
            system[2 * m, m + 1 :] = 2 * v
            right = np.concatenate([residual.astype(float), (slopes * widths) @ v, [v @ v - 1]])
            try:
                change = np.linalg.solve(system, -right)
            except np.linalg.LinAlgError:
                return np.nan
            q, u, v = q + widths * change[:m], u + LD(change[m]), v + change[m + 1 :]
            if np.abs(change).max() < 1e-12 * (1 + abs(float(u))):
                return float(u)
        return np.nan


def _refined(slopes, right):
    """Solve linear equations whose residuals are taken in 80 bits."""
    inverse = np.linalg.inv(slopes.astype(float))
    found = np.zeros(right.shape, LD)
    for _ in range(8):
        found += inverse @ (right - slopes @ found).astype(float)
    return found
